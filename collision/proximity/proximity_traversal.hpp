// From the roots of two cone trees, or of one against itself, to the pairs of faces that come near: the recursion of section 6, what it
// skips, and what it takes over from the step before.
#pragma once

#include "base/contact.hpp"
#include "collision/proximity/cone_tree.hpp"
#include "collision/proximity/face_proximity.hpp"

#include <vector>

namespace trocar::collision {

/// Two faces that come as near as d_close.
struct Proximity {
    SurfaceIndex surface_a = 0, surface_b = 0;  // surface_a <= surface_b
    Index face_a = kNoIndex, face_b = kNoIndex; // within a body the lower one first
    FaceProximity found;                        // distance, closest points, time
    bool kept = false;                          // closest points are those of an earlier step; distance and time are of these points
};

struct ProximityStats {
    std::uint64_t box_tests = 0;                 // boxes of two nodes or faces
    std::uint64_t face_tests = 0;                // pairs of faces whose distance was computed
    std::uint64_t near = 0;                      // of those, how many are as near as d_close
    std::uint64_t cone_skips = 0;                // nodes that were not tested against themselves
    std::uint64_t contour_tests = 0;             // outlines tested; cone_skips of them passed
    std::uint64_t angle_skips = 0;               // pairs of faces that the leaf angle left out
    std::uint64_t list_pairs = 0;                // in the separation list
    std::uint64_t kept_nodes = 0, kept_near = 0; // pairs of nodes whose results were kept, and those results

    void add(const ProximityStats& part) noexcept;
};

/// One tree, refitted, and its motion.
struct ProximitySide {
    SurfaceIndex surface = 0;
    const ConeTree* tree = nullptr;
    SurfaceMotion motion;
    double strayed = 0.0; // m, largest distance of a vertex at t0 from its position at the last step's t1
};

class ProximityTraversal {
public:
    /// One tree twice: a surface against itself.
    void build(const ProximityOptions& options, std::size_t arity);
    /// Appends what comes near, in an order that depends on the trees.
    /// coordinate   m, no coordinate of either surface is larger
    void find(const ProximitySide& a, const ProximitySide& b, double coordinate, std::vector<Proximity>& out);

    /// Nothing of the steps before may be used again.
    void forget() noexcept {
        old_records_.clear();
        list_age_ = 0;
    }

    [[nodiscard]] const ProximityStats& stats() const noexcept { return stats_; } // of the last find
    [[nodiscard]] std::size_t memory() const noexcept;                            // bytes

private:
    struct SlotPair {
        Index a, b;
        friend auto operator<=>(const SlotPair&, const SlotPair&) = default;
    };
    /// Results beneath a pair of nodes, and how far the nodes may have moved relative to each other since they were found.
    struct Record {
        SlotPair at;
        std::size_t begin, end; // into results_ of its step
        double travelled;       // m
    };

    [[nodiscard]] bool within() const noexcept { return a_.tree == b_.tree; }
    void set_reach(double coordinate);
    void start_from_root();
    void start_from_list();
    void run();
    void open(SlotPair at);
    void open_self(Index slot);
    void open_pair(SlotPair at);
    void take_near(SlotPair at);
    void stop_at(SlotPair at);
    void test_faces(Index face_a, Index face_b);
    [[nodiscard]] std::uint32_t near_children_of(const ConeTree& tree, Index node, const ConeTree& other_tree, Index other);
    [[nodiscard]] bool is_near(SlotPair at) noexcept;
    [[nodiscard]] bool skips_itself(Index slot);
    [[nodiscard]] bool looks_flat(Index face_a, Index face_b) const noexcept;
    [[nodiscard]] SweptFace corners_of(const ProximitySide& side, Index face) const noexcept;

    [[nodiscard]] bool is_recorded(SlotPair at) const noexcept;
    void open_recorded(SlotPair at);
    [[nodiscard]] const Record* find_record(SlotPair at) const noexcept;
    void keep_results(const Record& record);
    void finish_records();

    ProximityOptions options_;
    double flat_cosine_ = 0.0, leaf_cosine_ = 2.0;
    ProximitySide a_, b_;
    double distance_ = 0.0;
    std::array<float, kMaxSlabs> reach_{}; // m along each direction, times its length, rounded up
    std::vector<SlotPair> stack_;          // pairs that are known to be near
    std::vector<SlotPair> list_, old_list_;
    std::size_t list_age_ = 0;                  // steps since the list was made, 0: there is none
    std::vector<Record> records_, old_records_; // old_records_: sorted by `at`
    std::vector<Proximity> results_, old_results_;
    ContourTest contour_test_;
    ProximityStats stats_;
};

} // namespace trocar::collision
