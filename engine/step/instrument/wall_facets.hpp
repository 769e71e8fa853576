// The wall's triangles near one place of a rod, and the planes that they give it.
#pragma once

#include "base/closest_point.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/instrument/wall_exchange.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace trocar::engine {

inline constexpr std::size_t kNearTriangles = 64; // of a place
/// m; nearest points of triangles that are one point of the edge or corner that they share.
inline constexpr double kSamePoint = 1e-12;
struct NearTriangle {
    Index triangle;
    double distance; // m, signed, of the rod where it was from the wall where it will be
    Vec3 normal;
    Vec3 seen;     // m, of the wall where it was found
    Vec3 point;    // m, of the wall at t1
    Vec3 velocity; // m/s
    std::array<double, 3> bary;
    double facing = 0.0; // cosine between its outward normal and the way from it to the place
};

/// The nearest triangles of one place, nearest first; a longer list than kNearTriangles drops its farthest.
class NearList {
public:
    void clear() noexcept { size_ = 0; }
    void add(const NearTriangle& entry) noexcept {
        const Key key{entry.distance, entry.triangle, static_cast<Index>(size_)};
        std::size_t at = size_;
        while (at > 0 && key < keys_[at - 1]) --at;
        if (at >= kNearTriangles) return;
        const std::size_t last = std::min(size_, kNearTriangles - 1);
        const Index slot = size_ < kNearTriangles ? key.slot : keys_[last].slot;
        std::copy_backward(keys_.begin() + static_cast<std::ptrdiff_t>(at), keys_.begin() + static_cast<std::ptrdiff_t>(last),
                           keys_.begin() + static_cast<std::ptrdiff_t>(last) + 1);
        keys_[at] = {key.distance, key.triangle, slot};
        entries_[slot] = entry;
        size_ = last + 1;
    }
    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] const NearTriangle& operator[](std::size_t k) const noexcept { return entries_[keys_[k].slot]; }
    /// m, of a full list: what is farther away would not be in it. Infinite: it has room.
    [[nodiscard]] double full_within() const noexcept {
        return size_ < kNearTriangles ? std::numeric_limits<double>::infinity() : keys_[kNearTriangles - 1].distance;
    }

    /// Normals away from the wall become such that look into the lumen: what has gone out is brought back. On which side of an edge or a
    /// corner a place is the face says that looks at it most; the others beside it may look away.
    void turn_inwards() noexcept {
        std::array<double, kNearTriangles> facing;
        for (std::size_t i = 0; i < size_; ++i) {
            const NearTriangle& own = (*this)[i];
            facing[i] = own.facing;
            for (std::size_t k = 0; k < size_; ++k)
                if (const NearTriangle& other = (*this)[k];
                    (other.seen - own.seen).squaredNorm() < kSamePoint * kSamePoint && std::abs(other.facing) > std::abs(facing[i]))
                    facing[i] = other.facing;
        }
        for (std::size_t i = 0; i < size_; ++i)
            if (NearTriangle& own = entries_[keys_[i].slot]; facing[i] > 0.0) own.normal = -own.normal;
    }

private:
    struct Key {
        double distance;
        Index triangle, slot; // of entries_
        [[nodiscard]] bool operator<(const Key& other) const noexcept {
            return distance < other.distance || (distance == other.distance && triangle < other.triangle);
        }
    };
    std::array<NearTriangle, kNearTriangles> entries_; // as they came
    std::array<Key, kNearTriangles> keys_;             // ascending
    std::size_t size_ = 0;
};

/// Cosine above which a new plane goes on with the forces of a last one.
inline constexpr double kSameDirection = 0.9;
/// The last step's planes, in the order of their places: warm start of the new ones.
class LastPlanes {
public:
    /// wall   whose motion of the step the tissue has felt the pushes over; `pushes` empty: a wall that no force moves in this step
    LastPlanes(std::span<const fem::RodPlane> planes, std::span<const WallPress> presses, std::span<const WallPush> pushes,
               const collision::SurfaceMotion& wall, std::vector<std::uint8_t>& taken) noexcept
        : planes_(planes), presses_(presses), pushes_(pushes), wall_(wall), taken_(taken) {
        taken_.assign(planes_.size(), 0); // reserved
    }

