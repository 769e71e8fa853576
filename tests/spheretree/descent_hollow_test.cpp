// The descent of an instrument's links into a hollow body.
#include "base/inside.hpp"
#include "shapes.hpp"
#include "spheretree/update/covering_tree.hpp"
#include "spheretree/lumen/build_lumen.hpp"
#include "spheretree/traverse/descent.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trocar::spheretree {
namespace {

using test::make_tube;

/// A catheter in a winding vessel: mostly inside, partly through the wall.
struct CatheterFixture {
    static Vec3 axis(double t) { return {0.02 * std::sin(5 * t), 0.015 * std::cos(4 * t), 0.2 * t}; }
    static const TriMesh& shared_wall() {
        static const TriMesh mesh = make_tube({axis, [](double t) { return 6e-3 * std::pow(1.0 / 3.0, t); }, 32, 120});
        return mesh;
    }
    static const LumenTree& shared_lumen() {
        static const LumenTree tree = build_lumen_tree(shared_wall()).value();
        return tree;
    }
    const TriMesh& wall = shared_wall();
    const LumenTree& lumen = shared_lumen();
    LumenState lumen_state;
    ChainTree chain = make_chain_tree(250);
    ChainState chain_state;
    std::vector<Sphere> t0, t1;
    static constexpr double kMargin = 3e-4;

