// A place where two bodies may push one another in the sub-steps of a step, as the solver of their contact sees it.
#pragma once

#include "base/vec.hpp"
#include "fem/tissue/force_plan.hpp"

#include <cstdint>
#include <limits>
#include <span>

namespace trocar::engine {

/// A body whose nodes contact moves, while it is advanced.
struct GivingBody {
    std::span<fem::NodeRecord> nodes; // in the plan's order
    const double* inv_mass = nullptr; // [nodes] 1/kg

    // of its nodes that can move, in the sub-step in hand: what holds it as a whole sees no more of it
    double mass = 0.0; // kg; 0: nothing holds it
    Vec3 centre = Vec3::Zero(), velocity = Vec3::Zero(), change = Vec3::Zero(); // m, m/s, m/s
    Vec3 turning = Vec3::Zero(); // rad/s, as if it were rigid
    double stopped = 0.0; // [-] of its turning, that goes with what is stopped of its velocity against what stands still
};

/// A place of one of the two bodies: an affine image of the tetrahedron beneath it, or, where its triangle or edge is longer than those, the
/// mean of its corners' images.
struct ContactSide {
    static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
    static constexpr std::size_t kMostFeet = 3;
    std::uint32_t slot = kNone;       // of the giving bodies; kNone: it stands still, or goes its scripted way
    std::size_t owner = 0;            // the body whose nodes carry it
    std::size_t feet = 0;             // 0: no node carries it
    double share[kMostFeet] = {};     // [feet] sum 1
    Index record[kMostFeet][4] = {};  // [feet] of the owner's tetrahedra
    double weight[kMostFeet][4] = {}; // [feet] affine coordinates at the step's start; sum 1
    double blend = 1.0;               // [-] of its tetrahedra's motion
    Vec3 start = Vec3::Zero();        // m, its image then
    Vec3 velocity = Vec3::Zero();     // m/s, of what no node carries

    [[nodiscard]] bool gives() const noexcept { return feet > 0; }
    /// position(record)
    template <class Position>
    [[nodiscard]] Vec3 image(std::size_t foot, Position&& position) const {
        Vec3 sum = Vec3::Zero();
        for (std::size_t k = 0; k < 4; ++k) sum += weight[foot][k] * position(record[foot][k]);
        return sum;
    }
    template <class Position>
    [[nodiscard]] Vec3 image(Position&& position) const {
        Vec3 sum = Vec3::Zero();
        for (std::size_t foot = 0; foot < feet; ++foot) sum += share[foot] * image(foot, position);
        return sum;
    }
};

struct ContactRow {
    ContactSide a, b;
    Vec3 normal = Vec3::UnitX(); // unit, from b to a
    double gap = 0.0;            // m, at the step's start
    double recovery = 0.0;       // m/s, at which what lies in the other one is pushed out
    double friction = 0.0;       // Coulomb's
    /// m; above 0 it is no place. The two are held as wholes, for what nobody looked at between them: their mean velocities come no nearer along
    /// the line of their mass centres, by one change of velocity for all nodes of each, which turns and deforms nothing. Where one of them does
    /// not give, the other neither slides nor turns. Approach ends within so much.
    double room = 0.0;
    [[nodiscard]] bool is_whole() const noexcept { return room > 0.0; }
    Vec3 impulse = Vec3::Zero(); // N s, on a, of the last sub-step
    Vec3 last = Vec3::Zero();    // N s, the same of the last whole sub-step: what the next step starts with
    Vec3 sum = Vec3::Zero();     // N s, on a, of the step
    /// m/s, of a against b after the last sub-step: before the kick and the impulses of this one; of a row that this one is the first to solve,
    /// after the kick
    Vec3 before = Vec3::Zero();

    /// What a node moves by an impulse, and what its motion is of the relative velocity.
    struct Entry {
        std::uint32_t slot;
        Index record;
        double weight = 0.0;   // [-] of a's less of b's
        double per_mass = 0.0; // 1/kg, the same over the node's mass
    };
    std::size_t entries = 0;
    Entry entry[2 * ContactSide::kMostFeet * 4];
    std::uint8_t entry_of[2][ContactSide::kMostFeet][4] = {}; // of a's and b's nodes

    // of the sub-step
    Vec3 change = Vec3::Zero(), direction = Vec3::Zero(); // N s, of its impulse in the last pass; conjugate to those before
    Vec3 kicked = Vec3::Zero(); // m/s, of a against b before its impulses
    double now = 0.0;      // m, its gap
    double mobility = 0.0; // 1/kg, W
    double target = 0.0;   // m/s, least speed of parting
    bool active = false;   // it pressed when it was relaxed last
};

} // namespace trocar::engine
