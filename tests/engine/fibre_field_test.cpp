// Fibres that lie round a vessel's centreline, or as a file says: against their directions by hand, and what is refused.
#include "engine/io/write_mesh.hpp"
#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/forces.hpp"
#include "step_fixture.hpp"
#include "tests/temp_folder.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

namespace trocar::engine {
namespace {

using namespace test;
using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;

/// A vessel of hgo with a wall of its own.
std::string vessel(const std::string& rows, const std::string& material, int triangles = 900) {
    return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa", "angle": "deg"}}, "time": {{"step": 0.005, "duration": 1}}, "bodies": {{"artery":
        {{"kind": "deformable", "hollow": true, "surface": {{"shape": "vessels", "triangles": 6000, "branches": [{}]}}, "material": {{{}}},
        "coarse": {{"mesher": "wall", "thickness": 0.6, "layers": 1, "surface_triangles": {}}},
        "fixed": [{{"direction": [0, 0, -1], "fraction": 0.06}}]}}}}, "effects": ["elasticity", "damping"]}})",
                       rows, material, triangles);
}

/// Calls see(centre, first, second) for every tetrahedron, or for all that share their fibres.
template <class See>
void for_each_group(const fem::TissueModel& tissue, See&& see) {
    const fem::ForcePlan& plan = tissue.plan;
    ASSERT_FALSE(plan.fibres.empty());
    const std::size_t group = plan.patched() ? fem::kPatch : 1;
    for (std::size_t first = 0; first < plan.batches.size(); first += group)
        for (std::size_t lane = 0; lane < fem::kBatch; ++lane) {
            if (!(plan.batches[first].volume[lane] > 0.0)) continue;
            Vec3 centre = Vec3::Zero();
            for (std::size_t b = first; b < first + group; ++b)
                for (const Index node : tissue.tet_nodes[plan.tet_of[b * fem::kBatch + lane]])
                    centre += 0.25 * (plan.patched() ? plan.shares[b].share[lane] : 1.0) * tissue.rest_position[node];
            const fem::FibreAxes axes = fem::fibres_at(tissue, first, lane);
            see(centre, Vec3(axes.axis[0], axes.axis[1], axes.axis[2]), Vec3(axes.axis[3], axes.axis[4], axes.axis[5]));
        }
}

std::string error_of(const std::string& text) {
    Result<Scene> scene = parse_scene(text, "scenes/fibres.json");
    if (!scene.ok()) return scene.error().to_string();
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    return prepared.ok() ? std::string() : prepared.error().to_string();
}

class FibreField : public trocar::FolderTest {
protected:
    /// A bar whose cells have directions, under another scale.
    std::string bar(const std::vector<double>& first, const std::string& keys, const std::string& law = R"("law": "hgo", "k1": 50, "k2": 2)", std::size_t components = 3) {
        const TetMesh mesh = fem::make_bar_mesh({4, 3, 3}, 10.0, 0.1);
        const DataArray cells[] = {{"fibres", components, first}};
        EXPECT_TRUE(write_vtu(folder / "bar.vtu", mesh, {{}, cells}).ok());
        return fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 1}}, "bodies": {{"bar": {{"kind": "deformable",
            "surface": {{"shape": "box", "centre": [20, 15, 15], "extent": [40, 30, 30], "cells": 3}}, "material": {{{}}}, "coarse": {{"file": "{}"{}}}}}}}, "effects": ["elasticity"]}})",
                           law, (folder / "bar.vtu").string(), keys);
    }
    static std::size_t cells() { return fem::make_bar_mesh({4, 3, 3}, 10.0, 0.1).tets.size(); }
};

} // namespace