    explicit CatheterFixture(double offset = 2e-3, double speed = 2e-4) {
        for (int i = 0; i < 200; ++i) {
            const double t = 0.02 + 0.96 * i / 199.0;
            const Vec3 aside(offset * std::cos(0.1 * i), offset * std::sin(0.07 * i), 0.0);
            t0.push_back({axis(t) + aside, 5e-4});
            t1.push_back({axis(t) + aside + Vec3(speed * std::sin(i), speed * std::cos(2 * i), 0.0), 5e-4});
        }
        lumen_state.update(lumen, {}, {});
        update_chain(chain, t0, t1, chain_state);
    }
    bool run(Descent& descent, std::uint64_t units, std::vector<Contact>& contacts) {
        descent.begin(kMargin);
        descent.add_hollow_pair({Thing::body(1), &chain, &chain_state}, {Thing::body(2), &lumen, &lumen_state});
        WorkBudget budget(units);
        const bool done = descent.run(budget);
        contacts.clear();
        descent.add_contacts(contacts);
        return done;
    }
    [[nodiscard]] double swept_clearance(std::size_t link) const { // brute force over all balls
        double best = -1.0;
        for (Index b = 0; b < lumen.ball_count(); ++b) {
            const Sphere& ball = lumen.ball(b);
            best = std::max(best, ball.radius - t0[link].radius -
                                      std::max((t0[link].centre - ball.centre).norm(), (t1[link].centre - ball.centre).norm()));
        }
        return best;
    }
};

TEST(HollowDescent, ProvesFreeWhatBruteForceProvesAndReportsTheRest) {
    CatheterFixture f;
    Descent descent;
    std::vector<Contact> contacts;
    ASSERT_TRUE(f.run(descent, WorkBudget::kUnlimited, contacts));
    std::vector<int> reported(f.t1.size(), 0);
    for (const Contact& c : contacts) ++reported[f.chain.link_of_leaf(c.feature_a[0])];
    std::size_t touching = 0;
    for (std::size_t i = 0; i < f.t1.size(); ++i) {
        const bool free = f.swept_clearance(i) >= f.kMargin;
        EXPECT_EQ(descent.link_status(0)[i], free ? LinkStatus::Free : LinkStatus::Contact) << "link " << i;
        EXPECT_EQ(reported[i], free ? 0 : 1) << "link " << i;
        touching += !free;
    }
    EXPECT_GT(touching, 20U);
    EXPECT_LT(touching, 180U);
    EXPECT_EQ(descent.stats().proven_free, f.t1.size() - touching);
}

TEST(HollowDescent, GapIsALowerBoundOfTheClearanceAndTheNormalLeadsToMore) {
    CatheterFixture f;
    const InsideTest inside(f.wall);
    Descent descent;
    std::vector<Contact> contacts;
    f.run(descent, WorkBudget::kUnlimited, contacts);
    double worst = 0.0;
    for (const Contact& c : contacts) {
        const Sphere& link = f.t1[f.chain.link_of_leaf(c.feature_a[0])];
        const double clearance = -inside.signed_distance(link.centre) - link.radius;
        EXPECT_GE(c.gap, f.swept_clearance(f.chain.link_of_leaf(c.feature_a[0])) - 1e-12);
        EXPECT_LE(c.gap, clearance + 1e-9) << "never above the true clearance";
        if (clearance > -4e-4) worst = std::max(worst, clearance - c.gap);
        EXPECT_NEAR(c.normal.norm(), 1.0, 1e-12);
        const double step = 1e-4;
        EXPECT_LT(inside.signed_distance(link.centre + step * c.normal), inside.signed_distance(link.centre) - 0.7 * step);
        EXPECT_TRUE(f.lumen.tree.is_leaf(c.feature_b[0]));
    }
    EXPECT_LT(worst, 3.5e-4) << "the union follows the wall closely";
}

TEST(HollowDescent, NeverMissesAtAnyBudget) {
    for (const std::uint64_t units : {0U, 1U, 3U, 10U, 40U, 150U, 400U, 1000U, 3000U}) {
        CatheterFixture f;
        Descent descent;
        std::vector<Contact> contacts;
        f.run(descent, units, contacts);
        std::vector<int> known(f.t1.size(), 0);
        for (const Contact& c : contacts)
            for (const Index link : f.chain.tree.items_of(c.feature_a[0]))
                if (link < known.size()) {
                    ++known[link];
                    EXPECT_EQ(descent.link_status(0)[link] == LinkStatus::Open, c.origin == ContactOrigin::AssumedSpheres);
                }
        for (std::size_t i = 0; i < f.t1.size(); ++i) {
            EXPECT_EQ(known[i] == 0, descent.link_status(0)[i] == LinkStatus::Free) << "link " << i << " budget " << units;
            if (descent.link_status(0)[i] == LinkStatus::Free) {
                EXPECT_GE(f.swept_clearance(i), f.kMargin);
            }
        }
    }
}

/// Balls of a moving wall cost hundreds of units each: none is measured before it is paid for, and in pieces they cost what they cost in
/// one go.
TEST(HollowDescent, OfAMovingWallNothingIsDoneOnCredit) {
    CatheterFixture f, g;
    std::vector<Vec3> moved = f.lumen.rest_vertices;
    for (Vec3& v : moved) v += 1e-4 * Vec3(std::sin(100.0 * v[0]), std::cos(130.0 * v[1]), 0.5);
    std::vector<Contact> whole, pieces;
    const auto begin = [&](CatheterFixture& fixture, Descent& descent) {
        fixture.lumen_state.update(fixture.lumen, fixture.lumen.rest_vertices, moved);
        descent.begin(fixture.kMargin);
        descent.add_hollow_pair({Thing::body(1), &fixture.chain, &fixture.chain_state}, {Thing::body(2), &fixture.lumen, &fixture.lumen_state});
    };
    Descent once, by_piece;
    begin(f, once);
    WorkBudget all;
    ASSERT_TRUE(once.run(all));
    once.add_contacts(whole);
    begin(g, by_piece);
    std::uint64_t spent = 0, largest = 0;
    for (bool done = false; !done;) {
        const std::uint64_t least = by_piece.next_cost();
        const std::size_t before = g.lumen_state.balls_updated();
        WorkBudget too_little(least - 1);
        if (least > 1) {
            EXPECT_FALSE(by_piece.run(too_little));
            EXPECT_EQ(too_little.spent(), 0u);
            EXPECT_EQ(g.lumen_state.balls_updated(), before);
        }
        WorkBudget enough(std::max<std::uint64_t>(least, 5));
        done = by_piece.run(enough);
        ASSERT_GT(enough.spent(), 0u);
        spent += enough.spent();
        largest = std::max(largest, least);
    }
    by_piece.add_contacts(pieces);
    EXPECT_GT(largest, 20u) << "a ball with its triangles";
    EXPECT_EQ(spent, all.spent());
    ASSERT_EQ(whole.size(), pieces.size());
    for (std::size_t k = 0; k < whole.size(); ++k) {
        EXPECT_EQ(whole[k].gap, pieces[k].gap) << k;
        EXPECT_EQ(whole[k].normal, pieces[k].normal) << k;
    }
}

TEST(HollowDescent, HintsAndGrantsChangeTheWorkNotTheResult) {
    CatheterFixture f, g;
    Descent cold, warm, granted;
    std::vector<Contact> first, second, third;
    f.run(cold, WorkBudget::kUnlimited, first);
    f.run(warm, WorkBudget::kUnlimited, second);
    EXPECT_LT(warm.stats().pairs_tested, cold.stats().pairs_tested);
    granted.begin(g.kMargin);
    granted.add_hollow_pair({Thing::body(1), &g.chain, &g.chain_state}, {Thing::body(2), &g.lumen, &g.lumen_state});
    for (bool done = false; !done;) {
        WorkBudget budget(std::max<std::uint64_t>(3, granted.next_cost()));
        done = granted.run(budget);
        ASSERT_GT(budget.spent(), 0u) << "what it asked for is enough to go on";
    }
    granted.add_contacts(third);
    ASSERT_EQ(first.size(), second.size());
    ASSERT_EQ(first.size(), third.size());
    for (const auto& other : {second, third})
        for (const Contact& c : other)
            EXPECT_TRUE(std::any_of(first.begin(), first.end(), [&](const Contact& o) {
                return o.feature_a[0] == c.feature_a[0] && o.feature_b[0] == c.feature_b[0] && o.gap == c.gap && o.normal == c.normal;
            }));
}

TEST(HollowDescent, AFastLinkDoesNotJumpTheWallUnseen) {
    CatheterFixture f(0.0, 0.0);
    for (Sphere& link : f.t1) link.centre[0] += 0.2; // far outside at t1
    f.t1[50].centre = f.axis(0.9);                   // inside at both ends, through the wall between
    f.t0[50].centre = f.axis(0.1);
    update_chain(f.chain, f.t0, f.t1, f.chain_state);
    Descent descent;
    std::vector<Contact> contacts;
    f.run(descent, WorkBudget::kUnlimited, contacts);
    for (const LinkStatus status : descent.link_status(0)) EXPECT_EQ(status, LinkStatus::Contact);
    EXPECT_EQ(contacts.size(), f.t1.size());
}

TEST(HollowDescent, MovesWithTheWall) {
    CatheterFixture rest, moved;
    const Vec3 shift(0.01, 0.02, -0.03);
    std::vector<Vec3> t0 = rest.wall.vertices, t1 = rest.wall.vertices;
    for (Vec3& v : t0) v += shift;
    for (Vec3& v : t1) v += 1.1 * shift; // wall and catheter travel together
    for (Sphere& s : moved.t0) s.centre += shift;
    for (Sphere& s : moved.t1) s.centre += 1.1 * shift;
    moved.lumen_state.update(moved.lumen, t0, t1);
    update_chain(moved.chain, moved.t0, moved.t1, moved.chain_state);
    Descent a, b;
    std::vector<Contact> still, travelling;
    rest.run(a, WorkBudget::kUnlimited, still);
    moved.run(b, WorkBudget::kUnlimited, travelling);
    ASSERT_GE(travelling.size(), still.size());
    for (const Contact& c : still) { // radii of moving balls are measured to 1 %
        const auto same =
            std::find_if(travelling.begin(), travelling.end(), [&](const Contact& o) { return o.feature_a[0] == c.feature_a[0]; });
        ASSERT_NE(same, travelling.end());
        EXPECT_LE(same->gap, c.gap + 1e-9);
        EXPECT_GE(same->gap, c.gap - 0.02 * 6e-3);
    }
    EXPECT_LT(moved.lumen_state.balls_updated(), moved.lumen.ball_count()) << "only balls that were asked for";
}

TEST(HollowDescent, WallPointIsTheNearestOfTheWall) {
    CatheterFixture f;
    const InsideTest inside(f.wall);
    Descent descent;
    std::vector<Contact> contacts;
    f.run(descent, WorkBudget::kUnlimited, contacts);
    std::size_t same = 0;
    for (const Contact& c : contacts) {
        const WallPoint wall = find_wall_point(f.lumen, {}, f.lumen.ball_of_leaf(c.feature_b[0]), c.point);
        ASSERT_NE(wall.triangle, kNoIndex);
        same += std::abs(wall.distance - inside.tree().closest(c.point)->distance) < 1e-12;
    }
    EXPECT_GT(same, contacts.size() * 8 / 10) << "a ball's links hold the wall that a contact presses on";
}

} // namespace
} // namespace trocar::spheretree
