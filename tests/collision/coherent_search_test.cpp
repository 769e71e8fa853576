// Skipping frames against ContactSearch, step by step: the same contacts with the same bits, whatever moves how.
#include "collision/coherent_search.hpp"

#include "base/closest_point.hpp"
#include "collision/contact_search.hpp"
#include "collision/contact_track.hpp"
#include "collision/session_bounds.hpp"
#include "tests/collision/allocations.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace seldinger::collision {
namespace {

using testing::Random;
using testing::Surface;

/// Surfaces and where their vertices are at each frame; a step goes from one frame to the next, unless `teleports`.
struct Sequence {
    std::vector<Surface> surfaces;
    std::vector<std::vector<std::vector<Vec3>>> frames; // [frame][surface][vertex]
    std::vector<std::size_t> starts;                    // [step] frame it begins at; empty: 0, 1, 2, ...

    std::size_t step_count() const { return starts.empty() ? frames.size() - 1 : starts.size(); }
    std::vector<SurfaceMotion> step(std::size_t k) const {
        const std::size_t from = starts.empty() ? k : starts[k];
        std::vector<SurfaceMotion> out;
        for (std::size_t s = 0; s < surfaces.size(); ++s) out.push_back({&surfaces[s].topology, frames[from][s], frames[from + 1][s]});
        return out;
    }
    void add_frame(const std::function<Vec3(std::size_t surface, const Vec3& rest, std::size_t vertex)>& place) {
        std::vector<std::vector<Vec3>> frame;
        for (std::size_t s = 0; s < surfaces.size(); ++s) {
            frame.emplace_back();
            for (std::size_t v = 0; v < surfaces[s].t0.size(); ++v) frame.back().push_back(place(s, surfaces[s].t0[v], v));
        }
        frames.push_back(std::move(frame));
    }
};

Surface make_sheet(std::size_t columns, std::size_t rows, double square) {
    Surface s;
    for (std::size_t j = 0; j <= rows; ++j)
        for (std::size_t i = 0; i <= columns; ++i) s.t0.emplace_back(square * static_cast<double>(i), square * static_cast<double>(j), 0.0);
    const Index n = static_cast<Index>(columns + 1);
    for (Index j = 0; j < rows; ++j)
        for (Index i = 0; i < columns; ++i) {
            const Index a = j * n + i;
            s.triangles.push_back({a, a + 1, a + n});
            s.triangles.push_back({a + 1, a + n + 1, a + n});
        }
    s.t1 = s.t0;
    s.close();
    return s;
}

/// A sheet that is rolled up until it meets itself, and flutters.
Sequence make_rolling_sheet(std::size_t steps) {
    Sequence q;
    q.surfaces = {make_sheet(36, 12, 0.02)};
    for (std::size_t k = 0; k <= steps; ++k)
        q.add_frame([&](std::size_t, const Vec3& p, std::size_t) {
            const double bend = 6.0 + 0.7 * static_cast<double>(k), turn = bend * p[0];
            const double radius = 1.0 / bend + 0.002 * std::sin(40.0 * p[1] + 0.6 * static_cast<double>(k));
            return Vec3(radius * std::sin(turn), p[1] + 0.01 * p[0], radius * std::cos(turn) + 0.004 * turn);
        });
    return q;
}

/// A thin tube that is pushed along the inside of a wide one, which bends. merged: both are one surface.
Sequence make_catheter(std::size_t steps, bool merged) {
    Sequence q;
    Surface wide = testing::make_bent_tube(1.0, 0.1, 40, 20, 0.5), thin = testing::make_bent_tube(0.6, 0.03, 40, 10, 0.5);
    for (Vec3& p : thin.t0) p += Vec3(0.0, 0.0695, 0.05);
    thin.t1 = thin.t0;
    const std::size_t wide_count = wide.t0.size();
    if (merged) {
        for (const Triangle& t : thin.triangles) {
            const auto n = static_cast<Index>(wide_count);
            wide.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
        }
        wide.t0.insert(wide.t0.end(), thin.t0.begin(), thin.t0.end());
        wide.t1 = wide.t0;
        wide.close();
        q.surfaces = {wide};
    } else {
        q.surfaces = {wide, thin};
    }
    for (std::size_t k = 0; k <= steps; ++k)
        q.add_frame([&](std::size_t s, const Vec3& rest, std::size_t v) {
            const double time = static_cast<double>(k);
            Vec3 p = rest;
            if (s == 1 || v >= wide_count) p += Vec3(0.003 * std::sin(0.9 * time), 0.006 * std::sin(0.5 * time), 0.012 * time);
            const double bend = 0.1 * std::sin(0.3 * time) * p[2];
            return Vec3(p[0] * std::cos(bend) - p[2] * std::sin(bend), p[1], p[0] * std::sin(bend) + p[2] * std::cos(bend));
        });
    return q;
}

/// Loose triangles whose vertices wander on their own.
Sequence make_soup(std::uint64_t seed, std::size_t triangles, std::size_t steps, double motion) {
    Random random(seed);
    Sequence q;
    q.surfaces = {testing::make_triangle_soup(random, triangles, 1.0, 0.15, 0.0),
                  testing::make_triangle_soup(random, triangles / 2, 1.0, 0.15, 0.0)};
    q.add_frame([](std::size_t, const Vec3& p, std::size_t) { return p; });
    for (std::size_t k = 0; k < steps; ++k)
        q.add_frame([&](std::size_t s, const Vec3&, std::size_t v) { return Vec3(q.frames.back()[s][v] + random.vector(motion)); });
    return q;
}

struct Totals {
    std::size_t contacts = 0;
    std::uint64_t tests = 0, tests_anew = 0, dangling = 0, sessions = 0, bounds = 0;
};

CoherentOptions options_at(double distance) {
    CoherentOptions options;
    options.distance = distance;
    options.tolerance = 1e-9 * distance;
    options.tree.cluster_size = 8; // several clusters also in small bodies
    return options;
}

void expect_same(std::span<const SearchContact> found, std::span<const SearchContact> wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Contact &a = found[i].contact, &b = wanted[i].contact;
        ASSERT_EQ(a.origin, b.origin);
        ASSERT_EQ((std::array<Index, 4>{a.body_a, found[i].id_a, a.body_b, found[i].id_b}),
                  (std::array<Index, 4>{b.body_a, wanted[i].id_a, b.body_b, wanted[i].id_b}));
        ASSERT_EQ(a.time, b.time);
        ASSERT_EQ(a.normal, b.normal);
        ASSERT_EQ(a.point, b.point);
        ASSERT_EQ(a.gap, b.gap);
    }
}

