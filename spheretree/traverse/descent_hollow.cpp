// The descent's hollow pairs: a catheter's links against the inscribed spheres of a lumen.
#include "spheretree/traverse/descent.hpp"

#include <algorithm>

namespace trocar::spheretree {

namespace {

/// Bounds and distances are rounded: a ball is dropped only where its bound is worse by more than this, so that which of
/// two equal balls answers does not depend on where the search began.
constexpr double kTie = 1e-12; // m

} // namespace

/// Paid whole before it is done: a kernel never does more than it was granted.
bool Descent::pay(std::uint64_t units, WorkBudget& budget) noexcept {
    const bool paid = budget.spend(units);
    next_cost_ = paid ? 1 : units;
    return paid;
}

bool Descent::step_hollow(const Entry& entry, WorkBudget& budget) {
    HollowPair& pair = hollows_[entry.pair];
    const ChainTree& chain = *pair.chain.chain;
    ChainState& state = *pair.chain.state;
    if (state.spheres[entry.first].radius < 0.0) return true;
    if (!pressing_ && !find_ball(pair, entry.first, budget)) return false;
    const Index begin = chain.tree.item_begin[entry.first];
    const Index end = std::min<Index>(chain.tree.item_end[entry.first], static_cast<Index>(pair.status.size()));
    const bool free = found_.clearance >= margin_;
    if (free || chain.tree.is_leaf(entry.first)) // a group that no ball holds tells nothing about its links
        std::fill(state.hint.begin() + begin, state.hint.begin() + end, found_.leaf);
    if (free) {
        std::fill(pair.status.begin() + begin, pair.status.begin() + end, LinkStatus::Free);
        stats_.proven_free += end - begin;
    } else if (chain.tree.is_leaf(entry.first)) {
        if (!find_wall_clearance(pair, entry.first, budget)) return false;
        pair.status[begin] = LinkStatus::Contact;
        add_wall_contact(pair, entry.first);
    } else {
        const Index child = chain.tree.first_child[entry.first];
        for (Index k = 0; k < chain.tree.child_count[entry.first]; ++k) open({entry.pair, child + k, 0, 1, true, false, 0.0F});
    }
    return true;
}

std::uint64_t Descent::cost_of_leaf(const HollowPair& pair, Index leaf) noexcept {
    const LumenTree& lumen = *pair.lumen.lumen;
    return 1 + pair.lumen.state->cost_of(lumen, lumen.ball_of_leaf(leaf));
}

/// Clearance that lumen leaf `leaf` proves for a chain sphere over the whole step. Relative to the ball both ends move on a
/// straight line, and distance is convex: what holds at both ends holds between.
double Descent::clearance_in_leaf(HollowPair& pair, Index sphere, Index leaf) {
    const LumenTree& lumen = *pair.lumen.lumen;
    const MovingBall& ball = pair.lumen.state->ball(lumen, lumen.ball_of_leaf(leaf));
    const ChainTree& chain = *pair.chain.chain;
    const ChainState& state = *pair.chain.state;
    if (ball.radius < 0.0) return -std::numeric_limits<double>::infinity();
    if (!chain.tree.is_leaf(sphere)) {
        const Sphere& bound = state.spheres[sphere];
        const double farthest =
            std::sqrt(std::max((bound.centre - ball.centre_t0).squaredNorm(), (bound.centre - ball.centre_t1).squaredNorm()));
        return ball.radius - farthest - bound.radius;
    }
    const Index link = chain.link_of_leaf(sphere);
    const Sphere &t0 = state.links_t0[link], &t1 = state.links_t1[link];
    return ball.radius - std::max((t0.centre - ball.centre_t0).norm() + t0.radius, (t1.centre - ball.centre_t1).norm() + t1.radius);
}

/// Best ball for a chain sphere, into found_: any that holds it with the margin, else (for a single link) the one with the
/// largest clearance. Resumes where it was interrupted. False: the budget ended first.
bool Descent::find_ball(HollowPair& pair, Index sphere, WorkBudget& budget) {
    const SphereTree& tree = pair.lumen.lumen->tree;
    const ChainTree& chain = *pair.chain.chain;
    const bool leaf = chain.tree.is_leaf(sphere);
    const Sphere bound = pair.chain.state->spheres[sphere];
    const Index link = chain.tree.item_begin[sphere];
    // Where no ball can hold it with the margin, a group needs no search; a link wants the best there is.
    const auto hopeless = [&](double clearance) { return clearance < (leaf ? found_.clearance - kTie : margin_); };
    const auto try_leaf = [&](Index candidate) {
        ++stats_.pairs_tested;
        const double clearance = clearance_in_leaf(pair, sphere, candidate);
        if (clearance > found_.clearance || (clearance == found_.clearance && candidate < found_.leaf)) found_ = {candidate, clearance};
    };
    if (!searching_) {
        Index hint = pair.chain.state->hint[link];
        if (hint == kNoIndex && link > 0) hint = pair.chain.state->hint[link - 1];
        const bool known = hint < tree.sphere_count() && tree.is_leaf(hint);
        if (!pay(known ? cost_of_leaf(pair, hint) : 1, budget)) return false;
        searching_ = true;
        found_ = {};
        stack_.assign(1, {std::numeric_limits<double>::infinity(), 0});
        if (known)
            try_leaf(hint);
        else
            ++stats_.pairs_tested;
    }
    // A link's bound must hold at t1 alone; its own swept sphere is larger than the link where it moves.
    const double own_radius = leaf ? pair.chain.state->links_t1[link].radius : bound.radius;
    const Vec3 own_centre = leaf ? pair.chain.state->links_t1[link].centre : bound.centre;
    while (!stack_.empty() && found_.clearance < margin_) {
        const auto [limit, s] = stack_.back();
        if (hopeless(limit)) {
            stack_.pop_back();
            continue;
        }
        if (tree.is_leaf(s)) {
            if (!pay(cost_of_leaf(pair, s), budget)) return false;
            stack_.pop_back();
            try_leaf(s);
            continue;
        }
        const Index count = tree.child_count[s];
        if (!pay(count, budget)) return false;
        stack_.pop_back();
        const std::size_t first = stack_.size();
        for (Index child = tree.first_child[s]; child < tree.first_child[s] + count; ++child) {
            ++stats_.pairs_tested;
            const double clearance = pair.lumen.state->bound_at(child, own_centre) - own_radius;
            if (!hopeless(clearance)) stack_.emplace_back(clearance, child);
        }
        std::sort(stack_.begin() + static_cast<std::ptrdiff_t>(first), stack_.end(), [](const auto& a, const auto& b) {
            return a.first != b.first ? a.first < b.first : a.second > b.second; // the most promising one is on top
        });
    }
    searching_ = false;
    return true;
}

/// Clearance of a link in the found ball and its neighbours, into wall_clearance_. Resumes where it was interrupted. False: the
/// budget ended first.
bool Descent::find_wall_clearance(HollowPair& pair, Index sphere, WorkBudget& budget) {
    const LumenTree& lumen = *pair.lumen.lumen;
    LumenState& balls = *pair.lumen.state;
    const Sphere& link = pair.chain.state->links_t1[pair.chain.chain->link_of_leaf(sphere)];
    if (found_.leaf == kNoIndex) return true;
    const auto at_t1 = [&](Index ball) {
        const MovingBall& b = balls.ball(lumen, ball);
        return Sphere{b.centre_t1, b.radius_t1};
    };
    const Index best = lumen.ball_of_leaf(found_.leaf);
    const Sphere ball = at_t1(best); // measured when it was found
    if (!pressing_) {
        pressing_ = true;
        next_neighbour_ = 0;
        wall_clearance_ = clearance_in_ball(link.centre, ball);
    }
    for (const auto neighbours = lumen.neighbours_of(best); next_neighbour_ < neighbours.size(); ++next_neighbour_) {
        const Index neighbour = neighbours[next_neighbour_];
        // A circle that matters here is nearer than the wall the link is in contact with.
        if (balls.bound_at(lumen.leaf_of_ball[neighbour], link.centre) < -link.radius - margin_) continue;
        if (!pay(1 + balls.cost_of(lumen, neighbour), budget)) return false;
        improve_clearance(link.centre, ball, at_t1(neighbour), wall_clearance_);
    }
    pressing_ = false;
    return true;
}

void Descent::add_wall_contact(const HollowPair& pair, Index sphere) {
    const Sphere& link = pair.chain.state->links_t1[pair.chain.chain->link_of_leaf(sphere)];
    Contact contact;
    contact.a = pair.chain.thing;
    contact.b = pair.lumen.thing;
    contact.feature_a[0] = sphere;
    contact.feature_b[0] = found_.leaf;
    if (found_.leaf != kNoIndex) {
        contact.gap = wall_clearance_.radius - link.radius;
        contact.normal = wall_clearance_.inward;
        contact.point = link.centre - wall_clearance_.inward * link.radius;
    }
    collisions_.push_back(contact);
    ++stats_.leaf_contacts;
}

void Descent::add_open_link(const Entry& entry, std::vector<Contact>& out) const {
    const HollowPair& pair = hollows_[entry.pair];
    const Sphere& sphere = pair.chain.state->spheres[entry.first];
    if (sphere.radius < 0.0) return;
    Contact contact;
    contact.a = pair.chain.thing;
    contact.b = pair.lumen.thing;
    contact.origin = ContactOrigin::AssumedSpheres;
    contact.feature_a[0] = entry.first;
    contact.point = sphere.centre;
    const Index hint = pair.chain.state->hint[pair.chain.chain->tree.item_begin[entry.first]];
    const SphereTree& tree = pair.lumen.lumen->tree;
    if (hint < tree.sphere_count() && tree.is_leaf(hint) && pair.lumen.state->has_bounds()) {
        contact.feature_b[0] = hint;
        const Vec3 towards = pair.lumen.state->bound_centre(hint) - sphere.centre;
        contact.normal = direction_of(towards);
    }
    out.push_back(contact);
}

} // namespace trocar::spheretree
