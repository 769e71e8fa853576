// Times of one step with a catheter's skin in a lumen of the demo's size, stage by stage. Prints, and fails only on the absurd.
#include "collision/search/interruptible_search.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <ctime>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::Surface;

double now_ms() {
    return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; // the process's own time: machines are shared
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kSteps = 3; // these times say nothing
#else
constexpr int kSteps = 41;
#endif

/// Lumen: 60K triangles, 0.4 m, 3 mm radius; skin: 10K triangles, 0.5 mm radius, lying on the outer wall of the bend.
struct Scene {
    Surface lumen = testing::make_bent_tube(0.40, 3.0e-3, 1001, 30, 4.0);
    Surface skin = testing::make_bent_tube(0.38, 0.5e-3, 626, 8, 4.0);

    Scene() {
        for (std::size_t v = 0; v < skin.t0.size(); ++v) {
            const double along = static_cast<double>(v / 8) / 626.0;
            const double turn = 4.0 * (0.38 * along);
            // half of its length 50 um from the wall, half free
            const double offset = 2.45e-3 * (0.5 + 0.5 * std::tanh(8.0 * std::sin(12.0 * along)));
            skin.t0[v] -= offset * Vec3(0.0, std::cos(turn), -std::sin(turn));
        }
        move(0);
    }
    void move(int step) {
        Random random(static_cast<std::uint64_t>(step) + 1);
        for (std::size_t v = 0; v < skin.t0.size(); ++v) skin.t1[v] = skin.t0[v] + Vec3(0.0, 0.0, 0.35e-3) + random.vector(2e-5);
        for (std::size_t v = 0; v < lumen.t0.size(); ++v)
            lumen.t1[v] = lumen.t0[v] + Vec3(0.0, 0.0, 0.2e-3 * std::sin(5.0 * lumen.t0[v][2]));
    }
};

TEST(Bench, SkinInALumen) {
    Scene scene;
    DopTree skin, lumen;
    double start = now_ms();
    skin.build(scene.skin.topology, scene.skin.t0, {.fine = true});
    lumen.build(scene.lumen.topology, scene.lumen.t0, {.fine = true});
    std::printf("%zu + %zu triangles, built in %.1f ms\n", scene.skin.triangles.size(), scene.lumen.triangles.size(), now_ms() - start);
    InterruptibleSearch search;
    std::vector<Contact> contacts;
    for (const double distance : {0.0, 50e-6, 100e-6, 200e-6}) {
        const PairOptions options{.distance = distance, .tolerance = 0.01 * distance};
        std::vector<double> refit, find;
        ExactStats stats;
        for (int step = 0; step < kSteps; ++step) {
            scene.move(step);
            start = now_ms();
            skin.refit(scene.skin.motion());
            lumen.refit(scene.lumen.motion());
            const double middle = now_ms();
            contacts.clear();
            WorkBudget budget;
            stats = search.find({Thing::body(0), &skin, scene.skin.motion()}, {Thing::body(1), &lumen, scene.lumen.motion()}, options, budget, contacts);
            refit.push_back(middle - start);
            find.push_back(now_ms() - middle);
        }
        std::printf(
            "distance %3.0f um: refit %.2f ms, find %.2f ms (best %.2f, worst %.2f); box tests %lu, cluster pairs %lu, VF %lu -> %lu, "
            "EE %lu -> %lu, unresolved %lu\n",
            1e6 * distance, median(refit), median(find), *std::min_element(find.begin(), find.end()),
            *std::max_element(find.begin(), find.end()), stats.box_tests, stats.cluster_pairs, stats.candidates_vf, stats.hits_vf,
            stats.candidates_ee, stats.hits_ee, stats.unresolved);
        EXPECT_LT(median(refit) + median(find), 1000.0);
    }
}

} // namespace
} // namespace trocar::collision