template <class Search>
void build(Search& search, const Sequence& q, const auto& options) {
    std::vector<const SurfaceTopology*> topologies;
    std::vector<std::span<const Vec3>> positions;
    for (std::size_t s = 0; s < q.surfaces.size(); ++s) {
        topologies.push_back(&q.surfaces[s].topology);
        positions.push_back(q.frames[0][s]);
    }
    static_cast<void>(search.build(topologies, positions, options));
}

/// Every step by both searches.
Totals compare(const Sequence& q, const CoherentOptions& options) {
    SearchOptions usual;
    static_cast<PairOptions&>(usual) = options;
    usual.between = options.between;
    usual.within = options.within;
    CoherentSearch coherent;
    ContactSearch anew;
    build(coherent, q, options);
    build(anew, q, usual);
    Totals totals;
    std::vector<SearchContact> found, wanted;
    for (std::size_t k = 0; k < q.step_count(); ++k) {
        SCOPED_TRACE(::testing::Message() << "step " << k);
        const auto motions = q.step(k);
        const auto started = coherent.start_step(motions);
        EXPECT_TRUE(started.ok());
        coherent.find_candidates();
        coherent.decide(found);
        anew.refit(motions);
        anew.find_candidates();
        anew.decide(wanted);
        expect_same(found, wanted);
        EXPECT_EQ(coherent.stats().safe_fraction, anew.stats().safe_fraction);
        EXPECT_EQ(coherent.stats().exact, anew.stats().exact);
        if (::testing::Test::HasFatalFailure()) return totals;
        totals.contacts += found.size();
        totals.tests += coherent.stats().candidates_vf + coherent.stats().candidates_ee;
        totals.tests_anew += anew.stats().candidates_vf + anew.stats().candidates_ee;
        totals.dangling += coherent.coherence().dangling;
        totals.sessions += coherent.coherence().began_session;
        totals.bounds += coherent.coherence().bounds;
    }
    return totals;
}

