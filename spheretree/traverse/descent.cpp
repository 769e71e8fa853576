#include "spheretree/traverse/descent.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace trocar::spheretree {

namespace {

Contact sphere_contact(Thing thing_a, Thing thing_b, const Sphere& a, const Sphere& b) noexcept {
    const Vec3 from_b = a.centre - b.centre;
    const double distance = from_b.norm();
    Contact contact;
    contact.a = thing_a;
    contact.b = thing_b;
    contact.normal = direction_of(from_b);
    contact.gap = distance - a.radius - b.radius;
    contact.point = b.centre + contact.normal * (b.radius + 0.5 * contact.gap);
    return contact;
}

} // namespace

std::string_view order_name(DescentOrder order) noexcept {
    switch (order) {
    case DescentOrder::Breadth:
        return "breadth";
    case DescentOrder::Deepest:
        return "deepest";
    case DescentOrder::Depth:
        return "depth";
    case DescentOrder::DepthCapped:
        break;
    }
    return "depth-capped";
}

std::optional<DescentOrder> find_order(std::string_view name) noexcept {
    for (const DescentOrder order : {DescentOrder::Breadth, DescentOrder::Deepest, DescentOrder::Depth, DescentOrder::DepthCapped})
        if (order_name(order) == name) return order;
    return std::nullopt;
}

/// Pairs that the lists hold without growing: a catheter in a vessel needs some hundreds.
static constexpr std::size_t kReservedPairs = 8192;

void Descent::begin(double margin, DescentOrder order, int cap) {
    queue_.reserve(kReservedPairs);
    collisions_.reserve(kReservedPairs);
    stack_.reserve(kReservedPairs);
    margin_ = margin;
    order_ = order;
    cap_ = cap;
    batch_end_ = 0;
    solids_.clear();
    hollow_count_ = 0;
    queue_.clear();
    head_ = 0;
    collisions_.clear();
    stack_.clear();
    searching_ = pressing_ = false;
    next_cost_ = 1;
    leaf_depth_ = 0;
    stats_ = {};
}

/// Both leaves: nothing is left to refine, so the deeper one counts.
int Descent::level_of(const Entry& entry) const noexcept {
    if (entry.hollow) return hollows_[entry.pair].chain.chain->tree.level[entry.first];
    const SolidPair& pair = solids_[entry.pair];
    const SphereTree& first = *(entry.swapped ? pair.b : pair.a).tree;
    const SphereTree& second = *(entry.swapped ? pair.a : pair.b).tree;
    const int level_1 = first.level[entry.first], level_2 = second.level[entry.second];
    if (first.is_leaf(entry.first)) return second.is_leaf(entry.second) ? std::max(level_1, level_2) : level_2;
    return second.is_leaf(entry.second) ? level_1 : std::min(level_1, level_2);
}

void Descent::open(const Entry& entry) {
    queue_.push_back(entry);
    stats_.pairs_open += entry.count;
}

DescentStats Descent::stats() const noexcept {
    DescentStats stats = stats_;
    stats.level_reached = leaf_depth_;
    for_each_open([&](const Entry& entry) { stats.level_reached = std::min(stats.level_reached, level_of(entry)); });
    return stats;
}

void Descent::add_solid_pair(const SolidView& a, const SolidView& b) {
    if (a.spheres.empty() || b.spheres.empty()) return;
    solids_.push_back({a, b});
    open({static_cast<Index>(solids_.size() - 1), 0, 0, 1, false, false, 0.0F});
    leaf_depth_ = std::max({leaf_depth_, a.tree->leaf_depth(), b.tree->leaf_depth()});
}

void Descent::add_self_pair(const SolidView& body) {
    if (body.spheres.empty() || body.tree->is_leaf(0)) return;
    solids_.push_back({body, body, true});
    open({static_cast<Index>(solids_.size() - 1), 0, 0, 1, false, false, 0.0F});
    leaf_depth_ = std::max(leaf_depth_, body.tree->leaf_depth());
}

void Descent::add_hollow_pair(const ChainView& instrument, const LumenView& lumen) {
    if (hollow_count_ == hollows_.size()) hollows_.emplace_back();
    HollowPair& pair = hollows_[hollow_count_];
    pair.chain = instrument;
    pair.lumen = lumen;
    pair.status.reserve(instrument.chain->capacity());
    pair.status.assign(instrument.state->links_t1.size(), LinkStatus::Open);
    if (!pair.status.empty()) {
        open({static_cast<Index>(hollow_count_), 0, 0, 1, true, false, 0.0F});
        leaf_depth_ = std::max(leaf_depth_, instrument.chain->tree.leaf_depth());
    }
    ++hollow_count_;
}

std::span<const LinkStatus> Descent::link_status(std::size_t hollow_pair) const noexcept { return hollows_[hollow_pair].status; }

bool Descent::run(WorkBudget& budget) {
    while (head_ < queue_.size()) {
        if (order_ == DescentOrder::Deepest && head_ == batch_end_) sort_batch();
        const Entry entry = is_depth_first() ? queue_.back() : queue_[head_];
        if (!(entry.hollow ? step_hollow_entry(entry, budget) : step_group(entry, budget))) break;
    }
    return stats_.pairs_open == 0;
}

/// The pairs that one round of refinement left, those whose parents lay deepest in one another first.
void Descent::sort_batch() {
    std::sort(queue_.begin() + static_cast<std::ptrdiff_t>(head_), queue_.end(), [](const Entry& x, const Entry& y) {
        if (x.depth != y.depth) return x.depth > y.depth;
        return std::tie(x.pair, x.swapped, x.first, x.second) < std::tie(y.pair, y.swapped, y.first, y.second);
    });
    batch_end_ = queue_.size();
}