TEST_F(FibreField, WindsRoundTheCentrelineAtTheSaidAngleInStraightAndBentVessels) {
    constexpr double kRadius = 4.0;
    for (const double bend : {0.0, 25.0}) {
        const std::string rows = bend > 0.0 ? "[" + bent_axis(bend, kRadius) + "]" : "[[0, 0, 0, 4], [0, 0, 50, 4]]";
        for (const double angle : {0.0, 30.0, 80.0}) {
            const PreparedScene prepared = prepare(vessel(rows, fmt::format(R"("law": "hgo", "k1": 20, "fibre_course": "centreline", "fibre_angle": {})", angle)));
            double worst = 0.0, sum = 0.0;
            std::size_t count = 0;
            for_each_group(*prepared.model.bodies[0].tissue, [&](const Vec3& at, const Vec3& first, const Vec3& second) {
                // The axis: up, a quarter circle towards x, and on along x.
                const Vec3 mm = 1e3 * at;
                Vec3 tangent = Vec3::UnitZ(), point(0, 0, mm.z());
                if (bend > 0.0 && mm.z() > 50.0) {
                    const Vec3 from = mm - Vec3(bend, 0, 50), flat(from.x(), 0, from.z());
                    tangent = mm.x() > bend ? Vec3(Vec3::UnitX()) : Vec3(flat.z(), 0, -flat.x()).normalized();
                    point = mm.x() > bend ? Vec3(mm.x(), 0, 50 + bend) : Vec3(bend, 0, 50) + bend * flat.normalized();
                }
                const double top = bend > 0.0 ? 120.0 : 50.0;
                if (mm.z() < 6.0 || (bend == 0.0 && mm.z() > top - 6.0) || mm.x() > 75.0) return; // caps
                const Vec3 out = (mm - point).normalized(), around = tangent.cross(out).normalized();
                for (const Vec3& fibre : {first, second}) {
                    const double off = std::abs(std::atan2(std::abs(fibre.dot(tangent)), std::abs(fibre.dot(around))) - angle * kDegree) + std::abs(std::asin(fibre.dot(out)));
                    worst = std::max(worst, off), sum += off, ++count;
                }
                if (angle == 30.0) {
                    EXPECT_NEAR(std::abs(first.dot(second)), std::cos(60.0 * kDegree), 0.05);
                }
            });
            std::printf("bend %.0f mm, %.0f degrees: %.2f degrees off in the mean, %.2f at most, %zu fibres\n", bend, angle, sum / static_cast<double>(count) / kDegree, worst / kDegree, count);
            EXPECT_GT(count, 300u);
            EXPECT_LT(sum / static_cast<double>(count), 3.0 * kDegree);
            EXPECT_LT(worst, 15.0 * kDegree);
        }
    }
}

TEST_F(FibreField, LeadsAwayFromTheCentrelineWhereItIsRadial) {
    const PreparedScene prepared = prepare(vessel("[[0, 0, 0, 4], [0, 0, 50, 4]]", R"("law": "hgo", "k1": 20, "fibre_course": "radial")"));
    for_each_group(*prepared.model.bodies[0].tissue, [&](const Vec3& at, const Vec3& first, const Vec3& second) {
        if (1e3 * at.z() < 6.0 || 1e3 * at.z() > 44.0) return;
        EXPECT_GT(std::abs(first.dot(Vec3(at.x(), at.y(), 0).normalized())), 0.97);
        EXPECT_NEAR(std::abs(first.dot(second)), 1.0, 1e-9);
    });
}

TEST_F(FibreField, OfAnArteryWindsRoundItsVesselUnlessAnotherCourseIsSaid) {
    const std::string rows = "[" + bent_axis(25.0, 4.0) + "]";
    const auto course = [&](const std::string& material) { return parse_scene(vessel(rows, material), "scenes/fibres.json")->bodies[0].fibre_course; };
    EXPECT_EQ(course(R"("preset": "artery_media")"), FibreCourse::Centreline);
    EXPECT_EQ(course(R"("preset": "artery_media", "law": "hgo", "fibre_axis": [0, 0, 1])"), FibreCourse::Given);
    EXPECT_EQ(course(R"("preset": "artery_media", "law": "hgo", "fibre_course": "given")"), FibreCourse::Given);
    EXPECT_EQ(course(R"("law": "hgo", "k1": 20)"), FibreCourse::Given);
    const Result<Scene> scene = parse_scene(vessel(rows, R"("preset": "artery_media")"), "scenes/fibres.json");
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    EXPECT_THAT(prepared->bodies[0].fibres, HasSubstr("round the lumen's centreline, 29 degrees"));
}

