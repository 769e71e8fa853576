// Bodies with sphere trees from files: the same contacts as with trees of their own, nothing missed whatever the file lacks, and that said.
#include "base/closest_point.hpp"
#include "engine/experiments/cost_run.hpp"
#include "engine/io/write_mesh.hpp"
#include "engine/prepare/sph.hpp"
#include "engine/step/model_hash.hpp"
#include "engine/step/solid/solid_trees.hpp"
#include "io_bytes.hpp"
#include "spheretree/build/wrapped_tree.hpp"
#include "step_fixture.hpp"

#include <gmock/gmock.h>

#include <functional>
#include <random>
#include <set>

namespace trocar::engine::test::foreign_spheres {
namespace {

using ::testing::HasSubstr;

struct Shape {
    std::string surface; // as a scene says it
    std::string kind = "deformable";
};

/// The surface of the body of that name as preparation makes it, m.
TriMesh surface_of(const PreparedScene& prepared, const std::string& body) {
    for (const BodyModel& model : prepared.model.bodies)
        if (model.name == body) return model.surface;
    return {};
}

class ForeignSpheres : public FolderTest {
protected:
    /// A piece that falls, or is driven, onto another one. spheres: files for "piece" and "table", or nothing.
    [[nodiscard]] std::string scene(const Shape& piece, const Shape& table, const std::string& of_piece, const std::string& of_table,
                                    const std::string& more = "") const {
        const auto body = [&](const Shape& shape, const std::string& file) {
            std::string text = fmt::format(R"({{"kind": "{}", "surface": {})", shape.kind, shape.surface);
            if (shape.kind == "deformable")
                text += R"(, "material": {"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.005, "mass_damping": 1},
                    "coarse": {"mesher": "lattice", "surface_triangles": 120})";
            if (shape.kind == "kinematic") text += R"(, "motion": [[0, 0, 0, 0], [0.2, 4, 3, 12]])";
            if (!file.empty()) text += fmt::format(R"(, "spheres": "{}")", (folder_ / file).string());
            return text + "}";
        };
        return fmt::format(R"({{"name": "foreign", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 1}},
            "gravity": [0, 0, -9810], "budget": "exact", "bodies": {{"piece": {}, "table": {}}}, "cost": {{"patch": 12, "tolerance": 0.3}},
            "effects": ["elasticity", "gravity", "damping", "coarse_contact"]{}}})",
                           body(piece, of_piece), body(table, of_table), more);
    }

    /// Writes the tree that `prepare` would write of a body, in the scene's mm.
    void write_tree(const std::string& file, const TriMesh& surface, const std::function<void(spheretree::SphereTree&)>& damage = {}) const {
        auto built = spheretree::build_wrapped_tree(surface, {spheretree::Builder::Medial, 8, 2});
        ASSERT_TRUE(built.ok()) << built.error().to_string();
        if (damage) damage(built->tree);
        ASSERT_TRUE(write_sph(folder_ / file, built->tree, 1e3).ok());
    }

    [[nodiscard]] std::string refusal_of(const std::string& text) const {
        const Result<Scene> scene = parse_scene(text, "scenes/foreign.json");
        if (!scene.ok()) return scene.error().to_string();
        const Result<PreparedScene> prepared = make_prepared_scene(*scene);
        return prepared.ok() ? std::string() : prepared.error().to_string();
    }
};

const Shape kBox{R"({"shape": "box", "centre": [3, 5, 21.5], "extent": [50, 40, 40], "cells": 4})"};
const Shape kTorus{R"({"shape": "torus", "centre": [0, 0, 9], "radius": 30, "tube_radius": 8, "sides": 12})"};
const Shape kBar{R"({"shape": "tube", "axis": [[-30, 2, 7, 6], [0, 0, 8, 7], [30, -3, 7, 6]], "sides": 12})"};
const Shape kTable{R"({"shape": "box", "centre": [0, 0, -5], "extent": [120, 120, 10], "cells": 8})", "static"};
const Shape kMoving{R"({"shape": "box", "centre": [0, 0, -5], "extent": [120, 120, 10], "cells": 8})", "kinematic"};

/// Vertices that touch, with what they touch: body, vertex, other body.
using Touches = std::set<std::tuple<Thing, Index, Thing>>;

Touches touches_of(const Simulator& simulator) {
    Touches touches;
    for (const Contact& contact : simulator.contacts())
        if (contact.origin == ContactOrigin::Proximity && contact.gap <= 0.0) touches.emplace(contact.a, contact.feature_a[0], contact.b);
    return touches;
}

