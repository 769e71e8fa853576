// Bounds refitted part by part are those of a refit of everything.
#include "collision/bvh/dop_tree.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

namespace trocar::collision {
namespace {

using namespace testing;

TEST(DopTree, NodesAboveAPartAreThoseOfAWholeRefit) {
    Random random(41);
    for (const TreeOptions& options : {TreeOptions{}, TreeOptions{.cluster_size = 4}, TreeOptions{.dop = 6, .cluster_size = 16, .fine = true}}) {
        Surface surface = make_bent_tube(0.2, 0.01, 60, 16, 4.0);
        surface.t1 = surface.t0;
        surface.close();
        DopTree parts, whole;
        for (DopTree* tree : {&parts, &whole}) {
            tree->build(surface.topology, surface.t0, options);
            tree->refit(surface.motion());
        }
        const auto clusters = static_cast<Index>(parts.clusters().size());
        constexpr Index kParts = 7;
        for (int round = 0; round < 4; ++round) {
            surface.t0 = surface.t1;
            for (Vec3& v : surface.t1) v += random.vector(2e-3);
            whole.refit(surface.motion());
            parts.refit_vertices(surface.motion(), 0, static_cast<Index>(surface.t0.size()));
            for (Index part = 0; part < kParts; ++part) { // in any order, each with the nodes above it
                const Index at = (part * 3 + static_cast<Index>(round)) % kParts;
                const Index begin = clusters * at / kParts, end = clusters * (at + 1) / kParts;
                parts.refit_clusters(begin, end);
                parts.refit_nodes(begin, end);
            }
            const std::size_t row = 2 * whole.slabs() * options.arity;
            std::vector<Index> open{whole.root()};
            std::size_t nodes = 0;
            while (!open.empty()) {
                const Index node = open.back();
                open.pop_back();
                if ((node & DopTree::kLeafBit) != 0) continue;
                ++nodes;
                for (std::size_t k = 0; k < row; ++k) ASSERT_EQ(parts.child_bounds(node)[k], whole.child_bounds(node)[k]) << "node " << node;
                for (std::size_t i = 0; i < options.arity; ++i)
                    if (whole.children(node)[i] != DopTree::kNoChild) open.push_back(whole.children(node)[i]);
            }
            EXPECT_GT(nodes, 10u);
        }
    }
}

} // namespace
} // namespace trocar::collision
