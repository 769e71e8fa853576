// Ten patients, each examined whole: one process generates one patient.
#include "assets/anatomy/anatomy.hpp"
#include "assets/anatomy/route.hpp"

#include "base/inside.hpp"
#include "base/self_intersection.hpp"
#include "base/topology.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trocar::anatomy {
namespace {

void expect_clean_surface(const TriMesh& mesh, std::size_t wanted, const char* what) {
    const SurfaceReport report = inspect_surface(mesh);
    EXPECT_TRUE(report.closed()) << what;
    EXPECT_TRUE(report.manifold()) << what;
    EXPECT_TRUE(report.oriented()) << what;
    EXPECT_TRUE(report.finite()) << what;
    EXPECT_EQ(report.components, 1u) << what;
    EXPECT_EQ(report.unreferenced_vertices, 0u) << what;
    EXPECT_GT(report.signed_volume, 0.0) << what;
    // A ball: no handles, so no two vessels have grown together.
    const long edges = static_cast<long>(unique_edges(mesh.triangles).size());
    EXPECT_EQ(static_cast<long>(mesh.vertices.size()) - edges + static_cast<long>(mesh.triangles.size()), 2) << what;
    EXPECT_EQ(find_self_intersections(mesh, 1, Crossing::Touching).count, 0u) << what;
    EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), static_cast<double>(wanted), 0.08 * static_cast<double>(wanted));
}

double least_angle(const TriMesh& mesh) {
    double least = 10.0;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 a = mesh.vertices[t[(k + 1) % 3]] - mesh.vertices[t[k]];
            const Vec3 b = mesh.vertices[t[(k + 2) % 3]] - mesh.vertices[t[k]];
            least = std::min(least, std::atan2(a.cross(b).norm(), a.dot(b)));
        }
    return least;
}

class Patient : public testing::TestWithParam<std::uint32_t> {
protected:
    void SetUp() override {
        recipe.seed = GetParam();
        auto generated = generate(recipe);
        ASSERT_TRUE(generated.ok()) << generated.error().to_string();
        anatomy = std::move(*generated);
    }
    Recipe recipe;
    Anatomy anatomy;

    void expect_murray() const;
    void expect_vessels_in_liver() const;
    void expect_reachable_tumour() const;
    void expect_landmarks() const;
};

void Patient::expect_murray() const {
    const auto& branches = anatomy.centreline.branches;
    for (Index b = 0; b < branches.size(); ++b) {
        if (!branches[b].intrahepatic && branches[b].name != "proper_hepatic") continue;
        double sum = 0.0;
        for (const Branch& child : branches)
            if (child.parent == b) sum += std::pow(child.radius, recipe.murray_exponent);
        EXPECT_GE(branches[b].radius, recipe.terminal_radius);
        if (sum == 0) continue; // an end
        EXPECT_NEAR(std::pow(sum, 1 / recipe.murray_exponent), branches[b].radius, 1e-9) << branches[b].name;
    }
}

void Patient::expect_vessels_in_liver() const {
    const InsideTest liver(anatomy.liver);
    const Centreline& line = anatomy.centreline;
    int inside = 0;
    double least = 1.0;
    for (Index i = 0; i < line.points.size(); ++i) {
        if (!line.branches[line.branch[i]].intrahepatic) continue;
        ++inside;
        ASSERT_TRUE(liver.inside(line.points[i])) << line.branches[line.branch[i]].name;
        least = std::min(least, -liver.signed_distance(line.points[i]) - line.branches[line.branch[i]].radius);
    }
    EXPECT_GT(inside, 500);
    EXPECT_GE(least, 0.003);
}

void Patient::expect_reachable_tumour() const {
    const auto route = find_route(anatomy, "tumour");
    const auto report = inspect_route(anatomy, "tumour");
    ASSERT_TRUE(route.ok() && report.ok());
    const InsideTest lumen(anatomy.lumen);
    for (std::size_t i = 0; i < route->points.size(); ++i) {
        EXPECT_LE(lumen.signed_distance(route->points[i]), -0.0014) << i;
    }
    EXPECT_GE(report->min_curvature_radius, 0.008);
    EXPECT_GT(report->length, 0.35);
    EXPECT_LT(report->length, 0.48);
}

void Patient::expect_landmarks() const {
    const Landmark *entry = find_landmark(anatomy, "femoral_entry"), *ostium = find_landmark(anatomy, "coeliac_ostium");
    ASSERT_TRUE(entry && ostium);
    EXPECT_GT(entry->direction[2], 0.3);
    EXPECT_GE((entry->position - anatomy.centreline.points[0]).norm(), 0.008);
    const double apart = (entry->position - ostium->position).norm();
    EXPECT_GT(apart, 0.21);
    EXPECT_LT(apart, 0.29);
    std::size_t ends = 0;
    const InsideTest lumen(anatomy.lumen);
    for (const Landmark& l : anatomy.landmarks) {
        EXPECT_TRUE(lumen.inside(l.position)) << l.name;
        EXPECT_NEAR(l.direction.norm(), 1.0, 1e-12) << l.name;
        ends += l.name.starts_with("segment_");
    }
    EXPECT_EQ(ends, recipe.terminals);
}

TEST_P(Patient, HasCleanSurfacesAndATumourThatACatheterCanReach) {
    expect_clean_surface(anatomy.liver, recipe.liver_triangles, "liver");
    expect_clean_surface(anatomy.lumen, recipe.lumen_triangles, "lumen");
    EXPECT_GT(least_angle(anatomy.liver), 0.35);
    EXPECT_GT(least_angle(anatomy.lumen), 0.35);
    expect_landmarks();
    expect_reachable_tumour();
    expect_vessels_in_liver();
    expect_murray();
}

#ifdef __SANITIZE_ADDRESS__ // some twenty times slower
INSTANTIATE_TEST_SUITE_P(Seeds, Patient, testing::Values(1u));
#else
INSTANTIATE_TEST_SUITE_P(Seeds, Patient, testing::Range(1u, 11u));
#endif

TEST(Anatomy, SameRecipeGivesTheSameBits) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "three patients take minutes under sanitizers; the plain builds compare them";
#endif
    Recipe recipe;
    recipe.terminals = 8;
    recipe.liver_triangles = 4000;
    recipe.lumen_triangles = 40000;
    const auto first = generate(recipe), second = generate(recipe);
    ASSERT_TRUE(first.ok() && second.ok());
    EXPECT_TRUE(first->lumen.vertices == second->lumen.vertices);
    EXPECT_TRUE(first->lumen.triangles == second->lumen.triangles);
    EXPECT_TRUE(first->liver.vertices == second->liver.vertices);
    EXPECT_TRUE(first->centreline.points == second->centreline.points);
    recipe.seed = 2;
    const auto other = generate(recipe);
    ASSERT_TRUE(other.ok());
    EXPECT_FALSE(first->liver.vertices == other->liver.vertices);
}

TEST(Anatomy, AnUnknownTargetIsAnErrorThatNamesTheKnownOnes) {
    Anatomy anatomy;
    anatomy.centreline.named = {{"femoral_entry", 0}, {"tumour", 0}};
    const auto route = find_route(anatomy, "spleen");
    ASSERT_FALSE(route.ok());
    EXPECT_NE(route.error().message.find("femoral_entry, tumour"), std::string::npos);
}

} // namespace
} // namespace trocar::anatomy
