// Interruptible descent through pairs of sphere trees, breadth first, all body pairs sharing one queue. Whatever is still
// open when the budget ends is assumed to collide: nothing is missed, only seen more coarsely.
//
// This work is based on: Mendoza & O'Sullivan 2005, section 4 (PairList and CollisionList, roles swapped on the way down).
// Deviates for hollow bodies: a group of instrument links is proven free as a whole by one inscribed sphere of the lumen, and
// split where no ball holds it; a single link is searched for the ball that holds it best.
#pragma once

#include "base/contact.hpp"
#include "base/work_budget.hpp"
#include "spheretree/update/chain_tree.hpp"
#include "spheretree/update/deforming_tree.hpp"
#include "spheretree/traverse/descent_order.hpp"
#include "spheretree/lumen/lumen_state.hpp"
#include "spheretree/lumen/union_room.hpp"

#include <limits>

namespace trocar::spheretree {

/// A solid in one step: its tree and the spheres that bound it over the step (update_covering_spheres, update_chain).
struct SolidView {
    Thing thing;
    const SphereTree* tree = nullptr;
    std::span<const Sphere> spheres; // [sphere_count]
    LazySpheres* lazy = nullptr;     // asked for spheres before they are read; null: they are all valid
};
struct ChainView {
    Thing thing;
    const ChainTree* chain = nullptr;
    ChainState* state = nullptr;
};
struct LumenView {
    Thing thing;
    const LumenTree* lumen = nullptr;
    LumenState* state = nullptr;
};

struct DescentStats {
    std::uint64_t pairs_tested = 0;  // sphere tests; each costs one work unit
    std::uint64_t pairs_open = 0;    // left in the queue: assumed to collide
    std::uint64_t leaf_contacts = 0; // CollisionList
    std::uint64_t proven_free = 0;   // links proven free of the wall (hollow pairs)
    /// The coarsest level over all pairs still open; the leaf depth (deepest level of any tree) where none is. A pair is as
    /// coarse as the coarser of its spheres that can still be refined. Never falls as the budget grows.
    int level_reached = 0;
};

/// Reused every step: keeps its memory, allocates nothing once it has seen its largest step.
class Descent {
public:
    /// Forgets all pairs. Contacts are reported from `margin` [m] before the surfaces touch.
    /// cap    level at which DepthCapped stops
    void begin(double margin, DescentOrder order = DescentOrder::Breadth, int cap = 0);
    void add_solid_pair(const SolidView& a, const SolidView& b);
    [[nodiscard]] bool has_solids() const noexcept { return !solids_.empty(); }
    /// A body against itself: pairs of leaves whose spheres (with the margin) lay apart at rest. Neighbours on the surface always
    /// overlap and are not tested, nor is what lies beneath one leaf. An open pair may be a sphere with itself.
    void add_self_pair(const SolidView& body);
    /// One lumen per chain: the chain's hints and link states belong to it.
    void add_hollow_pair(const ChainView& instrument, const LumenView& lumen);

    /// Work is paid before it is done. What costs more than one unit (a sphere's wall links) is not begun with less: next_cost() says what
    /// the next call must bring along at least.
    /// Tests until the queue is empty (true) or the budget is (false); call again with more budget to go on.
    /// The same calls give the same lists, and a larger budget never leaves a pair coarser than a smaller one did (Breadth, Deepest).
    bool run(WorkBudget& budget);
    [[nodiscard]] std::uint64_t next_cost() const noexcept { return next_cost_; }

    /// Appends CollisionList, then the open pairs as AssumedSpheres whose depth is clamped at zero from below.
    /// Solid:  feature_a[0], feature_b[0] = sphere ids of the two trees.
    /// Hollow: feature_a[0] = sphere id of the chain's tree (a leaf, or an open group), feature_b[0] = sphere id of the lumen
    ///         leaf that holds it best (kNoIndex: none tested). gap = clearance between link and wall at t1 as far as the balls
    ///         prove it, negative outside; normal = towards free space, from the wall.
    void add_contacts(std::vector<Contact>& out) const;