/// The current entry is done.
void Descent::drop() noexcept {
    if (is_depth_first())
        queue_.pop_back();
    else
        ++head_;
}

bool Descent::step_hollow_entry(const Entry& entry, WorkBudget& budget) {
    drop();
    if (step_hollow(entry, budget)) {
        --stats_.pairs_open;
        return true;
    }
    if (is_depth_first())
        queue_.push_back(entry);
    else
        --head_;
    return false;
}

/// Tests of one group: spheres first .. first + count - 1 of one tree against one sphere of the other; depth first, its first
/// one alone. False: the budget ended.
bool Descent::step_group(const Entry& group, WorkBudget& budget) {
    const auto tests = static_cast<Index>(std::min<std::uint64_t>(is_depth_first() ? 1u : group.count, budget.left()));
    if (tests == 0 || !budget.spend(tests)) return false;
    stats_.pairs_tested += tests;
    stats_.pairs_open -= tests;
    if (tests == group.count) {
        drop();
    } else {
        Entry& rest = is_depth_first() ? queue_.back() : queue_[head_];
        rest.first += tests;
        rest.count = static_cast<std::uint16_t>(group.count - tests);
    }
    const SolidPair& pair = solids_[group.pair];
    const SolidView& first = group.swapped ? pair.b : pair.a;
    const SolidView& second = group.swapped ? pair.a : pair.b;
    if (first.lazy != nullptr) first.lazy->ensure(group.first, tests);
    if (second.lazy != nullptr) second.lazy->ensure(group.second, 1);
    const Sphere other = second.spheres[group.second];
    if (other.radius < 0.0) return true;            // empty: touches nothing
    if (pair.self && group.first == group.second) { // alone in its group
        refine_self(group, group.first, *first.tree);
        return true;
    }
    const double reach = other.radius + margin_;
    for (Index s = group.first; s < group.first + tests; ++s) {
        const Sphere& sphere = first.spheres[s];
        const double dx = sphere.centre[0] - other.centre[0], dy = sphere.centre[1] - other.centre[1],
                     dz = sphere.centre[2] - other.centre[2];
        const double distance_sq = dx * dx + dy * dy + dz * dz, touch = sphere.radius + reach;
        if (distance_sq > touch * touch || sphere.radius < 0.0) continue;
        const double depth = order_ == DescentOrder::Deepest ? touch - std::sqrt(distance_sq) : 0.0; // no other pair would test it
        refine(group, s, first, second, static_cast<float>(depth));
    }
    return true;
}

bool Descent::lay_apart(const SphereTree& tree, Index s, Index t) const noexcept {
    const Sphere &a = tree.spheres[s], &b = tree.spheres[t];
    const double touch = a.radius + b.radius + margin_;
    return (a.centre - b.centre).squaredNorm() > touch * touch;
}

/// A sphere against itself: each of its children against itself, and against the ones after it.
void Descent::refine_self(const Entry& group, Index s, const SphereTree& tree) {
    const Index begin = tree.first_child[s], end = begin + tree.child_count[s];
    for (Index c = begin; c < end; ++c) {
        if (!tree.is_leaf(c)) open({group.pair, c, c, 1, false, group.swapped, 0.0F});
        if (c + 1 < end) open({group.pair, c + 1, c, static_cast<std::uint16_t>(end - c - 1), false, group.swapped, 0.0F});
    }
}

/// Spheres that overlap: the children of the second against the first, roles swapped; leaves collide.
void Descent::refine(const Entry& group, Index s, const SolidView& first, const SolidView& second, float depth) {
    const bool leaf_1 = first.tree->is_leaf(s), leaf_2 = second.tree->is_leaf(group.second);
    const bool capped = order_ == DescentOrder::DepthCapped && first.tree->level[s] >= cap_ && second.tree->level[group.second] >= cap_;
    if ((leaf_1 && leaf_2) || capped) {
        if (solids_[group.pair].self && !lay_apart(*first.tree, s, group.second)) return;
        add_solid_contact({group.pair, s, group.second, 1, false, group.swapped, depth}, collisions_);
        ++stats_.leaf_contacts;
    } else if (!leaf_2) {
        open({group.pair, second.tree->first_child[group.second], s, second.tree->child_count[group.second], false, !group.swapped, depth});
    } else {
        open({group.pair, group.second, s, 1, false, !group.swapped, depth});
    }
}

void Descent::add_solid_contact(const Entry& entry, std::vector<Contact>& out) const {
    const SolidPair& pair = solids_[entry.pair];
    const Index a = entry.swapped ? entry.second : entry.first;
    const Index b = entry.swapped ? entry.first : entry.second;
    if (pair.a.lazy != nullptr) pair.a.lazy->ensure(a, 1);
    if (pair.b.lazy != nullptr) pair.b.lazy->ensure(b, 1);
    Contact contact = sphere_contact(pair.a.thing, pair.b.thing, pair.a.spheres[a], pair.b.spheres[b]);
    contact.feature_a[0] = a;
    contact.feature_b[0] = b;
    out.push_back(contact);
}

void Descent::add_contacts(std::vector<Contact>& out) const {
    out.insert(out.end(), collisions_.begin(), collisions_.end());
    for_each_open([&](const Entry& entry) {
        if (entry.hollow) {
            add_open_link(entry, out);
            return;
        }
        add_solid_contact(entry, out);
        out.back().origin = ContactOrigin::AssumedSpheres;
        out.back().gap = std::min(out.back().gap, 0.0);
    });
}

} // namespace trocar::spheretree