/// Vertices of a body that no sphere above one of their triangles holds on every level from root to leaf.
std::size_t count_escaped(const SceneModel& model, std::size_t body, std::span<const Vec3> surface, SolidScratch& solids) {
    const spheretree::SphereTree& tree = model.bodies[body].covering.tree;
    std::vector<std::uint8_t> held(surface.size(), 0);
    for (Index s = 0; s < tree.sphere_count(); ++s) {
        if (!tree.is_leaf(s)) continue;
        for (const Index t : tree.items_of(s))
            for (const Index v : model.bodies[body].surface.triangles[t]) {
                bool all = true;
                for (Index up = s; up != kNoIndex; up = tree.parent[up]) {
                    const spheretree::Sphere& sphere = sphere_of(body, up, solids);
                    all = all && (surface[v] - sphere.centre).norm() <= sphere.radius * (1.0 + 1e-9);
                }
                if (all) held[v] = 1;
            }
    }
    return static_cast<std::size_t>(std::count(held.begin(), held.end(), 0));
}

/// Both bodies' trees hold their surfaces over each step, and every patch that an independent search finds near lies beneath a pair of leaves
/// that the descent reports.
void expect_nothing_missed(const PreparedScene& prepared, const CostSpec& cost) {
    ASSERT_EQ(prepared.model.bodies.size(), 2u);
    Simulator simulator(prepared.model);
    for (int k = 0; k < 40; ++k) {
        std::vector<Vec3> before[2];
        for (std::size_t i = 0; i < 2; ++i) before[i] = simulator.state().bodies[i].surface;
        ASSERT_TRUE(simulator.step().finite);
        SolidScratch& solids = ScratchView::of(simulator).solids;
        for (std::size_t i = 0; i < 2; ++i) {
            if (!before[i].empty()) ASSERT_EQ(count_escaped(prepared.model, i, before[i], solids), 0u) << "body " << i << ", step " << k;
            const std::vector<Vec3>& now = simulator.state().bodies[i].surface;
            if (!now.empty()) ASSERT_EQ(count_escaped(prepared.model, i, now, solids), 0u) << "body " << i << ", step " << k;
        }
    }
    CostOptions options;
    options.budgets = {{"exact", {}}};
    options.steps = 40;
    const auto table = measure_cost(prepared, cost, options);
    ASSERT_TRUE(table.ok()) << table.error().to_string();
    EXPECT_GT(table->near_patches, 0u) << "something was near";
    EXPECT_EQ(table->near_uncovered, 0u) << "of what is near all lies beneath leaf pairs";
}

TEST_F(ForeignSpheres, ThatPrepareWroteGiveTheSameContactsAsTreesOfTheScenesOwn) {
    for (const Shape& piece : {kBox, kTorus, kBar})
        for (const Shape& table : {kTable, kMoving}) {
            SCOPED_TRACE(piece.surface + " on " + table.kind);
            const PreparedScene own = prepare(scene(piece, table, "", ""));
            write_tree("piece.sph", surface_of(own, "piece"));
            write_tree("table.sph", surface_of(own, "table"));
            const PreparedScene foreign = prepare(scene(piece, table, "piece.sph", "table.sph"));
            ASSERT_EQ(foreign.model.bodies.size(), 2u);
            EXPECT_TRUE(foreign.notices.empty()) << foreign.notices.front();
            EXPECT_TRUE(foreign.model.bodies[0].wrapped) << "it follows the coarse nodes";
            EXPECT_NE(hash_model(own.model), hash_model(foreign.model));
            Simulator a(own.model), b(foreign.model);
            std::size_t touching = 0;
            for (int k = 0; k < 60; ++k) {
                State from = a.state();
                ASSERT_TRUE(a.step().finite);
                from.solids.touching.clear(); // leaves of another tree
                ASSERT_TRUE(b.restore(from).ok());
                ASSERT_TRUE(b.step().finite);
                const Touches by_own = touches_of(a), by_file = touches_of(b);
                EXPECT_TRUE(std::includes(by_file.begin(), by_file.end(), by_own.begin(), by_own.end())) << "step " << k;
                touching += by_own.size();
            }
            EXPECT_GT(touching, 0u);
            expect_nothing_missed(foreign, {.patch = 0.012, .tolerance = 0.3e-3});
        }
}

/// Ways in which a file may lack surface.
const std::vector<std::pair<std::string, std::function<void(spheretree::SphereTree&)>>> kDamages{
    {"a leaf is gone", [](spheretree::SphereTree& tree) { tree.spheres.back().radius = -1.0; }},
    {"smaller", [](spheretree::SphereTree& tree) { for (spheretree::Sphere& s : tree.spheres) s.radius *= 0.75; }},
    {"shifted", [](spheretree::SphereTree& tree) { for (spheretree::Sphere& s : tree.spheres) s.centre += Vec3(0.002, -0.001, 0.003); }},
    {"most of the leaves are gone",
     [](spheretree::SphereTree& tree) {
         for (Index s = 1; s < tree.sphere_count(); ++s)
             if (tree.is_leaf(s) && s % 5 != 0) tree.spheres[s].radius = -1.0;
     }},
};

