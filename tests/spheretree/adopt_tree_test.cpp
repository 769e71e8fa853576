// Sphere trees from elsewhere: whatever they lack, nothing of the surface is outside the tree afterwards, and what they lacked is counted.
#include "shapes.hpp"
#include "spheretree/build/adopt_tree.hpp"
#include "spheretree/build/wrapped_tree.hpp"
#include "tests/made/surfaces.hpp"

#include <gtest/gtest.h>

#include <functional>

namespace trocar::spheretree::adopt_test {
namespace {

using test::make_straight_tube;
using test::Random;

TriMesh make_slab(const Vec3& extent) {
    TriMesh mesh;
    for (int k = 0; k < 8; ++k) mesh.vertices.emplace_back((k & 1) * extent[0], ((k >> 1) & 1) * extent[1], (k >> 2) * extent[2]);
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

struct Named {
    std::string name;
    TriMesh mesh;
};

std::vector<Named> surfaces() {
    return {{"slab", make_slab({0.1, 0.2, 0.03})}, {"tube", make_straight_tube(0.01, 0.12)}, {"organ", made::make_organ(3, 3)}};
}

/// A tree as a file holds it: without items.
SphereTree bare(SphereTree tree) {
    tree.items.clear();
    tree.item_begin.assign(tree.sphere_count(), 0);
    tree.item_end.assign(tree.sphere_count(), 0);
    return tree;
}

/// Random places of the surface are reached from the root through spheres that hold them, down to a leaf above their triangle.
void expect_reached(const SphereTree& tree, const TriMesh& mesh, std::uint64_t seed) {
    Random random(seed);
    for (int k = 0; k < 2000; ++k) {
        const auto t = static_cast<Index>(random.uniform(0.0, static_cast<double>(mesh.triangles.size())));
        double u = random.uniform(0, 1), v = random.uniform(0, 1);
        if (k % 4 == 0) u = 0.0; // edges
        if (k % 8 == 0) v = k % 16 == 0 ? 0.0 : 1.0; // corners
        if (u + v > 1.0) std::tie(u, v) = std::pair(1.0 - u, 1.0 - v);
        const Triangle& c = mesh.triangles[t];
        const Vec3 p = mesh.vertices[c[0]] * (1.0 - u - v) + mesh.vertices[c[1]] * u + mesh.vertices[c[2]] * v;
        bool reached = false;
        const std::function<void(Index)> descend = [&](Index s) {
            if ((p - tree.spheres[s].centre).norm() > tree.spheres[s].radius * (1.0 + 1e-9)) return;
            const auto items = tree.items_of(s);
            if (std::find(items.begin(), items.end(), t) == items.end()) return;
            if (tree.is_leaf(s)) reached = true;
            for (Index i = 0; i < tree.child_count[s]; ++i) descend(tree.first_child[s] + i);
        };
        descend(0);
        ASSERT_TRUE(reached) << "seed " << seed << ", place " << k << " of triangle " << t;
    }
}

void expect_sound(const SphereTree& tree) {
    ASSERT_GT(tree.sphere_count(), 0u);
    for (Index s = 0; s < tree.sphere_count(); ++s) {
        ASSERT_GE(tree.spheres[s].radius, 0.0);
        ASSERT_LT(tree.item_begin[s], tree.item_end[s]) << "every sphere has something beneath it";
        ASSERT_EQ(tree.level[s], tree.parent[s] == kNoIndex ? 0 : tree.level[tree.parent[s]] + 1);
        ASSERT_GE(s, tree.level_begin[tree.level[s]]);
        ASSERT_LT(s, tree.level_begin[tree.level[s] + 1u]);
        for (Index i = 0; i < tree.child_count[s]; ++i) ASSERT_EQ(tree.parent[tree.first_child[s] + i], s);
    }
}

TEST(AdoptedTree, OfABuilderIsWholeAndGrowsByNothing) {
    for (const Named& one : surfaces())
        for (const Builder builder : {Builder::Medial, Builder::Octree, Builder::Shell}) {
            SCOPED_TRACE(one.name + " " + std::string(builder_name(builder)));
            const SphereTree built = build_wrapped_tree(one.mesh, {builder, 8, 2}).value().tree;
            const AdoptedTree adopted = adopt_tree(bare(built), one.mesh);
            EXPECT_TRUE(adopted.coverage.is_whole()) << adopted.coverage.triangles << " triangles, " << adopted.coverage.farthest << ", inner "
                                                     << adopted.coverage.grown_inner << " by " << adopted.coverage.inner_growth;
            EXPECT_EQ(adopted.coverage.grown_leaves, 0u);
            EXPECT_EQ(adopted.coverage.uncovered, 0.0);
            EXPECT_EQ(adopted.coverage.unreachable, 0.0);
            expect_sound(adopted.tree);
            expect_reached(adopted.tree, one.mesh, 1);
        }
}

struct Damage {
    const char* name;
    std::function<void(SphereTree&, const TriMesh&)> apply;
};

const std::vector<Damage>& damages() {
    static const std::vector<Damage> kAll{
        {"a leaf is gone", [](SphereTree& tree, const TriMesh&) { tree.spheres.back().radius = -1.0; }},
        {"half of the leaves are gone",
         [](SphereTree& tree, const TriMesh&) {
             for (Index s = 1; s < tree.sphere_count(); s += 2)
                 if (tree.is_leaf(s)) tree.spheres[s].radius = -1.0;
         }},
        {"all are smaller", [](SphereTree& tree, const TriMesh&) { for (Sphere& s : tree.spheres) s.radius *= 0.8; }},
        {"inner ones are smaller",
         [](SphereTree& tree, const TriMesh&) {
             for (Index s = 0; s < tree.sphere_count(); ++s)
                 if (!tree.is_leaf(s)) tree.spheres[s].radius *= 0.6;
         }},
        {"all lie beside",
         [](SphereTree& tree, const TriMesh& mesh) {
             for (Sphere& s : tree.spheres) s.centre += 0.05 * mesh.bounds().longest_edge() * Vec3(1, 0.5, -0.3);
         }},
        {"points", [](SphereTree& tree, const TriMesh&) { for (Sphere& s : tree.spheres) s.radius = 0.0; }},
    };
    return kAll;
}

TEST(AdoptedTree, ThatWasDamagedHoldsAllOfTheSurfaceAndSaysWhatItLacked) {
    for (const Named& one : surfaces()) {
        const SphereTree built = bare(build_wrapped_tree(one.mesh, {Builder::Medial, 8, 2}).value().tree);
        for (const Damage& damage : damages()) {
            SCOPED_TRACE(one.name + ": " + damage.name);
            SphereTree damaged = built;
            damage.apply(damaged, one.mesh);
            const AdoptedTree adopted = adopt_tree(damaged, one.mesh);
            const Coverage& c = adopted.coverage;
            EXPECT_FALSE(c.is_whole());
            EXPECT_GT(c.grown_leaves + c.grown_inner, 0u);
            EXPECT_EQ(c.triangles > 0, c.uncovered > 0.0);
            EXPECT_EQ(c.triangles > 0, c.farthest > 0.0);
            EXPECT_LE(c.uncovered, 1.0 + 1e-9);
            EXPECT_GE(c.leaf_growth + 1e-12, c.farthest) << "what lay farthest outside is inside now";
            expect_sound(adopted.tree);
            expect_reached(adopted.tree, one.mesh, 2);
        }
    }
}

TEST(AdoptedTree, OfRandomSpheresHoldsAllOfTheSurface) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        SCOPED_TRACE("seed " + std::to_string(seed));
        Random random(seed);
        const TriMesh mesh = make_slab({random.uniform(0.01, 0.3), random.uniform(0.01, 0.3), random.uniform(0.01, 0.3)});
        SphereTree tree; // a root, some children, some of them with children of their own: leaves on two levels
        const auto add = [&](Index parent, std::uint8_t level) {
            const auto own = static_cast<Index>(tree.spheres.size());
            tree.spheres.push_back({Vec3(random.uniform(0, 0.3), random.uniform(0, 0.3), random.uniform(0, 0.3)), random.uniform(0.001, 0.2)});
            tree.parent.push_back(parent), tree.first_child.push_back(kNoIndex), tree.child_count.push_back(0), tree.level.push_back(level);
            if (parent != kNoIndex && tree.child_count[parent]++ == 0) tree.first_child[parent] = own;
        };
        add(kNoIndex, 0);
        tree.level_begin = {0, 1};
        const auto first = static_cast<Index>(1 + random.uniform(0, 7));
        for (Index k = 0; k < first; ++k) add(0, 1);
        tree.level_begin.push_back(static_cast<Index>(tree.spheres.size()));
        for (Index k = 1; k <= first; k += 2)
            for (int child = 0; child < 3; ++child) add(k, 2);
        tree.level_begin.push_back(static_cast<Index>(tree.spheres.size()));
        tree = bare(std::move(tree));
        const AdoptedTree adopted = adopt_tree(tree, mesh);
        expect_sound(adopted.tree);
        expect_reached(adopted.tree, mesh, seed);
        EXPECT_EQ(adopt_tree(tree, mesh).tree.items, adopted.tree.items) << "the same input, the same tree";
    }
}

} // namespace
} // namespace trocar::spheretree::adopt_test