TEST(CoherentSearch, FindsTheContactsOfEveryStepOfClothAndCatheter) {
    for (const double distance : {0.0, 0.004}) {
        SCOPED_TRACE(distance);
        const Totals sheet = compare(make_rolling_sheet(24), options_at(distance));
        EXPECT_GT(sheet.contacts, 200u);
        EXPECT_LT(3 * sheet.tests, 2 * sheet.tests_anew);
        EXPECT_LT(sheet.sessions, 20u);
        for (const bool merged : {false, true}) {
            const Totals catheter = compare(make_catheter(24, merged), options_at(distance));
            EXPECT_GT(catheter.contacts, 200u);
            EXPECT_LT(catheter.tests, catheter.tests_anew / 2);
        }
    }
}

TEST(CoherentSearch, FindsTheContactsOfASoup) {
    for (const double motion : {0.001, 0.01, 0.1})
        for (const double distance : {0.0, 0.01}) {
            SCOPED_TRACE(::testing::Message() << "motion " << motion << " distance " << distance);
            EXPECT_GT(compare(make_soup(3, 400, 10, motion), options_at(distance)).contacts, motion < 0.01 ? 20u : 200u);
        }
}

TEST(CoherentSearch, NoExactSwitchChangesAContact) {
    const Sequence sheet = make_rolling_sheet(12), catheter = make_catheter(12, true), soup = make_soup(4, 80, 8, 0.02);
    const auto with = [](auto change) {
        CoherentOptions options = options_at(0.002);
        change(options);
        return options;
    };
    const std::vector<std::pair<const char*, CoherentOptions>> all{
        {"without skipping", with([](auto& o) { o.skipping = false; })},
        {"no front end", with([](auto& o) { o.front_end = false; })},
        {"the paper's inflation", with([](auto& o) { o.inflation = VolumeInflation::Paper; })},
        {"the paper's inflation, slack speed", with([](auto& o) {
             o.inflation = VolumeInflation::Paper;
             o.speed_slack = 0.001;
         })},
        {"alone", with([](auto& o) {
             o.dangling = DanglingTraversal::Alone;
             o.slack = 0.05;
             o.session_length = 6;
         })},
        {"partial", with([](auto& o) {
             o.dangling = DanglingTraversal::Partial;
             o.slack = 0.05;
             o.session_length = 6;
         })},
        {"length 1", with([](auto& o) { o.session_length = 1; })},
        {"length 64", with([](auto& o) { o.session_length = 64; })},
        {"no slack", with([](auto& o) { o.slack = 0.0; })},
        {"no reach", with([](auto& o) { o.reach = 0.0; })},
        {"wide reach", with([](auto& o) { o.reach = 4.0; })},
        {"one triangle in a cluster, two children", with([](auto& o) {
             o.tree.cluster_size = 1;
             o.tree.arity = 2;
         })},
        {"arity 4, without SIMD", with([](auto& o) {
             o.tree.arity = 4;
             o.tree.cluster_size = 32;
             o.simd = false;
         })},
        {"between only", with([](auto& o) { o.within = false; })},
        {"within only", with([](auto& o) { o.between = false; })},
    };
    for (const auto& [name, options] : all) {
        SCOPED_TRACE(name);
        for (const Sequence* q : {&sheet, &catheter, &soup}) static_cast<void>(compare(*q, options));
    }
}

TEST(CoherentSearch, StandsAStepOfTenBodySizes) {
    for (const double distance : {0.0, 0.01}) {
        Sequence q = make_soup(7, 60, 4, 0.01);
        const auto shoot = [&](double from, double to) {
            const auto back = q.frames.back();
            q.add_frame([&](std::size_t s, const Vec3&, std::size_t v) {
                return Vec3(back[s][v] + (s == 0 ? to - from : from - to) * Vec3(1.0, 0.3, -0.2));
            });
        };
        shoot(0.0, 20.0); // body by body through each other
        shoot(20.0, 0.0);
        shoot(0.0, 0.01);
        shoot(0.01, 20.0);
        shoot(20.0, 20.0);
        EXPECT_GT(compare(q, options_at(distance)).contacts, 100u);
    }
}

TEST(CoherentSearch, StandsFastAndStillStepsInTurn) {
    Sequence q = make_catheter(0, false);
    for (std::size_t k = 1; k < 16; ++k)
        q.add_frame([&](std::size_t s, const Vec3& p, std::size_t) {
            return Vec3(p +
                        (s == 1 ? Vec3(0.02 * static_cast<double>(k / 2 % 3), 0.03 * static_cast<double>(k / 2 % 2), 0.1) : Vec3::Zero()));
        });
    const Totals totals = compare(q, options_at(0.001));
    EXPECT_GT(totals.contacts, 100u);
}

