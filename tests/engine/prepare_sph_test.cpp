// .sph files: what is written is read again, and damaged or hostile ones are refused with file and line.
#include "engine/prepare/sph.hpp"
#include "io_bytes.hpp"
#include "spheretree/build/wrapped_tree.hpp"

#include <random>

namespace trocar::engine::test {
namespace {

class SphFiles : public FolderTest {
protected:
    [[nodiscard]] Result<spheretree::SphereTree> read(const std::string& text) {
        const std::filesystem::path path = folder_ / "tree.sph";
        std::ofstream(path, std::ios::binary) << text;
        return read_sph(path);
    }
    void expect_refused(const std::string& text, const std::string& why) {
        const auto tree = read(text);
        ASSERT_FALSE(tree.ok()) << why;
        EXPECT_NE(tree.error().file.find("tree.sph"), std::string::npos) << why;
        EXPECT_FALSE(tree.error().message.empty()) << why;
    }
};

const std::string kGood = "2 3\n0 0 0 1 1\n0.5 0 0 0.5 1\n0 0 0 -1 1\n-0.5 0 0 0.5 0.25 7\n";

spheretree::SphereTree cube_tree() {
    TriMesh mesh;
    for (int k = 0; k < 8; ++k) mesh.vertices.emplace_back(k & 1, (k >> 1) & 1, k >> 2);
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                      {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return spheretree::build_wrapped_tree(mesh, {spheretree::Builder::Medial, 8, 2}).value().tree;
}

TEST_F(SphFiles, ATreeIsTheSameAfterWritingAndReading) {
    const spheretree::SphereTree tree = cube_tree();
    const std::filesystem::path path = folder_ / "cube.sph";
    ASSERT_TRUE(write_sph(path, tree, 1000.0).ok());
    const auto again = read_sph(path, 1e-3);
    ASSERT_TRUE(again.ok()) << again.error().to_string();
    ASSERT_EQ(again->sphere_count(), tree.sphere_count());
    EXPECT_EQ(again->level_begin, tree.level_begin);
    EXPECT_EQ(again->parent, tree.parent);
    EXPECT_EQ(again->first_child, tree.first_child);
    EXPECT_EQ(again->child_count, tree.child_count);
    for (std::size_t s = 0; s < tree.sphere_count(); ++s) {
        EXPECT_LT((again->spheres[s].centre - tree.spheres[s].centre).norm(), 1e-14);
        EXPECT_NEAR(again->spheres[s].radius, tree.spheres[s].radius, 1e-14);
    }
}

TEST_F(SphFiles, EmptyPlacesAndColumnsAfterTheRadiusArePassedOver) {
    const auto tree = read(kGood);
    ASSERT_TRUE(tree.ok()) << tree.error().to_string();
    EXPECT_EQ(tree->sphere_count(), 3u);
    EXPECT_EQ(tree->child_count[0], 2);
    EXPECT_EQ(tree->level_count(), 2u);
}

TEST_F(SphFiles, MalformedOnesAreRefusedWithTheFile) {
    EXPECT_FALSE(read_sph(folder_ / "none.sph").ok());
    expect_refused("", "empty");
    expect_refused("2", "no degree");
    expect_refused("two 3\n", "words");
    expect_refused("0 3\n", "no levels");
    expect_refused("2 0\n0 0 0 1\n", "no degree");
    expect_refused("-1 8\n0 0 0 1\n", "negative");
    expect_refused("9223372036854775807 9223372036854775807\n0 0 0 1 1\n", "more places than a number holds");
    expect_refused("60 8\n0 0 0 1 1\n", "more places than the file has lines");
    expect_refused("7 1000\n0 0 0 1 1\n", "the same");
    expect_refused("2 3\n0 0 0 1 1\n0.5 0 0 0.5 1\n", "truncated");
    expect_refused("1 8\nnan 0 0 1 1\n", "NaN");
    expect_refused("1 8\n0 inf 0 1 1\n", "infinite");
    expect_refused("1 8\n0 0 0 nan 1\n", "radius NaN");
    expect_refused("1 8\n0 0 x 1 1\n", "a letter");
    expect_refused("1 8\n0 0 0 -1 1\n", "no root");
    expect_refused("3 1\n0 0 0 1 1\n0 0 0 -1 1\n0 0 0 1 1\n", "a sphere beneath an empty place");
    expect_refused(std::string(64, '\0'), "zeros");
    expect_refused("\x7f"
                   "ELF\x02\x01\x01",
                   "a program");
}

TEST_F(SphFiles, CutOrChangedAnywhereAFileIsReadOrRefusedNeverMore) {
    std::mt19937 random(7); // seed 7
    for (std::size_t length = 0; length < kGood.size(); ++length) (void)read(kGood.substr(0, length));
    std::size_t refused = 0;
    for (int k = 0; k < 400; ++k) {
        std::string text = kGood;
        for (int change = 0; change < 3; ++change) text[random() % text.size()] = static_cast<char>(random() % 256);
        const auto tree = read(text);
        refused += !tree.ok();
        if (!tree.ok()) continue;
        for (Index s = 0; s < tree->sphere_count(); ++s) {
            ASSERT_TRUE(is_finite(tree->spheres[s].centre)) << "seed 7, " << k;
            ASSERT_GT(tree->spheres[s].radius, 0.0);
            if (s > 0) {
                ASSERT_LT(tree->parent[s], s);
            }
            if (tree->child_count[s] > 0) {
                ASSERT_LE(tree->first_child[s] + tree->child_count[s], tree->sphere_count());
            }
        }
    }
    EXPECT_GT(refused, 100u);
}

} // namespace
} // namespace trocar::engine::test