    /// Those at a place of the rod; places are asked for in ascending order.
    void seek(Index node, double weight) noexcept {
        node_ = node, weight_ = weight;
        while (at_ < planes_.size() && before(planes_[at_], node, weight)) ++at_;
        while (push_at_ < pushes_.size() && before(pushes_[push_at_], node, weight)) ++push_at_;
        end_ = at_;
        while (end_ < planes_.size() && planes_[end_].node == node && planes_[end_].weight == weight) ++end_;
    }
    /// Forces of the one that pushed most nearly along the new one's normal; each is given once.
    void warm_start(fem::RodPlane& plane) noexcept {
        std::size_t best = end_;
        double nearest = kSameDirection;
        for (std::size_t k = at_; k < end_; ++k)
            if (const double along = planes_[k].normal.dot(plane.normal); taken_[k] == 0 && planes_[k].force > 0.0 && along > nearest)
                nearest = along, best = k;
        if (best == end_) return;
        taken_[best] = 1;
        plane.start_force = planes_[best].force;
        plane.start_drag = planes_[best].drag;
    }
    /// What the tissue felt at the place at the step's end, as the rod does. visit(N)
    template <class Visit>
    void for_each_felt(Visit&& visit) const {
        for (std::size_t k = push_at_; k < pushes_.size() && pushes_[k].node == node_ && pushes_[k].weight == weight_; ++k)
            visit(felt_of(pushes_[k], way_of(pushes_[k], wall_)));
    }

private:
    template <class AtPlace>
    static bool before(const AtPlace& what, Index node, double weight) noexcept {
        return what.node < node || (what.node == node && what.weight < weight);
    }
    std::span<const fem::RodPlane> planes_;
    std::span<const WallPress> presses_;
    std::span<const WallPush> pushes_;
    const collision::SurfaceMotion& wall_;
    std::vector<std::uint8_t>& taken_;
    std::size_t at_ = 0, end_ = 0, push_at_ = 0;
    Index node_ = 0;
    double weight_ = 0.0;
};

/// By how much a wall gives way to a rod, and which of the two is softer.
class Yielding {
public:
    Yielding(const SceneModel& model, std::size_t index, const State& state, const RodsScratch& rods) noexcept
        : model_(model), index_(index), state_(state), rods_(rods) {}

    [[nodiscard]] bool is_tissue() const noexcept { return rods_.tissue_moves && model_.bodies[lumen()].host_body; }
    /// Nodes in ascending order, from the first that may press on.
    void come_to(Index node) noexcept {
        const std::vector<Vec3>& position = rods_.instruments[index_].rod_t0.position;
        rod_ += 1.0 / model_.instruments[index_].rod.stretch_stiffness[node];
        axis_ = spheretree::direction_of(position[node + 1] - position[node]);
    }
    /// m/N; where nothing pressed yet.
    [[nodiscard]] double before_force(const WallPress& press) const noexcept { return find_wall_give(model_, lumen(), press, rods_); }
    [[nodiscard]] double along(const WallPress& press, const Vec3& normal) const {
        return find_exact_give(model_, lumen(), press, normal, state_, rods_);
    }
    /// Of the rod counts its length from the handle: across its axis it bends.
    [[nodiscard]] bool is_softer(const Vec3& normal, double give) const noexcept {
        const double along = normal.dot(axis_);
        return along * along * give > rod_;
    }

private:
    [[nodiscard]] std::size_t lumen() const noexcept { return model_.instruments[index_].lumen; }
    const SceneModel& model_;
    std::size_t index_;
    const State& state_;
    const RodsScratch& rods_;
    double rod_ = 0.0; // m/N
    Vec3 axis_ = Vec3::Zero();
};

/// A place of a rod for which planes are made, and the wall as it is seen from there.
struct PlaneSite {
    Index node;
    double weight;
    Vec3 place; // m
    double room;     // m, that it keeps
    double farthest; // m; what is farther away gets no plane
    const collision::SurfaceMotion& wall; // at t1
    double friction = 1.0; // [-] of the instrument's
};

/// Planes of one place. What looks along the force that the tissue felt last is one side, and moves as one: facets that press in a fold stay
/// together, whichever of them is nearest. The others are sides as they look the same way.
/// yielding   null: the wall does not
void add_planes(const NearList& list, const PlaneSite& site, LastPlanes& last, InstrumentState& now, const Yielding* yielding);

} // namespace trocar::engine
