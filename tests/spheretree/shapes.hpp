// Surfaces for the sphere tree tests: tubes along curves, icospheres, and the meshes of the test data.
#pragma once

#include "base/mesh.hpp"

#include <functional>
#include <optional>
#include <string>

namespace trocar::spheretree::test {

struct TubeShape {
    std::function<Vec3(double)> axis;     // parameter [0, 1] to m
    std::function<double(double)> radius; // parameter [0, 1] to m
    unsigned sides = 24, rings = 40;
};

/// Closed tube with flat caps, outward: 2 * sides * rings triangles about.
[[nodiscard]] TriMesh make_tube(const TubeShape& shape);

/// Straight along z from 0 to `length`.
[[nodiscard]] TriMesh make_straight_tube(double radius, double length, unsigned sides = 24, unsigned rings = 40);

/// 20 * 4^levels triangles.
[[nodiscard]] TriMesh make_icosphere(const Vec3& centre, double radius, unsigned levels);

/// A file of the test data (OBJ, plain), scaled, turned outwards where it is inward. Empty where TROCAR_TEST_DATA does
/// not name a folder that has it.
[[nodiscard]] std::optional<TriMesh> read_test_obj(const std::string& name, double scale);

/// Small reproducible generator; tests print their seed.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    /// Uniform in [lo, hi).
    double uniform(double lo, double hi) {
        state_ += 0x9E3779B97F4A7C15ULL;
        std::uint64_t z = state_;
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
        z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
        return lo + (hi - lo) * static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
    }
    Vec3 in_box(const Box3& box) {
        const double x = uniform(box.lo[0], box.hi[0]), y = uniform(box.lo[1], box.hi[1]);
        return {x, y, uniform(box.lo[2], box.hi[2])};
    }

private:
    std::uint64_t state_;
};

} // namespace trocar::spheretree::test