    /// Status of every active link of the i-th hollow pair that was added. [active links]
    [[nodiscard]] std::span<const LinkStatus> link_status(std::size_t hollow_pair) const noexcept;
    [[nodiscard]] std::uint64_t open_pairs() const noexcept { return stats_.pairs_open; }
    /// cost   O(open pairs)
    [[nodiscard]] DescentStats stats() const noexcept;

private:
    struct Entry {                   // open pairs that share their second sphere; roles swap, so it says which tree is first
        Index pair = 0;              // index into solids_ or hollows_
        Index first = 0, second = 0; // sphere ids; hollow: first = chain sphere
        std::uint16_t count = 1;     // solids: first, first + 1, ... against second
        bool hollow = false;
        bool swapped = false; // first belongs to body b
        float depth = 0.0F;   // m, overlap of the pair that this one came from; Deepest only
    };
    struct SolidPair {
        SolidView a, b;
        bool self = false;
    };
    struct HollowPair {
        ChainView chain;
        LumenView lumen;
        std::vector<LinkStatus> status;
    };
    struct Found { // best lumen leaf for a chain sphere
        Index leaf = kNoIndex;
        double clearance = -std::numeric_limits<double>::infinity(); // m, over the whole step
    };

    [[nodiscard]] bool is_depth_first() const noexcept { return order_ == DescentOrder::Depth || order_ == DescentOrder::DepthCapped; }
    bool step_group(const Entry& group, WorkBudget& budget);
    void refine_self(const Entry& group, Index s, const SphereTree& tree);
    [[nodiscard]] bool lay_apart(const SphereTree& tree, Index s, Index t) const noexcept;
    void refine(const Entry& group, Index s, const SolidView& first, const SolidView& second, float depth);
    bool step_hollow_entry(const Entry& entry, WorkBudget& budget);
    void drop() noexcept;
    void sort_batch();
    template <class See>
    void for_each_open(See&& see) const { // pair by pair
        for (std::size_t i = head_; i < queue_.size(); ++i)
            for (Entry entry = queue_[i]; entry.count > 0; ++entry.first, --entry.count) see(entry);
    }
    bool step_hollow(const Entry& entry, WorkBudget& budget);
    bool find_ball(HollowPair& pair, Index sphere, WorkBudget& budget);
    [[nodiscard]] bool pay(std::uint64_t units, WorkBudget& budget) noexcept;
    static std::uint64_t cost_of_leaf(const HollowPair& pair, Index leaf) noexcept;
    static double clearance_in_leaf(HollowPair& pair, Index sphere, Index leaf);
    bool find_wall_clearance(HollowPair& pair, Index sphere, WorkBudget& budget);
    void add_solid_contact(const Entry& entry, std::vector<Contact>& out) const;
    void add_wall_contact(const HollowPair& pair, Index sphere);
    void add_open_link(const Entry& entry, std::vector<Contact>& out) const;
    void open(const Entry& entry);
    [[nodiscard]] int level_of(const Entry& entry) const noexcept;

    std::vector<SolidPair> solids_;
    std::vector<HollowPair> hollows_; // memory of the first hollow_count_ is in use
    std::size_t hollow_count_ = 0;
    std::vector<Entry> queue_; // PairList: entries from head_ on are open
    std::size_t head_ = 0;
    int leaf_depth_ = 0;                          // deepest level of all trees added
    std::vector<Contact> collisions_;             // CollisionList
    std::vector<std::pair<double, Index>> stack_; // of the search in progress: bound, lumen sphere
    Found found_;
    bool searching_ = false; // the first open entry's search was interrupted
    bool pressing_ = false;  // its ball is found: the search for its clearance was interrupted
    Clearance wall_clearance_;         // so far
    std::size_t next_neighbour_ = 0;
    std::uint64_t next_cost_ = 1; // units, of what is done next
    DescentStats stats_;
    double margin_ = 0.0;
    DescentOrder order_ = DescentOrder::Breadth;
    int cap_ = 0;
    std::size_t batch_end_ = 0; // Deepest: entries before it are in order
};

/// Unit vector along v; any axis, always the same, where v has no length.
[[nodiscard]] inline Vec3 direction_of(const Vec3& v) noexcept {
    const double length = v.norm();
    return length > 0.0 ? Vec3(v / length) : Vec3(Vec3::UnitX());
}

} // namespace trocar::spheretree
