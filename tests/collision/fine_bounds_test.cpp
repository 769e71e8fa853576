// The second test of the broad phase never says "apart" of what is not, and its kernels agree with their scalar references.
#include "collision/bvh/fine_bounds.hpp"

#include "collision/bvh/near_pairs.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <numeric>

namespace trocar::collision {
namespace {

using testing::Random;

TEST(FineBounds, HoldEveryVertexAtEveryTimeAndScale) {
    constexpr std::uint64_t kSeed = 51;
    Random random(kSeed);
    for (const double scale : {1e-9, 1.0, 1e6, 1e30}) {
        const Vec3 far = random.vector(1e4 * scale);
        std::vector<Vec3> t0, t1;
        for (int i = 0; i < 37; ++i) {
            t0.push_back(far + random.vector(scale));
            t1.push_back(t0.back() + random.vector(scale));
        }
        std::vector<Index> ids(t0.size());
        std::iota(ids.begin(), ids.end(), Index{0});
        std::vector<FineBounds> rows(t0.size());
        project_finely(t0, t1, ids, rows);
        const FineBounds together = join_finely(t0, t1, ids);
        for (std::size_t v = 0; v < t0.size(); ++v)
            for (std::size_t s = 0; s < kFineSlabs; ++s) {
                const auto& n = kCornerDirections[3 + s];
                for (const Vec3& p : {t0[v], t1[v]}) {
                    const long double at = static_cast<long double>(n[0]) * p[0] + static_cast<long double>(n[1]) * p[1] +
                                           static_cast<long double>(n[2]) * p[2];
                    EXPECT_LE(rows[v].row[s], at) << "seed " << kSeed << " scale " << scale << " vertex " << v;
                    EXPECT_LE(rows[v].row[kFineSlabs + s], -at) << "seed " << kSeed << " scale " << scale << " vertex " << v;
                    EXPECT_LE(together.row[s], at) << "seed " << kSeed << " scale " << scale;
                    EXPECT_LE(together.row[kFineSlabs + s], -at) << "seed " << kSeed << " scale " << scale;
                }
            }
    }
}

TEST(FineBounds, WhatIsNotANumberIsEverywhere) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    std::vector<Vec3> t0(6, Vec3(1.0, 2.0, 3.0)), t1 = t0;
    t1[2][1] = nan;
    t0[4][0] = 1e38;
    const std::vector<Index> ids{0, 1, 2, 3, 4, 5};
    std::vector<FineBounds> rows(6);
    project_finely(t0, t1, ids, rows);
    FineBounds far_away;
    far_away.row.fill(0.0f);
    for (std::size_t s = 0; s < kFineSlabs; ++s) {
        far_away.row[s] = 1e30f;
        far_away.row[kFineSlabs + s] = -1e30f;
    }
    const FineReach reach = fine_reach(0.0);
    for (std::size_t v = 0; v < 6; ++v) EXPECT_EQ(are_near(rows[v], far_away, reach), v == 2 || v == 4) << v;
    EXPECT_TRUE(are_near(join_finely(t0, t1, ids), far_away, reach));
}

TEST(NearFeatures, TheKernelAndItsScalarReferenceGiveTheSameLanes) {
    Random random(52);
    std::size_t near = 0;
    for (const std::size_t slabs : {3, 7, 9, 13})
        for (int trial = 0; trial < 200; ++trial) {
            std::vector<float> box(2 * slabs), block(2 * slabs * 16), reach(slabs, static_cast<float>(random.real(0.0, 0.3)));
            for (std::size_t s = 0; s < slabs; ++s) {
                box[s] = static_cast<float>(random.real(-1.0, 1.0));
                box[slabs + s] = -box[s] - 0.5f;
                for (std::size_t lane = 0; lane < 16; ++lane) {
                    float& lo = block[s * 16 + lane];
                    lo = lane == 15 ? SweptBox::kNothing : static_cast<float>(random.real(-1.0, 1.0));
                    block[(slabs + s) * 16 + lane] = lane == 15 ? SweptBox::kNothing : -lo - 1.0f;
                }
            }
            const std::uint32_t lanes = near_features(box.data(), block.data(), slabs, reach.data());
            EXPECT_EQ(lanes, near_features_plain(box.data(), block.data(), slabs, reach.data()));
            EXPECT_EQ(lanes >> 15, 0u) << "an empty lane";
            near += lanes != 0;
        }
    EXPECT_GT(near, 100u);
}

} // namespace
} // namespace trocar::collision
