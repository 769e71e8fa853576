// State shown by the page at one instant: copied between two steps into memory that is there already.
#pragma once

#include "engine/viewer/session.hpp"

#include <array>
#include <vector>

namespace trocar::engine::viewer {

using Point = std::array<float, 3>; // m: a tenth of a micrometre in a body of a metre

struct ContactDot {
    Point point{};
    float depth = 0.0f; // m
};

enum class SphereKind : std::uint8_t { Free, Contact, Assumed };
struct ShownSphere {
    Point centre{};
    float radius = 0.0f; // m
    SphereKind kind = SphereKind::Free;
};

/// Where an instrument ends, in the world's frame.
struct TipPose {
    Vec3 position = Vec3::Zero();  // m
    Vec3 direction = Vec3::UnitZ(); // unit, along the rod out of its tip
    Vec3 across = Vec3::UnitX();   // unit, at right angles: turns with the material
};

/// Surfaces in the order of the page's parts: bodies, then the skins of instruments.
struct Snapshot {
    std::vector<std::vector<Point>> surfaces; // [part][vertex_count]
    std::vector<bool> moves;                  // [part] false: as in the first snapshot, for ever
    std::vector<ContactDot> contacts;         // at most kMostDots
    std::vector<ShownSphere> spheres;         // at most kMostSpheres; empty unless asked for
    std::vector<Point> rod;                   // nodes of the first instrument, the inserted ones
    std::vector<TipPose> tips;                // [instrument]
    std::vector<Vec3> axes;                   // memory for those
    std::size_t contacts_left_out = 0, spheres_left_out = 0;
    SessionStatus status;
    StepReport report; // of the last step; its failure is what stopped the run
    effects::ContrastBalance contrast;
    double assumed_error_m = 0.0;
    double pace = 1.0; // simulated s per s, over the last second
    std::uint64_t run = 0;
    std::uint64_t work_enough = 0; // Session::work_enough
    std::size_t recorded_steps = 0;
    bool repeatable = false;
};

inline constexpr std::size_t kMostDots = 2000, kMostSpheres = 6000;

/// Sizes a snapshot for a session, with every surface as it is now.
void prepare_snapshot(Session& session, Snapshot& snapshot);
/// Fills it. Allocates nothing.
/// spheres  those of the level that the last descent reached
void fill_snapshot(Session& session, bool spheres, Snapshot& snapshot);

} // namespace trocar::engine::viewer