TEST_F(FibreField, OfAFileIsThatOfEachCellWhateverItsLength) {
    std::vector<double> directions;
    for (std::size_t t = 0; t < cells(); ++t) { // of a patch all alike, so that its mean is each one's
        const double sign = t % 3 == 0 ? -1.0 : 1.0, length = 0.5 + static_cast<double>(t % 7);
        directions.insert(directions.end(), {sign * length * 0.6, 0.0, sign * length * 0.8});
    }
    for (const char* elements : {"linear", "patched"}) {
        const PreparedScene prepared = prepare(bar(directions, R"(, "fibre2_array": "fibres")", fmt::format(R"("law": "hgo", "k1": 50, "k2": 2, "elements": "{}")", elements)));
        for_each_group(*prepared.model.bodies[0].tissue, [&](const Vec3&, const Vec3& first, const Vec3& second) {
            EXPECT_NEAR(std::abs(first.dot(Vec3(0.6, 0.0, 0.8))), 1.0, 1e-12);
            EXPECT_NEAR(std::abs(second.dot(first)), 1.0, 1e-12);
        });
        // The same forces as of one direction for all.
        const PreparedScene given = prepare(bar(directions, "", fmt::format(R"("law": "hgo", "k1": 50, "k2": 2, "fibre1": [3, 0, 4], "fibre2": [3, 0, 4], "elements": "{}")", elements)));
        const fem::TissueModel &a = *prepared.model.bodies[0].tissue, &b = *given.model.bodies[0].tissue;
        std::vector<Vec3> bent = a.rest_position;
        Random random(3);
        for (Vec3& x : bent) x = Vec3(1.1 * x.x(), x.y(), 1.2 * x.z()) + 1e-3 * random.direction();
        EXPECT_NEAR(fem::measure_tets(a, bent).elastic_energy / fem::measure_tets(b, bent).elastic_energy, 1.0, 1e-12);
    }
    // Other directions in other cells are felt where they are.
    for (std::size_t t = 0; t < cells(); ++t)
        for (std::size_t i = 0; i < 3; ++i) directions[3 * t + i] = i == t % 3 ? 2.0 : 0.0;
    const PreparedScene prepared = prepare(bar(directions, R"(, "fibre1_array": "fibres")", R"("law": "hgo", "k1": 50, "elements": "linear")"));
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    for (std::size_t place = 0; place < tissue.plan.tet_of.size(); ++place) {
        const fem::FibreAxes axes = fem::fibres_at(tissue, place / fem::kBatch, place % fem::kBatch);
        EXPECT_EQ(std::abs(axes.axis[tissue.plan.tet_of[place] % 3]), 1.0);
    }
}