TEST_F(ForeignSpheres, ThatLackSurfaceMissNothingAndSayWhatTheyLacked) {
    const PreparedScene own = prepare(scene(kBox, kTable, "", ""));
    for (const auto& [name, damage] : kDamages)
        for (const bool of_piece : {true, false}) {
            SCOPED_TRACE(name + (of_piece ? ", deformable" : ", static"));
            write_tree("damaged.sph", surface_of(own, of_piece ? "piece" : "table"), damage);
            const PreparedScene foreign = prepare(scene(kBox, kTable, of_piece ? "damaged.sph" : "", of_piece ? "" : "damaged.sph"));
            ASSERT_EQ(foreign.notices.size(), 1u);
            EXPECT_THAT(foreign.notices.front(), HasSubstr(of_piece ? "bodies.piece: sphere tree from damaged.sph" : "bodies.table: sphere tree"));
            EXPECT_THAT(foreign.notices.front(), HasSubstr("lay outside its leaves, by up to"));
            EXPECT_THAT(foreign.bodies[of_piece ? 0 : 1].notes.back(), HasSubstr("leaves grew to hold it"));
            expect_nothing_missed(foreign, {.patch = 0.012, .tolerance = 0.3e-3});
        }
}

/// Carried trees beside fitted ones where nothing holds any body: neither is seen from the other's motion.
TEST_F(ForeignSpheres, BesideABodyWithATreeOfItsOwnMissNothingWhereAllIsFree) {
    Shape lower = kTorus;
    lower.surface = R"({"shape": "box", "centre": [0, 0, -22], "extent": [60, 60, 40], "cells": 4})";
    const std::string free_fall = scene(kBox, lower, "", "");
    write_tree("piece.sph", surface_of(prepare(free_fall), "piece"));
    for (const char* gravity : {"[0, 0, 0]", "[0, 0, -9810]"}) {
        std::string text = scene(kBox, lower, "piece.sph", "");
        text.replace(text.find("[0, 0, -9810]"), 13, gravity);
        const PreparedScene foreign = prepare(text);
        Simulator simulator(foreign.model);
        State state = simulator.state();
        for (Vec3& v : state.bodies[0].tissue.velocity) v = Vec3(0.02, 0.01, -0.3); // m/s, towards the other one
        for (Vec3& v : state.bodies[1].tissue.velocity) v = Vec3(0.0, -0.02, 0.2);
        ASSERT_TRUE(simulator.restore(state).ok());
        std::size_t near = 0;
        for (int k = 0; k < 40; ++k) {
            ASSERT_TRUE(simulator.step().finite);
            const std::vector<Vec3>&a = simulator.state().bodies[0].surface, &b = simulator.state().bodies[1].surface;
            const spheretree::SphereTree &one = foreign.model.bodies[0].covering.tree, &two = foreign.model.bodies[1].covering.tree;
            std::set<std::pair<Index, Index>> beneath; // triangles beneath pairs of leaves that were reported
            for (const Contact& c : simulator.sphere_contacts())
                for (const Index i : one.items_of(c.feature_a[0]))
                    for (const Index j : two.items_of(c.feature_b[0])) beneath.emplace(i, j);
            for (Index i = 0; i < foreign.model.bodies[0].surface.triangles.size(); ++i)
                for (Index j = 0; j < foreign.model.bodies[1].surface.triangles.size(); ++j) {
                    const Triangle &s = foreign.model.bodies[0].surface.triangles[i], &t = foreign.model.bodies[1].surface.triangles[j];
                    bool close = false;
                    for (const Index v : s)
                        close = close || closest_on_triangle(a[v], b[t[0]], b[t[1]], b[t[2]]).distance_sq < 0.3e-3 * 0.3e-3;
                    if (!close) continue;
                    ++near;
                    ASSERT_TRUE(beneath.contains({i, j})) << "step " << k << ", triangles " << i << " and " << j;
                }
        }
        EXPECT_GT(near, 0u);
    }
}

