// How much image-space culling removes: a lower bound on each surface of the chromatic bench, beside the paper's figure. That it removes no
// contact is tested elsewhere (chromatic_cull_test, cull_law_test); a change that makes it prove less fails here.
#include "bench/chromatic_scenes.hpp"
#include "engine/render/culled_search.hpp"

#include <gtest/gtest.h>

namespace trocar::engine {
namespace {

struct Strength {
    std::uint64_t triangles_before = 0, triangles_after = 0, pairs_before = 0, pairs_after = 0;
    [[nodiscard]] double of_triangles() const { return static_cast<double>(triangles_before) / static_cast<double>(std::max<std::uint64_t>(1, triangles_after)); }
    [[nodiscard]] double of_pairs() const { return static_cast<double>(pairs_before) / static_cast<double>(std::max<std::uint64_t>(1, pairs_after)); }
};

/// Stage II in every step, by the CPU reference.
Strength measure_strength(const CullScene& scene) {
    const auto topologies = scene.topologies();
    const std::vector<std::span<const Vec3>> positions(topologies.size(), scene.frames.frame(0));
    CulledSearch culled(topologies, positions, {.method = CullMethod::Cpu, .within = scene.within, .between = scene.between});
    Strength sum;
    for (std::size_t k = 0; k < scene.step_count(); ++k) {
        culled.find_candidates(scene.motions(k));
        EXPECT_TRUE(culled.looked());
        for (const auto& job : culled.jobs()) {
            const collision::CullCounts& counts = job.culler->counts();
            sum.triangles_before += counts.near_triangles;
            sum.triangles_after += counts.left_triangles;
            sum.pairs_before += counts.near_pairs;
            sum.pairs_after += counts.left_pairs;
        }
    }
    return sum;
}

struct Bound {
    const char* name;
    CullScene scene;
    double triangles, pairs; // at least so many times fewer: a tenth below what was measured
};

TEST(CullStrength, IsBoundedFromBelowOnEverySurfaceOfTheBench) {
    CullScene between = make_curtains_scene(127, 128, 1);
    between.within = false;
    between.between = true;
    const Bound bounds[] = {{"skirt 13K", make_cloth_scene("skirt 13K", 81, 80, 1), 2.0, 2.1},
                            {"cloth 23K", make_cloth_scene("cloth 23K", 107, 107, 1), 1.85, 1.95},
                            {"two curtains", make_curtains_scene(127, 128, 1), 1.75, 1.8},
                            {"two curtains, each other", between, 1.25, 1.2},
                            {"catheter in vessel", make_catheter_scene(1), 1.9, 1.7},
                            {"catheter alone", make_catheter_alone_scene(1), 1.0, 1.4}};
    for (const Bound& bound : bounds) {
        const Strength strength = measure_strength(bound.scene);
        std::printf("%s: %llu to %llu triangles (%.2f times fewer), %llu to %llu pairs (%.2f)\n", bound.name,
                    static_cast<unsigned long long>(strength.triangles_before), static_cast<unsigned long long>(strength.triangles_after),
                    strength.of_triangles(), static_cast<unsigned long long>(strength.pairs_before),
                    static_cast<unsigned long long>(strength.pairs_after), strength.of_pairs());
        EXPECT_GT(strength.pairs_before, 0u) << bound.name;
        EXPECT_GE(strength.of_triangles(), bound.triangles) << bound.name;
        EXPECT_GE(strength.of_pairs(), bound.pairs) << bound.name;
    }
}

} // namespace
} // namespace trocar::engine