TEST(CoherentSearch, FollowsBodiesThatTeleportBetweenSteps) {
    Sequence q = make_catheter(20, false);
    q.starts = {0, 1, 2, 15, 16, 3, 3, 3, 19, 0, 1, 8}; // the same step again, back, far ahead
    EXPECT_GT(compare(q, options_at(0.0)).contacts, 50u);
    EXPECT_GT(compare(q, options_at(0.004)).contacts, 100u);
}

/// To and fro: nothing goes on as it went. The first `still` surfaces do not.
Sequence make_hopping_soup(std::size_t still) {
    Sequence q = make_soup(9, 200, 0, 0.0);
    for (std::size_t k = 1; k < 14; ++k)
        q.add_frame([&](std::size_t s, const Vec3& p, std::size_t) {
            return s < still ? p
                             : Vec3(p + Vec3((s == 0 ? -0.3 : 0.3) * static_cast<double>(k % 2), 0.02 * static_cast<double>(s + k), 0.0));
        });
    return q;
}

TEST(CoherentSearch, BeginsAnewWhereEverythingDangles) {
    CoherentOptions options = options_at(0.0);
    options.session_length = 8;
    const Totals totals = compare(make_hopping_soup(0), options);
    EXPECT_EQ(totals.sessions, 13u);
    EXPECT_GT(totals.dangling, 100u);
    EXPECT_GT(totals.contacts, 100u);
}

TEST(CoherentSearch, CatchesUpWithWhatDangles) {
    Sequence q = make_hopping_soup(1);
    q.surfaces[0] = make_sheet(60, 30, 0.04); // many clusters that stay
    for (auto& frame : q.frames) {
        frame[0] = q.surfaces[0].t0;
        for (Vec3& p : frame[0]) p -= Vec3(1.2, 0.6, 0.0);
    }
    for (const DanglingTraversal way : {DanglingTraversal::Adaptive, DanglingTraversal::Alone, DanglingTraversal::Partial}) {
        CoherentOptions options = options_at(0.0);
        options.session_length = 7;
        options.dangling = way;
        const Totals totals = compare(q, options);
        EXPECT_EQ(totals.sessions, 2u);
        EXPECT_GT(totals.dangling, 100u);
        EXPECT_GT(totals.contacts, 100u);
    }
}

TEST(CoherentSearch, TakesADistanceLargerThanTheBodies) {
    const Totals totals = compare(make_soup(11, 12, 4, 0.01), options_at(30.0));
    EXPECT_EQ(totals.tests, totals.tests_anew); // all pairs, always
    EXPECT_GT(totals.contacts, 1000u);
}

TEST(CoherentSearch, TakesEmptyDegenerateAndEnormousSurfaces) {
    Sequence q;
    Surface empty, point, huge;
    empty.close();
    point.t0 = {Vec3(0.2, 0.2, 0.0), Vec3(0.2, 0.2, 0.0), Vec3(5.0, 5.0, 5.0)};
    point.triangles = {{0, 1, 0}, {0, 1, 1}};
    point.close();
    huge.t0 = {Vec3(-1e40, -1e40, 0.0), Vec3(1e40, -1e40, 0.0), Vec3(0.0, 1e40, 0.0)};
    huge.triangles = {{0, 1, 2}};
    huge.close();
    q.surfaces = {empty, point, huge};
    for (int k = 0; k < 5; ++k)
        q.add_frame([&](std::size_t s, const Vec3& p, std::size_t) { return s == 1 ? Vec3(p + Vec3(0.0, 0.0, 0.5 - 0.3 * k)) : p; });
    EXPECT_GT(compare(q, options_at(0.0)).contacts, 0u);
}