TEST_F(ForeignSpheres, FollowTheBodysScaleAndTranslationAndTheUnitOfItsFile) {
    const PreparedScene own = prepare(scene(kBox, kTable, "", ""));
    TriMesh surface = surface_of(own, "piece");
    write_tree("piece.sph", surface); // mm
    for (Vec3& v : surface.vertices) v *= 1e3;
    ASSERT_TRUE(write_obj(folder_ / "piece.obj", surface).ok()); // mm
    const Shape file{fmt::format(R"({{"file": "{}", "unit": "mm"}}, "scale": 1.5, "translate": [1, 2, 12])", (folder_ / "piece.obj").string())};
    const PreparedScene foreign = prepare(scene(file, kTable, "piece.sph", ""));
    ASSERT_EQ(foreign.model.bodies.size(), 2u);
    EXPECT_TRUE(foreign.notices.empty()) << foreign.notices.front();
    EXPECT_THAT(foreign.bodies[0].notes.back(), HasSubstr("which hold all of the surface"));
}

TEST_F(ForeignSpheres, OfAnotherSizeOrPlaceAreRefusedWithFileLineAndWhatIsExpected) {
    const TriMesh surface = surface_of(prepare(scene(kBox, kTable, "", "")), "piece");
    const auto built = spheretree::build_wrapped_tree(surface, {spheretree::Builder::Medial, 8, 2});
    ASSERT_TRUE(built.ok());
    const auto refused = [&](double unit, const Vec3& shift, const std::string& why) {
        spheretree::SphereTree tree = built->tree;
        for (spheretree::Sphere& s : tree.spheres) s.centre += shift;
        ASSERT_TRUE(write_sph(folder_ / "other.sph", tree, unit).ok());
        const std::string refusal = refusal_of(scene(kBox, kTable, "other.sph", ""));
        EXPECT_THAT(refusal, HasSubstr("other.sph:2")) << refusal;
        EXPECT_THAT(refusal, HasSubstr("bodies.piece.spheres")) << refusal;
        EXPECT_THAT(refusal, HasSubstr(why)) << refusal;
    };
    refused(1.0, Vec3::Zero(), "expected a tree of about its size, in the unit of the surface's file"); // metres where mm are expected
    refused(1e6, Vec3::Zero(), "expected a tree of about its size");
    refused(1e3, Vec3(0.2, 0, 0), "expected a tree of the same shape at the same place");
}

TEST_F(ForeignSpheres, DamagedOnesAreRefusedWithTheirFileAndLine) {
    const std::string good = "2 3\n3 5 21.5 45 1\n3 5 21.5 40 1\n0 0 0 -1 1\n0 0 0 -1 1\n";
    const auto refused = [&](const std::string& text, const std::string& piece) {
        std::ofstream(folder_ / "bad.sph", std::ios::binary) << text;
        const std::string refusal = refusal_of(scene(kBox, kTable, "bad.sph", ""));
        EXPECT_THAT(refusal, HasSubstr("bad.sph")) << refusal;
        EXPECT_THAT(refusal, HasSubstr(piece)) << text << "\n" << refusal;
        EXPECT_THAT(refusal, HasSubstr("bodies.piece.spheres")) << refusal;
    };
    std::ofstream(folder_ / "good.sph", std::ios::binary) << good;
    EXPECT_EQ(refusal_of(scene(kBox, kTable, "good.sph", "")), "");
    refused("", "bad.sph:1");
    refused("2 3\n3 5 21.5 45 1\n3 5 x 40 1\n0 0 0 -1 1\n0 0 0 -1 1\n", "bad.sph:3");
    refused("2 3\n3 5 21.5 45 1\n3 5 21.5 nan 1\n0 0 0 -1 1\n0 0 0 -1 1\n", "bad.sph:3");
    refused("2 3\n3 5 21.5 45 1\n3 5 21.5 1e300 1\n0 0 0 -1 1\n0 0 0 -1 1\n", "expected at most 1e+30 m");
    refused("9 64\n3 5 21.5 45 1\n", "do not fit into this file");
    refused("2 3\n3 5 21.5 45 1\n", "bad.sph");
    refused("2 3\n0 0 0 -1 1\n0 0 0 -1 1\n0 0 0 -1 1\n0 0 0 -1 1\n", "no root");
    EXPECT_THAT(refusal_of(scene(kBox, kTable, "none.sph", "")), HasSubstr("none.sph"));
}

TEST_F(ForeignSpheres, OfAHollowBodyAreRefusedWithASentence) {
    std::ofstream(folder_ / "any.sph") << "1 1\n0 0 0 1 1\n";
    const Shape hollow{R"({"shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 120, 4]], "sides": 16}, "hollow": true)", "static"};
    const std::string refusal = refusal_of(scene(kBox, hollow, "", "any.sph"));
    EXPECT_THAT(refusal, HasSubstr("bodies.table.spheres"));
    EXPECT_THAT(refusal, HasSubstr("a hollow body, whose spheres are those inscribed in its lumen; expected this left out"));
}

} // namespace
} // namespace trocar::engine::test::foreign_spheres