TEST_F(FibreField, IsRefusedByNameWhereItSaysNothing) {
    std::vector<double> directions(3 * cells(), 1.0), numbers(cells(), 1.0);
    EXPECT_THAT(error_of(bar(directions, R"(, "fibre1_array": "fibre")")), HasSubstr("nearest known cell array of three numbers: \"fibres\""));
    EXPECT_THAT(error_of(bar(numbers, R"(, "fibre1_array": "fibres")", R"("law": "hgo")", 1)), HasSubstr("no cell array of bar.vtu has three numbers a cell"));
    EXPECT_THAT(error_of(bar(directions, R"(, "fibre1_array": "fibres")", R"("young_modulus": 5)")), HasSubstr("expected \"law\": \"hgo\""));
    directions[3 * 5] = directions[3 * 5 + 1] = directions[3 * 5 + 2] = 0.0;
    EXPECT_THAT(error_of(bar(directions, R"(, "fibre1_array": "fibres")")), HasSubstr("has (0, 0, 0) at cell 5; expected a direction"));
    EXPECT_THAT(error_of(bar(directions, "", R"("law": "hgo", "fibre_course": "centreline")")), HasSubstr("expected \"hollow\": true"));
    EXPECT_THAT(error_of(vessel("[[0, 0, 0, 4], [0, 0, 50, 4]]", R"("law": "hgo", "fibre_course": "centreline", "fibre_axis": [0, 0, 1])")), HasSubstr("unused key: fibres lie by fibre_course"));
    EXPECT_THAT(error_of(vessel("[[0, 0, 0, 4], [0, 0, 50, 4]]", R"("law": "ogden", "fibre_course": "centreline")")), HasSubstr("fibre_course"));
    const std::string pipe = "[[0, 0, 0, 4], [0, 0, 50, 4]]";
    EXPECT_THAT(error_of(vessel(pipe, R"("law": "hgo", "fibre_course": "radial", "fibre_angle": 20)")), HasSubstr("unused key: fibres lie by fibre_course \"radial\""));
    EXPECT_THAT(error_of(vessel(pipe, R"("preset": "artery_media", "fibre_course": "radial")")), HasSubstr("is not named here"));
    std::fill(directions.begin(), directions.end(), 1.0);
    EXPECT_THAT(error_of(bar(directions, R"(, "fibre1_array": "fibres")", R"("law": "hgo", "fibre1": [0, 1, 0])")), HasSubstr("unused key: fibres lie by fibre1_array"));
    const TetMesh mesh = fem::make_bar_mesh({4, 3, 3}, 10.0, 0.1);
    const std::string text = bar(directions, R"(, "fibre1_array": "fibres")");
    const DataArray twice[] = {{"fibres", 3, directions}, {"fibres", 3, directions}};
    ASSERT_TRUE(write_vtu(folder / "bar.vtu", mesh, {{}, twice}).ok());
    EXPECT_THAT(error_of(text), HasSubstr(fmt::format("has {} values; expected {}", 6 * cells(), 3 * cells())));
}

TEST_F(FibreField, OfASacIsDoubtedAndHowFibresLieIsTold) {
    const auto told = [](const std::string& text) {
        const Result<Scene> scene = parse_scene(text, "scenes/fibres.json");
        const Result<PreparedScene> prepared = make_prepared_scene(*scene);
        std::string words = prepared->bodies[0].fibres;
        for (const std::string& note : prepared->bodies[0].notes) words += "; " + note;
        return words;
    };
    std::string sac = vessel("[[0, 0, 0, 4], [0, 0, 50, 4]]", R"("preset": "artery_media")");
    const std::string branches = R"({"shape": "vessels", "triangles": 6000, "branches": [[[0, 0, 0, 4], [0, 0, 50, 4]]]})";
    ASSERT_NE(sac.find(branches), std::string::npos);
    sac.replace(sac.find(branches), branches.size(), R"({"shape": "sphere", "radius": 10, "subdivisions": 3})");
    EXPECT_THAT(told(sac), HasSubstr("which chance lays in a sac"));
    const std::string pipe = "[[0, 0, 0, 4], [0, 0, 50, 4]]";
    EXPECT_THAT(told(vessel(pipe, R"("preset": "artery_media")")), ::testing::Not(HasSubstr("chance")));
    EXPECT_THAT(told(vessel(pipe, R"("law": "hgo", "fibre1": [0, 3, 4])")), HasSubstr("along (0, 0.6, 0.8) and (1, 0, 0)"));
    EXPECT_THAT(told(vessel(pipe, R"("preset": "artery_media", "law": "hgo", "fibre_point": [1, 0, 0])")), HasSubstr("round the line through (1, 0, 0) mm along (0, 0, 1), 29 degrees"));
}

} // namespace trocar::engine
