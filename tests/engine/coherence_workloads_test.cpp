// Every switch of coherence and cones that is called exact, on and off, on the sequences that contacts are measured on: a catheter in its
// artery, cloth that folds until its layers press on each other, two frames of a cloth on a ball. What the heuristic ones lose is shown.
#include "collision/proximity/proximity_search.hpp"
#include "bench/contact_workloads.hpp"
#include "engine/experiments/coherence_comparison.hpp"
#include "engine/io/read_surface.hpp"
#include "tests/made/surfaces.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

namespace trocar::engine {
namespace {

using collision::CoherentOptions;
using collision::Exactness;
using collision::Inflation;
using collision::NormalCones;
using collision::Proximity;
using collision::ProximityOptions;
using collision::SurfaceMotion;

/// One surface over some frames.
struct Workload {
    collision::SurfaceTopology topology;
    std::vector<std::vector<Vec3>> frames;

    [[nodiscard]] std::size_t steps() const { return frames.size() - 1; }
    [[nodiscard]] SurfaceMotion step(std::size_t k) const { return {&topology, frames[k], frames[k + 1]}; }
};

Workload workload_of(const FrameSequence& sequence) {
    Workload out{collision::make_topology(sequence.triangles, sequence.vertex_count()), {}};
    for (std::size_t k = 0; k < sequence.frame_count; ++k) {
        const auto frame = sequence.frame(k);
        out.frames.emplace_back(frame.begin(), frame.end());
    }
    return out;
}

Workload artery(std::size_t steps) { return workload_of(make_bending_artery(1.5e-3, steps)); }
Workload cloth() { return workload_of(make_folding_cloth(24, 160, {32, 4})); }

/// Empty where the data are not there.
Workload cloth_on_a_ball() {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) return {};
    const std::filesystem::path folder = std::filesystem::path(data) / "cloth";
    if (!std::filesystem::exists(folder / "cloth_ball92.ply.gz")) return {};
    const auto t0 = read_surface(folder / "cloth_ball92.ply.gz"), t1 = read_surface(folder / "cloth_ball93.ply.gz");
    EXPECT_TRUE(t0.ok() && t1.ok());
    return {collision::make_topology(t0->triangles, t0->vertices.size()), {t0->vertices, t1->vertices}};
}

struct Found {
    std::vector<std::vector<Proximity>> steps;
    collision::ProximityStats stats;
    [[nodiscard]] std::size_t count() const {
        std::size_t sum = 0;
        for (const auto& step : steps) sum += step.size();
        return sum;
    }
};

Found find(const Workload& workload, const ProximityOptions& options) {
    collision::ProximitySearch search;
    const collision::SurfaceTopology* surface = &workload.topology;
    const std::span<const Vec3> shape = workload.frames[0];
    EXPECT_TRUE(search.build({&surface, 1}, {&shape, 1}, options).ok());
    Found out;
    for (std::size_t k = 0; k < workload.steps(); ++k) {
        const SurfaceMotion motion = workload.step(k);
        EXPECT_TRUE(search.refit({&motion, 1}).ok());
        search.find(out.steps.emplace_back());
        out.stats.add(search.stats());
    }
    return out;
}

bool same_bits(const Proximity& x, const Proximity& y) {
    return x.face_a == y.face_a && x.face_b == y.face_b && x.found.time == y.found.time &&
           x.found.points.distance == y.found.points.distance && x.found.points.bary_a == y.found.points.bary_a &&
           x.found.points.bary_b == y.found.points.bary_b;
}
bool comes_before(const Proximity& x, const Proximity& y) { return std::pair(x.face_a, x.face_b) < std::pair(y.face_a, y.face_b); }

struct Switch {
    const char* name;
    void (*set)(ProximityOptions&);
};
constexpr Switch kExactSwitches[] = {
    {"k 6", [](auto& o) { o.dop = 6; }},
    {"k 26", [](auto& o) { o.dop = 26; }},
    {"arity 2", [](auto& o) { o.arity = 2; }},
    {"arity 8", [](auto& o) { o.arity = 8; }},
    {"plain inflation", [](auto& o) { o.inflation = Inflation::Plain; }},
    {"extrapolated vertices", [](auto& o) { o.inflation = Inflation::Swept; }},
    {"lazy refit", [](auto& o) { o.lazy_tolerance = 1e-4; }},
    {"significant velocities", [](auto& o) { o.significance = 1e-3; }},
    {"cones with contours", [](auto& o) { o.normal_cones = NormalCones::Contour; }},
    {"separation list", [](auto& o) { o.coherence = collision::Coherence::SeparationList; }},
    {"no SIMD", [](auto& o) { o.simd = false; }},
};
constexpr Switch kHeuristicSwitches[] = {
    {"cones alone", [](auto& o) { o.normal_cones = NormalCones::Alone; }},
    {"cones and groups", [](auto& o) { o.normal_cones = NormalCones::Groups; }},
    {"leaf angle", [](auto& o) { o.leaf_angle = 0.5; }},
    {"oriented by the mean axis", [](auto& o) { o.inflation = Inflation::OrientedPaper; }},
    {"velocity cones' reuse",
     [](auto& o) {
         o.coherence = collision::Coherence::VelocityCones;
         o.reuse_limit = 1e-4;
     }},
};

/// What meets, decided without rounding, by the set with every shortcut disabled; then one switch after the other.
void expect_switches(const char* name, const Workload& workload, std::size_t at_least, std::span<const Switch> exact = kExactSwitches,
                     std::span<const Switch> heuristic = kHeuristicSwitches) {
    ProximityOptions off;
    off.normal_cones = NormalCones::Off;
    const Found wanted = find(workload, off);
    EXPECT_GT(wanted.count(), at_least);
    const auto with = [&](const Switch& one) {
        ProximityOptions options = off;
        one.set(options);
        return options;
    };
    for (const Switch& one : exact) {
        SCOPED_TRACE(std::string(name) + ", " + one.name);
        ASSERT_EQ(exactness_of(with(one)), Exactness::Exact);
        const Found found = find(workload, with(one));
        for (std::size_t k = 0; k < workload.steps(); ++k)
            EXPECT_TRUE(std::equal(found.steps[k].begin(), found.steps[k].end(), wanted.steps[k].begin(), wanted.steps[k].end(), same_bits))
                << "step " << k << ": " << found.steps[k].size() << " instead of " << wanted.steps[k].size();
    }
    for (const Switch& one : heuristic) {
        SCOPED_TRACE(std::string(name) + ", " + one.name);
        ASSERT_EQ(exactness_of(with(one)), Exactness::Heuristic);
        const Found found = find(workload, with(one));
        for (std::size_t k = 0; k < workload.steps(); ++k) // none is invented
            EXPECT_TRUE(
                std::includes(wanted.steps[k].begin(), wanted.steps[k].end(), found.steps[k].begin(), found.steps[k].end(), comes_before))
                << "step " << k;
        std::printf("%s: %s loses %zu of %zu\n", name, one.name, wanted.count() - found.count(), wanted.count());
    }
}

TEST(CoherenceWorkloads, ExactSwitchesChangeNothingOnACatheterInItsArtery) { expect_switches("artery", artery(2), 100); }
TEST(CoherenceWorkloads, ExactSwitchesChangeNothingOnClothThatFolds) { expect_switches("folding cloth", cloth(), 1000); }
/// A cloth on a ball that is folded, frame by frame, until it crosses itself thousands of times.
Workload made_cloth_on_a_ball() {
    const TriMesh first = made::make_drape(80, 1.2);
    return {collision::make_topology(first.triangles, first.vertices.size()),
            {first.vertices, made::make_drape(80, 1.25).vertices, made::make_drape(80, 1.3).vertices}};
}

// of 92 thousand triangles that cross themselves a hundred thousand times: what runs along other paths
constexpr Switch kSwitchesOfABall[] = {kExactSwitches[0], kExactSwitches[3], kExactSwitches[8], kExactSwitches[9]};

TEST(CoherenceWorkloads, ExactSwitchesChangeNothingOnAMadeClothOnABall) {
    expect_switches("made cloth on a ball", made_cloth_on_a_ball(), 300, kSwitchesOfABall, std::span(kHeuristicSwitches).subspan(1, 1));
}
TEST(CoherenceWorkloads, ExactSwitchesChangeNothingOnAClothOnABall) {
    const Workload workload = cloth_on_a_ball();
    if (workload.frames.empty()) GTEST_SKIP() << "TROCAR_TEST_DATA has no cloth/cloth_ball92.ply.gz";
    expect_switches("cloth on a ball", workload, 10000, kSwitchesOfABall, std::span(kHeuristicSwitches).subspan(1, 1));
}

/// Sessions beside the search that keeps nothing.
/// most   of the switches that are tried
void expect_sessions(const char* name, const Workload& workload, std::size_t most = SIZE_MAX) {
    SCOPED_TRACE(name);
    const std::pair<const char*, void (*)(CoherentOptions&)> switches[] = {
        {"as it is", [](CoherentOptions&) {}},
        {"always with sessions", [](CoherentOptions& o) { o.falls_back = false; }},
        {"no sides", [](CoherentOptions& o) { o.falls_back = o.sides = false; }},
        {"no front end", [](CoherentOptions& o) { o.falls_back = o.front_end = false; }},
        {"the paper's inflation",
         [](CoherentOptions& o) {
             o.falls_back = false;
             o.inflation = collision::VolumeInflation::Paper;
         }},
        {"without skipping", [](CoherentOptions& o) { o.skipping = false; }},
    };
    for (const auto& [what, set] : std::span(switches).first(std::min(most, std::size(switches)))) {
        CoherentOptions options;
        set(options);
        const auto compared = compare_coherence(
            workload.steps(), [&](std::size_t k) { return std::vector<SurfaceMotion>{workload.step(k)}; }, options);
        ASSERT_TRUE(compared.ok());
        EXPECT_TRUE(compared->same) << what;
        EXPECT_GT(compared->steps_with_contacts(), 0u);
    }
}

TEST(CoherenceWorkloads, SessionsFindTheSameContacts) {
    expect_sessions("artery", artery(8));
    expect_sessions("folding cloth", workload_of(make_folding_cloth(24, 160, {28, 14})));
    expect_sessions("made cloth on a ball", made_cloth_on_a_ball(), 2);
    if (const Workload ball = cloth_on_a_ball(); ball.frames.empty())
        std::printf("TROCAR_TEST_DATA has no cloth/cloth_ball92.ply.gz: left out\n");
    else
        expect_sessions("cloth on a ball", {ball.topology, {ball.frames[0], ball.frames[1], ball.frames[1]}}, 2);
}

} // namespace
} // namespace trocar::engine