TEST(CoherentSearch, RefusesWhatItWasNotBuiltForAndGoesOn) {
    Sequence q = make_catheter(4, false);
    CoherentSearch search;
    build(search, q, options_at(0.0));
    std::vector<SearchContact> before, after;
    const auto run = [&](std::size_t k, std::vector<SearchContact>& out) {
        ASSERT_TRUE(search.start_step(q.step(k)).ok());
        search.find_candidates();
        search.decide(out);
    };
    run(0, before);
    auto motions = q.step(1);
    std::vector<Vec3> bad(motions[0].t1.begin(), motions[0].t1.end());
    bad[7][1] = std::numeric_limits<double>::quiet_NaN();
    motions[0].t1 = bad;
    const auto not_finite = search.start_step(motions);
    ASSERT_FALSE(not_finite.ok());
    EXPECT_EQ(not_finite.error().code, ErrorCode::NotFinite);
    EXPECT_NE(not_finite.error().message.find("vertex 7"), std::string::npos);
    bad[7][1] = -std::numeric_limits<double>::infinity();
    EXPECT_FALSE(search.start_step(motions).ok());
    motions = q.step(1);
    std::swap(q.surfaces[1].topology.triangles[3], q.surfaces[1].topology.triangles[4]);
    const auto swapped = search.start_step(motions);
    ASSERT_FALSE(swapped.ok());
    EXPECT_NE(swapped.error().message.find("surface 1"), std::string::npos);
    std::swap(q.surfaces[1].topology.triangles[3], q.surfaces[1].topology.triangles[4]);
    const SurfaceTopology other = q.surfaces[0].topology;
    motions[0].topology = &other;
    EXPECT_FALSE(search.start_step(motions).ok());
    EXPECT_FALSE(search.start_step(std::span(motions).first(1)).ok());
    motions = q.step(1);
    motions[1].t1 = motions[1].t1.first(5);
    EXPECT_FALSE(search.start_step(motions).ok());
    run(0, after); // as if nothing had happened
    expect_same(after, before);
    CoherentOptions dop = options_at(0.0);
    dop.tree.dop = 14;
    std::vector<const SurfaceTopology*> topologies{&q.surfaces[0].topology};
    std::vector<std::span<const Vec3>> positions{q.frames[0][0]};
    EXPECT_FALSE(CoherentSearch().build(topologies, positions, dop).ok());
}

/// Brings points of two clusters no closer than it says: random clusters that share most of their motion, a turn included.
TEST(ClusterDrift, BoundsHowMuchCloserPointsCome) {
    Random random(21);
    double least_share = 1.0;
    for (int round = 0; round < 400; ++round) {
        const Vec3 turn = random.vector(round % 2 == 0 ? 0.1 : 2.0), move = random.vector(1.0);
        const double noise = std::pow(10.0, random.real(-9.0, -1.0));
        std::vector<Vec3> t0, t1;
        for (int v = 0; v < 24; ++v) {
            t0.push_back(random.vector(0.3) + Vec3(v < 12 ? 0.0 : 0.5, 100.0, 0.0));
            t1.push_back(t0.back() + move + turn.cross(t0.back() - Vec3(0.0, 100.0, 0.0)) + random.vector(noise));
        }
        std::vector<Index> first(12), second(12);
        for (Index v = 0; v < 12; ++v) {
            first[v] = v;
            second[v] = v + 12;
        }
        const ClusterDrift a = find_drift(t0, t1, first), b = find_drift(t0, t1, second);
        for (const double bound : {relative_drift(a, b), relative_drift(b, a)})
            for (int pair = 0; pair < 200; ++pair) {
                const auto v = static_cast<std::size_t>(random.bits() % 12), w = 12 + static_cast<std::size_t>(random.bits() % 12);
                const double s = random.real(0.0, 1.0), before = (t0[v] - t0[w]).norm();
                const double after = ((1 - s) * (t0[v] - t0[w]) + s * (t1[v] - t1[w])).norm();
                ASSERT_LE(before - after, bound + 1e-15 * before);
                least_share = std::min(least_share, bound / noise);
            }
    }
    EXPECT_LT(least_share, 30.0); // close to what is not shared
}

