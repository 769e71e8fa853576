// Surfaces that move over many steps, and a step by step comparison of CoherentSearch with ContactSearch.
#pragma once

#include "collision/search/coherent_search.hpp"
#include "collision/search/contact_search.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace trocar::collision::testing {

/// Surfaces and where their vertices are at each frame; a step goes from one frame to the next, unless `teleports`.
struct MeshSequence {
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

inline Surface make_sheet(std::size_t columns, std::size_t rows, double square) {
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
inline MeshSequence make_rolling_sheet(std::size_t steps) {
    MeshSequence q;
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
inline MeshSequence make_catheter(std::size_t steps, bool merged) {
    MeshSequence q;
    Surface wide = make_bent_tube(1.0, 0.1, 40, 20, 0.5), thin = make_bent_tube(0.6, 0.03, 40, 10, 0.5);
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
inline MeshSequence make_soup(std::uint64_t seed, std::size_t triangles, std::size_t steps, double motion) {
    Random random(seed);
    MeshSequence q;
    q.surfaces = {make_triangle_soup(random, triangles, 1.0, 0.15, 0.0), make_triangle_soup(random, triangles / 2, 1.0, 0.15, 0.0)};
    q.add_frame([](std::size_t, const Vec3& p, std::size_t) { return p; });
    for (std::size_t k = 0; k < steps; ++k)
        q.add_frame([&](std::size_t s, const Vec3&, std::size_t v) { return Vec3(q.frames.back()[s][v] + random.vector(motion)); });
    return q;
}

struct Totals {
    std::size_t contacts = 0, plain = 0;
    std::uint64_t tests = 0, tests_anew = 0, dangling = 0, sessions = 0, bounds = 0, sides = 0;
    double work = 0.0, work_anew = 0.0; // as counted
};

inline CoherentOptions options_at(double distance) {
    CoherentOptions options;
    options.distance = distance;
    options.tolerance = 1e-9 * distance;
    options.tree.cluster_size = 8; // several clusters also in small bodies
    options.falls_back = false;    // what is kept is what is tested
    return options;
}

inline void expect_same(std::span<const SearchContact> found, std::span<const SearchContact> wanted) {
    ASSERT_EQ(found.size(), wanted.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Contact &a = found[i].contact, &b = wanted[i].contact;
        ASSERT_EQ(a.origin, b.origin);
        ASSERT_EQ((std::array<Index, 4>{a.a.code(), found[i].id_a, a.b.code(), found[i].id_b}),
                  (std::array<Index, 4>{b.a.code(), wanted[i].id_a, b.b.code(), wanted[i].id_b}));
        ASSERT_EQ(a.time, b.time);
        ASSERT_EQ(a.normal, b.normal);
        ASSERT_EQ(a.point, b.point);
        ASSERT_EQ(a.gap, b.gap);
    }
}

template <class Search>
void build(Search& search, const MeshSequence& q, const auto& options) {
    std::vector<const SurfaceTopology*> topologies;
    std::vector<std::span<const Vec3>> positions;
    for (std::size_t s = 0; s < q.surfaces.size(); ++s) {
        topologies.push_back(&q.surfaces[s].topology);
        positions.push_back(q.frames[0][s]);
    }
    static_cast<void>(search.build(topologies, positions, options));
}

/// Every step by both searches.
inline Totals compare(const MeshSequence& q, const CoherentOptions& options) {
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
        totals.sides += coherent.coherence().sides;
        totals.plain += coherent.coherence().plain;
        totals.work += coherent.coherence().work;
        totals.work_anew += coherent.plain_work(anew);
    }
    return totals;
}

} // namespace trocar::collision::testing
