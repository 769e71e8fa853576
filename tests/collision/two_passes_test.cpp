#include "collision/culling/chromatic_sets.hpp"
#include "collision/culling/cull_twin.hpp"
#include "collision/culling/two_passes.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace trocar::collision {
namespace {

TEST(TwoPasses, OneViewGivesTheBitsOfTheOrderFreeForm) {
    testing::Random random(31);
    for (int round = 0; round < 6; ++round) {
        SCOPED_TRACE(::testing::Message() << "seed 31, round " << round);
        testing::Surface s = testing::make_bent_tube(1.0, 0.2, 12, 10, 2.0);
        for (Vec3& p : s.t0) p += random.vector(0.05);
        for (std::size_t v = 0; v < s.t0.size(); ++v) s.t1[v] = s.t0[v] + random.vector(0.05);
        if (round % 2 == 1) std::fill(s.t0.begin(), s.t0.begin() + 40, Vec3(0.1, 0.1, 0.1)); // many equal depths
        const ChromaticSets sets = make_chromatic_sets(s.triangles, s.t0.size());
        std::vector<SweptCorners> prisms;
        for (const Triangle& t : s.triangles) prisms.push_back({s.t0[t[0]], s.t0[t[1]], s.t0[t[2]], s.t1[t[0]], s.t1[t[1]], s.t1[t[2]]});
        const CullFrame frame = make_cull_frame(view_along_axis(round % 3, round > 2), prisms, 0.005, 96, 80);
        std::vector<Footprint> footprints;
        for (const SweptCorners& prism : prisms) footprints.push_back(make_footprint(frame, prism));
        std::vector<CullQuestion> questions;
        std::vector<std::size_t> question_begin{0};
        for (Index set = 0; set < sets.count(); ++set) {
            for (Index prism = 0; prism < prisms.size(); ++prism) questions.push_back({prism, set});
            question_begin.push_back(questions.size());
        }
        const CullJob job{.width = 96,
                          .height = 80,
                          .footprints = footprints,
                          .corners = s.triangles,
                          .set_begin = sets.begin,
                          .set_members = sets.members,
                          .questions = questions,
                          .question_begin = question_begin,
                          .memory = CullMemory::Fronts};
        std::vector<std::uint8_t> reference(questions.size(), 7), hits(questions.size(), 7);
        CpuCanvas canvas;
        const auto queries = find_hits_in_two_passes(job, canvas, reference);
        ASSERT_TRUE(queries.ok());
        EXPECT_EQ(*queries, 2 * prisms.size() * sets.count());
        CpuCullBackend twin;
        ASSERT_TRUE(twin.find_hits(job, hits).ok());
        EXPECT_EQ(hits, reference);
        EXPECT_GT(std::count(hits.begin(), hits.end(), 0), 50);
        EXPECT_GT(std::count(hits.begin(), hits.end(), 1), 50);
    }
}

} // namespace
} // namespace trocar::collision