TEST(FeatureBounds, AreBelowTheDistanceAndCloseToIt) {
    Random random(22);
    const Surface a = testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.0), b = testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.0);
    std::vector<FeaturePair> vertex_faces, edge_edges;
    for (int i = 0; i < 2000; ++i) {
        vertex_faces.push_back({static_cast<Index>(random.bits() % a.t0.size()), static_cast<Index>(random.bits() % b.triangles.size())});
        edge_edges.push_back(
            {static_cast<Index>(random.bits() % a.topology.edges.size()), static_cast<Index>(random.bits() % b.topology.edges.size())});
    }
    std::vector<double> bounds(vertex_faces.size());
    bound_vertex_faces(a.motion(), b.motion(), vertex_faces, bounds);
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        const Triangle& t = b.triangles[vertex_faces[i].b];
        const double distance = std::sqrt(closest_on_triangle(a.t0[vertex_faces[i].a], b.t0[t[0]], b.t0[t[1]], b.t0[t[2]]).distance_sq);
        ASSERT_LE(bounds[i], distance);
        ASSERT_GT(bounds[i], 0.999999 * distance - 1e-9);
    }
    bound_edge_edges(a.motion(), b.motion(), edge_edges, bounds);
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        const Edge &e = a.topology.edges[edge_edges[i].a], &f = b.topology.edges[edge_edges[i].b];
        const double distance = std::sqrt(closest_on_segments({a.t0[e[0]], a.t0[e[1]]}, {b.t0[f[0]], b.t0[f[1]]}).distance_sq);
        ASSERT_LE(bounds[i], distance);
        ASSERT_GT(bounds[i], 0.999999 * distance - 1e-9);
    }
}

/// The heuristic may lose contacts, and only that; on a sheet that is rolled up it finds those of its layers.
TEST(CoherentSearch, NormalConesInventNoContact) {
    const Sequence q = make_rolling_sheet(16);
    CoherentOptions options = options_at(0.0);
    CoherentSearch exact, heuristic;
    build(exact, q, options);
    options.normal_cones = true;
    build(heuristic, q, options);
    std::vector<SearchContact> all, some;
    std::size_t found = 0, kept = 0;
    std::uint64_t pairs = 0, pairs_left = 0;
    for (std::size_t k = 0; k < q.step_count(); ++k) {
        for (auto* search : {&exact, &heuristic}) {
            ASSERT_TRUE(search->start_step(q.step(k)).ok());
            search->find_candidates();
            search->decide(search == &exact ? all : some);
        }
        ASSERT_TRUE(std::includes(all.begin(), all.end(), some.begin(), some.end(), comes_before));
        found += all.size();
        kept += some.size();
        pairs += exact.coherence().kept_clusters;
        pairs_left += heuristic.coherence().kept_clusters;
    }
    std::printf("%zu contacts of %zu\n", kept, found);
    EXPECT_GT(2 * kept, found);
    EXPECT_LT(4 * pairs_left, 3 * pairs);
}

TEST(ContactTrack, CountsTheStepsOfEveryPairInContact) {
    const auto contact = [](Index a, Index b) {
        SearchContact c;
        c.contact.origin = ContactOrigin::ExactVF;
        c.contact.feature_a[0] = c.id_a = a;
        c.id_b = b;
        return c;
    };
    const std::vector<SearchContact> steps[] = {{contact(1, 1), contact(2, 7)}, {contact(0, 4), contact(2, 7)}, {}, {contact(2, 7)}};
    ContactTrack track;
    const std::size_t began[] = {2, 1, 0, 1}, ended[] = {0, 1, 2, 0};
    for (std::size_t k = 0; k < 4; ++k) {
        track.follow(steps[k]);
        ASSERT_EQ(track.contacts().size(), steps[k].size());
        EXPECT_EQ(track.began(), began[k]);
        EXPECT_EQ(track.ended(), ended[k]);
        if (k == 1) {
            EXPECT_EQ(track.contacts()[0].steps, 1u);
            EXPECT_EQ(track.contacts()[1].steps, 2u);
        }
    }
    EXPECT_EQ(track.contacts()[0].steps, 1u); // a pair that parted counts anew
}

TEST(CoherentSearch, AsksForNoMemoryOnceItHasSeenTheMotion) {
    Sequence q = make_catheter(12, false);
    for (std::size_t round = 0; round < 8; ++round) // over and over
        for (std::size_t k = 0; k < 12; ++k) q.starts.push_back(k);
    CoherentOptions options = options_at(0.002);
    options.session_length = 4; // the same sessions in every round
    CoherentSearch search;
    build(search, q, options);
    std::vector<SearchContact> found;
    std::vector<std::vector<SurfaceMotion>> motions;
    for (std::size_t k = 0; k < q.step_count(); ++k) motions.push_back(q.step(k));
    std::size_t before = 0;
    for (std::size_t k = 0; k < q.step_count(); ++k) {
        if (k == 72) before = testing::allocation_count();
        ASSERT_TRUE(search.start_step(motions[k]).ok());
        search.find_candidates();
        search.decide(found);
    }
    EXPECT_EQ(testing::allocation_count() - before, 0u);
}

} // namespace
} // namespace seldinger::collision
