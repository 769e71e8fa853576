// Interruptible descent through pairs of sphere trees, breadth first, all body pairs sharing one queue. Whatever is still
// open when the budget ends is assumed to collide: nothing is missed, only seen more coarsely.
//
// This work is based on: seed 003, section 4 (PairList and CollisionList, roles swapped on the way down).
// Deviates for hollow bodies: a group of instrument links is proven free as a whole by one free ball of the lumen, and
// split where no ball holds it; a single link is searched for the ball that holds it best.
#pragma once

#include "base/contact.hpp"
#include "base/work_budget.hpp"
#include "spheretree/chain_tree.hpp"
#include "spheretree/lumen_state.hpp"

#include <array>

namespace seldinger::spheretree {

/// A solid in one step: its tree and the spheres that bound it over the step (update_covering_spheres, update_chain).
struct SolidView {
    BodyId body = 0;
    const SphereTree* tree = nullptr;
    std::span<const Sphere> spheres; // [sphere_count]
};
struct ChainView {
    BodyId body = 0;
    const ChainTree* chain = nullptr;
    ChainState* state = nullptr;
};
struct LumenView {
    BodyId body = 0;
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
    void begin(double margin);
    void add_solid_pair(const SolidView& a, const SolidView& b);
    /// One lumen per chain: the chain's hints and link states belong to it.
    void add_hollow_pair(const ChainView& instrument, const LumenView& lumen);

    /// Work is charged before it is done; one ball's wall links at most may be done on credit.
    /// Tests until the queue is empty (true) or the budget is (false); call again with more budget to go on.
    /// The same calls give the same lists, and a larger budget never leaves a pair coarser than a smaller one did.
    bool run(WorkBudget& budget);

    /// Appends CollisionList, then the open pairs as AssumedSpheres whose depth is clamped at zero from below.
    /// Solid:  feature_a[0], feature_b[0] = sphere ids of the two trees.
    /// Hollow: feature_a[0] = sphere id of the chain's tree (a leaf, or an open group), feature_b[0] = sphere id of the lumen
    ///         leaf that holds it best (kNoIndex: none looked at). gap = room between link and wall at t1 as far as the balls
    ///         prove it, negative outside; normal = towards free space, from the wall.
    void add_contacts(std::vector<Contact>& out) const;

    /// Status of every active link of the i-th hollow pair that was added. [active links]
    [[nodiscard]] std::span<const LinkStatus> link_status(std::size_t hollow_pair) const noexcept;
    [[nodiscard]] const DescentStats& stats() const noexcept { return stats_; }

private:
    struct Entry {              // one open pair; roles swap, so it says which tree is first
        Index pair = 0;         // index into solids_ or hollows_
        Index first = 0, second = 0; // sphere ids; hollow: first = chain sphere
        bool hollow = false;
        bool swapped = false;   // first belongs to body b
    };
    struct SolidPair { SolidView a, b; };
    struct HollowPair { ChainView chain; LumenView lumen; std::vector<LinkStatus> status; };
    struct Found {              // best lumen leaf for a chain sphere
        Index leaf = kNoIndex;
        double room = -std::numeric_limits<double>::infinity(); // m, over the whole step
    };

    bool step_solid(const Entry& entry, WorkBudget& budget);
    bool step_hollow(const Entry& entry, WorkBudget& budget);
    bool find_ball(HollowPair& pair, Index sphere, WorkBudget& budget);
    double room_in_leaf(HollowPair& pair, Index sphere, Index leaf, WorkBudget& budget);
    void add_solid_contact(const Entry& entry, std::vector<Contact>& out) const;
    void add_wall_contact(HollowPair& pair, Index sphere, WorkBudget& budget);
    void add_open_link(const Entry& entry, std::vector<Contact>& out) const;
    void open(const Entry& entry);
    [[nodiscard]] int level_of(const Entry& entry) const noexcept;
    void find_level_reached() noexcept;

    std::vector<SolidPair> solids_;
    std::vector<HollowPair> hollows_;    // memory of the first hollow_count_ is in use
    std::size_t hollow_count_ = 0;
    std::vector<Entry> queue_;           // PairList: entries from head_ on are open
    std::size_t head_ = 0;
    std::array<std::uint32_t, 256> open_at_level_{}; // entries from head_ on, by level_of
    int leaf_depth_ = 0;                 // deepest level of all trees added
    std::vector<Contact> collisions_;    // CollisionList
    std::vector<std::pair<double, Index>> stack_; // of the search in progress: bound, lumen sphere
    Found found_;
    bool searching_ = false;             // the first open entry's search was interrupted
    DescentStats stats_;
    double margin_ = 0.0;
};

} // namespace seldinger::spheretree
