// The outline of a region of a surface, and whether it meets itself when it is seen along a direction: what makes the criterion of
// the normals' cone exact.
//
// Why it is exact. Let all faces of the region keep a positive scalar product with a direction V during the whole step. Seen along V
// they are all turned the same way, so the number of faces that lie over a point of the plane is the number of times that the
// region's oriented border winds around it. If the border's loops meet neither themselves nor each other and wind around no point
// twice, no two faces lie over each other: none meet but where they share a vertex. This needs no manifold and no disc; it needs the
// border's edges to be right as a chain (a shared edge of two faces run through it in opposite directions and cancel).
// source   Volino, Magnenat-Thalmann, "Efficient self-collision detection on smoothly discretized surface animations using geometrical
//          shape regularity" (1994); Tang, Curtis, Yoon, Manocha, "ICCD: interactive continuous collision detection between deformable
//          models using connectivity-based culling" (2009), for the whole step. Deviates: any number of loops, by winding numbers.
#pragma once

#include "collision/topology.hpp"

#include <span>
#include <vector>

namespace trocar::collision {

/// Closed loops of vertices: the border of a set of faces, each edge as its face runs through it.
struct Contour {
    std::vector<Index> vertices;  // loop by loop
    std::vector<Index> loop_ends; // into vertices
};

/// Regions with a longer outline are not tested: most of them fail, and the pieces of those that would not are tested anyway.
inline constexpr std::size_t kLongestContour = 256; // edges

/// triangles  all of the surface; of which `faces` are some
/// fails   with false where the border is longer than kLongestContour, or is no set of simple loops of vertices: an edge is run through
///         twice in one direction (faces turned differently, more than two at an edge) or a vertex is passed twice; also where there is
///         no border (a closed surface), or a face repeats a vertex
/// cost    O(f log f)
[[nodiscard]] bool make_contour(std::span<const Triangle> triangles, std::span<const Index> faces, Contour& out);
[[nodiscard]] inline bool make_contour(const SurfaceTopology& topology, std::span<const Index> faces, Contour& out) {
    return make_contour(topology.triangles, faces, out);
}

/// The same of border edges that the caller has found: each as its face runs through it. They are sorted.
[[nodiscard]] bool make_contour(std::vector<std::array<Index, 2>>& border, Contour& out);

/// A contour as spans of arrays owned elsewhere.
struct ContourView {
    std::span<const Index> vertices, loop_ends;
};

/// Scratch kept between calls, so that the test does not allocate.
class ContourTest {
public:
    /// True only if the outline of faces that all have a positive scalar product with the direction is proven, seen along it, to meet
    /// itself at no time of the step and to wind around no point twice. False where that cannot be told.
    /// direction   unit
    [[nodiscard]] bool is_simple(const ContourView& contour, const SurfaceMotion& motion, const Vec3& direction);

private:
    struct Place {
        double x0, y0, x1, y1; // m, in the plane, at both ends of the step, from the first vertex
    };
    struct Side {
        double x_lo, x_hi, y_lo, y_hi; // swept
        Index from, to;                // places
        Index loop;
    };
    void project(const ContourView& contour, const SurfaceMotion& motion, const Vec3& direction);
    void make_sides(const ContourView& contour);
    [[nodiscard]] bool turns_clear(const ContourView& contour) const noexcept;
    [[nodiscard]] bool sides_stay_apart();
    [[nodiscard]] bool winding_is_simple(const ContourView& contour) const noexcept;
    /// Of all other loops around a place at t0; false: cannot be told.
    [[nodiscard]] bool winding_of_others(Index place, Index loop, int& winding) const noexcept;

    std::vector<Place> places_; // [contour vertices]
    std::vector<Side> sides_;   // [contour vertices] sorted by x_lo
    double size_ = 0.0;         // m, no coordinate is larger
};

} // namespace trocar::collision
