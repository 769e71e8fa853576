// Cantilevers that SOFA and CalculiX computed, on the same geometry and load here.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <span>
#include <string_view>

namespace trocar::engine {

enum class BeamSource : std::uint8_t { SofaLinear, SofaCorotational, CalculixQuadratic };

struct ReferenceBeam {
    BeamSource source;
    std::string_view name, label; // label: short, for an axis
    std::string_view file;        // in the folder of reference beams
    double least, most;           // [-] our tip over theirs
    std::string_view difference;  // why it is not 1
};

[[nodiscard]] std::span<const ReferenceBeam> reference_beams();

struct BeamTips {
    double ours, reference;
}; // m, mean deflection of the free end along the load

/// fails  FileNotFound, BadSyntax: the reference is missing or changed
[[nodiscard]] Result<BeamTips> compare_beam(const ReferenceBeam& beam, const std::filesystem::path& folder, bool quick);

} // namespace trocar::engine
