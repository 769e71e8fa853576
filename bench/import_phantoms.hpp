// Label maps with known radii, for the bench of imports: straight, slanting, tapering, bent and branching tubes.
#pragma once

#include "base/result.hpp"
#include "engine/importing/centreline_branches.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

struct PhantomTube {
    std::vector<Vec3> axis;    // m
    std::vector<double> radii; // m, [axis]
};

struct LabelPhantom {
    std::string name;
    std::vector<PhantomTube> tubes;
    std::vector<Vec3> forks; // m, where tubes meet: no radius is known near them
    std::size_t size = 128;  // voxels along each side
    double voxel = 5e-4;     // m
};

/// quick  only the first
[[nodiscard]] std::vector<LabelPhantom> make_phantoms(bool quick);
[[nodiscard]] Result<void> write_phantom(const LabelPhantom& phantom, const std::filesystem::path& file);

struct RadiusError {
    double most = 0.0;      // m
    std::size_t points = 0; // that were compared: not near a fork or an end
};
[[nodiscard]] RadiusError measure_radii(const LabelPhantom& phantom, const std::vector<CentrelineBranch>& branches);

} // namespace trocar::engine
