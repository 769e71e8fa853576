// Which side of another body a vertex is on: the side that it came from, and not the surface that happens to be nearest at the end
// of a step. What moves far in a step, or is pressed deep, would otherwise be pushed out on the far side and have passed through.
//
// A vertex that goes into a body is remembered with the triangle by which it went in (SolidEntry). While the nearest surface looks the
// same way it follows that. Once it does not, because the vertex is past the middle, or through, it stays with the side it came by: out is
// where a way along that triangle's normal leaves the body; where there is none it is beside the body, and free. A vertex that
// nobody remembers is asked for the path of the step: the first triangle that it met, both moving linearly
// (collision::sweep_vertex_face, which misses nothing), is where it went in.
#pragma once

#include "base/triangle_tree.hpp"
#include "engine/state/step_report.hpp"
#include "engine/step/solid/solid_scratch.hpp"

#include <algorithm>
#include <optional>

namespace trocar::engine {

/// One body's places against the other's surface.
struct OneWay {
    const SceneModel& model;
    const State& state;
    SolidScratch& solids;
    StepReport& report;
    std::size_t own, other;
    std::vector<SolidEntry>& entries; // of this step

    [[nodiscard]] const std::vector<Vec3>& surface(std::size_t body) const { return state.bodies[body].surface; }
    [[nodiscard]] std::span<const Vec3> surface_t0(std::size_t body) const {
        return model.bodies[body].moves() ? solids.bodies[body].surface_t0 : std::span<const Vec3>(state.bodies[body].surface);
    }
    /// m; motion of the step that all solids may share: nothing comes nearer by it.
    [[nodiscard]] const Vec3& shared() const { return solids.shared; }
    /// m; how much farther than in the last step the two may come against each other, as far as that is known.
    [[nodiscard]] double known_change() const { return (solids.bodies[own].change - solids.bodies[other].change).norm(); }
    [[nodiscard]] const Triangle& face(Index triangle) const { return model.bodies[other].surface.triangles[triangle]; }
    /// Unit; where a vertex of its own looks to.
    [[nodiscard]] Vec3 looking(Index vertex) const {
        return normal_of_vertex(solids.bodies[own].adjacency, model.bodies[own].surface.triangles, vertex, surface(own));
    }
};

/// In a list by key; nullptr: nobody remembers that this vertex is in.
template <class Entries>
[[nodiscard]] auto find_entry(Entries& entries, const decltype(SolidEntry{}.key()) & key) -> decltype(entries.data()) {
    const auto found =
        std::lower_bound(entries.begin(), entries.end(), key, [](const SolidEntry& x, const auto& wanted) { return x.key() < wanted; });
    return found != entries.end() && found->key() == key ? &*found : nullptr;
}

/// How a vertex stands to the other body.
struct Standing {
    bool inside = false;  // in the body, or through it
    bool pressed = false; // nearest is another side than the one it came by, and that is deep
    bool passed = false;  // the far side, even: it lies beyond the middle, or beyond all of the body
    Index by = kNoIndex;  // triangle of the other, by which it came
    SurfacePoint at;      // of the other's surface at the end of the step, on that side
};

/// Where a vertex stands at the end of the step; nothing where the surface is farther than the two moved against each other in the step,
/// and `reach`. reach    m, for what is outside cost     a closest-point query and an inside test; where it may have crossed, also the
/// sweeps of what its path comes near
[[nodiscard]] std::optional<Standing> find_standing(const OneWay& way, Index vertex, double reach);

/// A part of a straight line, and the faces that it is asked for.
struct Line {
    Vec3 direction;   // unit
    double begin, end; // m, from the place on
    double side;      // 1: faces that look along it, -1: against it
};

/// The first of these faces that the line meets: the place on it, and how far along that is. Nothing: it meets none. Of faces that look along it (a way
/// out) the first among those whose boxes the earliest piece of the line meets, which a large slanted face may win against a nearer one.
/// cost   of the boxes that a line's pieces overlap, as far as the first face
[[nodiscard]] std::optional<SurfacePoint> find_face_along(const OneWay& way, const Vec3& place, const Line& line);

/// m/s; what has passed, or lies deep, comes back at this speed where nothing drives it. Faster would heat what is only pressed too hard.
inline constexpr double kRecovery = 0.1;

} // namespace trocar::engine
