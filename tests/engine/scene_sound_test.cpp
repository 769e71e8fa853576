// Sound scenes arrive in SI, with every name resolved and every default in place.
#include "engine/scene/nearest.hpp"
#include "engine/scene/recipe.hpp"
#include "scene_fixture.hpp"

#include <array>

namespace trocar::engine {
namespace {

Scene accepted(const std::string& text) {
    auto scene = parse_scene(text, "scenes/test.json");
    EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
    return scene.ok() ? *scene : Scene{};
}

TEST(Scenes, NumbersArriveInSi) {
    const Scene scene = accepted(kSoundScene);
    ASSERT_EQ(scene.bodies.size(), 2U);
    const SceneBody& organ = scene.bodies[0];
    EXPECT_EQ(organ.name, "organ");
    EXPECT_EQ(organ.kind, BodyKind::Deformable);
    EXPECT_DOUBLE_EQ(organ.material.young_modulus, 5000.0);
    EXPECT_DOUBLE_EQ(organ.material.density, 1060.0);
    EXPECT_DOUBLE_EQ(organ.surface.shape.radius, 0.050);
    EXPECT_DOUBLE_EQ(organ.fixed[0].region.fraction, 0.2);
    const SceneBody& vessel = scene.bodies[1];
    EXPECT_EQ(vessel.embedded_in, 0U);
    EXPECT_TRUE(vessel.hollow);
    EXPECT_DOUBLE_EQ(vessel.blend, 0.005);
    EXPECT_DOUBLE_EQ(vessel.surface.shape.axis.back().z(), 0.2);
    EXPECT_DOUBLE_EQ(vessel.surface.shape.axis_radii.back(), 0.004);
    const SceneInstrument& wire = scene.instruments[0];
    EXPECT_DOUBLE_EQ(wire.design.young_modulus, 6e7);
    EXPECT_DOUBLE_EQ(wire.design.radius, 4e-4);
    EXPECT_EQ(wire.lumen, 1U);
    EXPECT_DOUBLE_EQ(wire.entry.direction.norm(), 1.0);
    EXPECT_DOUBLE_EQ(wire.inserted, 0.020);
    EXPECT_DOUBLE_EQ(wire.path[1].insertion, 0.050);
    EXPECT_DOUBLE_EQ(scene.targets[0].place.position.z(), 0.150);
    EXPECT_EQ(scene.time.step_count(), 100U);
}

TEST(Scenes, ATubesRingsAreAboutAsFarApartAsItsSidesAreWide) {
    const ShapeSpec shape = accepted(kSoundScene).bodies[1].surface.shape;
    const double side = 6.283185307179586 * 0.004 / shape.sides;
    ASSERT_GT(shape.axis.size(), 100U);
    ASSERT_EQ(shape.axis.size(), shape.axis_radii.size());
    for (std::size_t i = 1; i < shape.axis.size(); ++i) {
        const double gap = (shape.axis[i] - shape.axis[i - 1]).norm();
        EXPECT_LE(gap, side * 1.0001);
        EXPECT_GT(gap, side * 0.5);
    }
}

TEST(Scenes, DefaultsAreThoseOfTheStructs) {
    const Scene scene = accepted(kSoundScene);
    const fem::RodDesign rod{};
    EXPECT_DOUBLE_EQ(scene.instruments[0].design.tip_angle, rod.tip_angle);
    EXPECT_DOUBLE_EQ(scene.instruments[0].design.transverse_drag, rod.transverse_drag);
    EXPECT_DOUBLE_EQ(scene.instruments[0].limits.speed, 0.035);
    EXPECT_DOUBLE_EQ(scene.bodies[0].material.poisson_ratio, fem::Material{}.poisson_ratio);
    EXPECT_DOUBLE_EQ(scene.contact.rod_stiffness, ContactSpec{}.rod_stiffness);
    EXPECT_EQ(scene.bodies[0].coarse.surface_triangles, CoarseSpec{}.surface_triangles);
    EXPECT_EQ(scene.budget.limits.mode, BudgetMode::Exact);
    EXPECT_EQ(scene.outputs.width, 1280U);
    EXPECT_EQ(scene.name, "test");
    EXPECT_EQ(scene.time.substeps, 0U);
}

TEST(Scenes, DegreesAndMinutesAreConverted) {
    std::string text = spoil("\"pressure\": \"kPa\"", "\"pressure\": \"kPa\", \"angle\": \"deg\", \"time\": \"ms\"");
    text.replace(text.find("\"step\": 0.01, \"duration\": 1"), 27, "\"step\": 10, \"duration\": 1000");
    text.replace(text.find("[1, 50, 1]"), 10, "[1000, 50, 90]");
    const Scene scene = accepted(text);
    EXPECT_NEAR(scene.instruments[0].path[1].rotation, 1.5707963267948966, 1e-15);
    EXPECT_DOUBLE_EQ(scene.instruments[0].path[1].time, 1.0);
    EXPECT_DOUBLE_EQ(scene.time.step, 0.010);
}

TEST(Scenes, EffectsAsAListOrByNameAreTheSame) {
    const Scene list = accepted(kSoundScene);
    const Scene object = accepted(spoil("[\"elasticity\", \"damping\", \"coarse_contact\", \"exact_contact\"]",
                                        "{\"elasticity\": true, \"damping\": true, \"gravity\": false, "
                                        "\"coarse_contact\": true, \"exact_contact\": true}"));
    EXPECT_EQ(list.effects.names(), object.effects.names());
    EXPECT_EQ(list.effects.names(), (std::vector<std::string>{"elasticity", "damping", "coarse_contact", "exact_contact"}));
}

TEST(Scenes, WithoutEffectsTheUsualOnesAreOn) {
    std::string text = kSoundScene;
    text.replace(text.find("\"effects\":"), std::string::npos, "\"gravity\": [0, 0, -9810]}");
    const Scene scene = accepted(text);
    EXPECT_TRUE(scene.effects.gravity && scene.effects.elasticity && scene.effects.coarse_contact);
    EXPECT_FALSE(scene.effects.breathing.has_value());
    EXPECT_DOUBLE_EQ(scene.gravity.z(), -9.81);
}

/// The sound scene's wire as a catheter, and what runs in its bore.
std::string with_wire(const std::string& wire) {
    return spoil("\"path\": [[0, 20, 0], [1, 50, 1]]\n        }", "\"inserted\": 20}, " + wire);
}

TEST(Scenes, AWireRunsInTheBoreOfAnInstrumentBeforeIt) {
    const Result<Scene> scene =
        parse_scene(with_wire("\"core\": {\"inside\": \"wire\", \"length\": 400, \"radius\": 0.2, \"inserted\": 10}"), "scenes/test.json");
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    ASSERT_EQ(scene->instruments.size(), 2u);
    EXPECT_EQ(scene->instruments[1].inside, 0u);
    EXPECT_EQ(scene->instruments[1].lumen, scene->instruments[0].lumen);
    EXPECT_EQ(scene->instruments[1].entry.position, scene->instruments[0].entry.position);
    const auto refused = [](const std::string& wire) { return refusal(with_wire(wire)); };
    EXPECT_TRUE(says(refused(R"("core": {"inside": "wier", "length": 400, "radius": 0.2})"), "nearest known"));
    EXPECT_TRUE(says(refused(R"("core": {"inside": "wire", "length": 400, "radius": 0.4})"), "expected a thinner wire"));
    EXPECT_TRUE(says(refused(R"("core": {"inside": "wire", "lumen": "vessel", "length": 400, "radius": 0.2})"), "left out"));
    EXPECT_TRUE(says(refused(R"("core": {"inside": "wire", "kind": "mass_spring", "length": 400, "radius": 0.2})"), "the kind \"rod\""));
    EXPECT_TRUE(says(refused(R"("core": {"inside": "wire", "length": 400, "radius": 0.2},
                                "third": {"inside": "wire", "length": 400, "radius": 0.2})"),
                     "core runs inside wire already"));
    EXPECT_TRUE(says(refused(R"("core": {"inside": "wire", "length": 400, "radius": 0.2},
                                "third": {"inside": "core", "length": 400, "radius": 0.1})"),
                     "core runs inside wire itself"));
}

TEST(Scenes, TwistIsOffUnlessNamedButForPigtails) {
    const auto torsion = [](const std::string& piece, const std::string& other) {
        const Result<Scene> scene = parse_scene(spoil(piece, other), "scenes/test.json");
        EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
        return scene.ok() && scene->instruments.front().design.torsion;
    };
    EXPECT_FALSE(torsion("\"radius\": 0.4", "\"radius\": 0.4"));
    EXPECT_TRUE(torsion("\"effects\": [", "\"effects\": [\"twist\", "));
    EXPECT_TRUE(torsion("\"radius\": 0.4", "\"radius\": 0.4, \"tip\": {\"shape\": \"pigtail\"}"));
}

TEST(Scenes, BreathingHasDefaultsOrItsOwnNumbers) {
    EXPECT_DOUBLE_EQ(accepted(spoil("\"damping\"", "\"breathing\"")).effects.breathing->amplitude, BreathingSpec{}.amplitude);
    const Scene scene = accepted(spoil("[\"elasticity\", \"damping\", \"coarse_contact\", \"exact_contact\"]",
                                       "{\"breathing\": {\"amplitude\": 8, \"direction\": [0, 0, -3]}}"));
    EXPECT_DOUBLE_EQ(scene.effects.breathing->amplitude, 0.008);
    EXPECT_EQ(scene.effects.breathing->direction, Vec3(0, 0, -1));
    EXPECT_FALSE(scene.effects.elasticity);
}

TEST(Scenes, APictureCountIsSpreadOverTheRun) {
    const Scene scene = accepted(spoil("\"effects\": [", "\"outputs\": {\"pictures\": 2}, \"effects\": [\"fluoroscopy\", "));
    ASSERT_EQ(scene.outputs.pictures.size(), 4U);
    EXPECT_DOUBLE_EQ(scene.outputs.pictures[0].time, 0.5);
    EXPECT_EQ(scene.outputs.pictures[3].view, PictureView::Fluoroscopy);
    EXPECT_DOUBLE_EQ(scene.outputs.pictures[3].time, 1.0);
}

TEST(Scenes, UnusualNumbersAreQuestionedNotRefused) {
    EXPECT_TRUE(accepted(kSoundScene).questions.empty());
    const Scene scene = accepted(spoil("1060", "4000, \"poisson_ratio\": 0.499"));
    ASSERT_EQ(scene.questions.size(), 2U);
    EXPECT_NE(scene.questions[0].find("bodies.organ.material.density: 4000 kg/m^3 is unusual"), std::string::npos) << scene.questions[0];
    EXPECT_NE(scene.questions[1].find("steps shrink"), std::string::npos) << scene.questions[1];
}

TEST(Scenes, LaterErrorsFindTheirLine) {
    const Scene scene = accepted(kSoundScene);
    const Error error = scene_error(scene, "bodies.organ.surface.shape", "open surface");
    EXPECT_EQ(error.line, 7U);
    EXPECT_TRUE(says(error, "scenes/test.json:7:"));
    EXPECT_TRUE(says(error, "bodies.organ.surface.shape: open surface"));
    EXPECT_EQ(scene_error(scene, "bodies.organ.surface.nothing[3]", "x").line, 7U);
}

TEST(Scenes, ACsvPathIsReadInTheScenesUnits) {
    const SceneFolder folder;
    (void)folder.write("hand.csv", "t,insertion,rotation\n0,20,0\n2,80,1\n");
    const auto file = folder.write("scene.json", spoil("[[0, 20, 0], [1, 50, 1]]", "\"hand.csv\""));
    auto scene = read_scene(file);
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    ASSERT_EQ(scene->instruments[0].path.size(), 2U);
    EXPECT_DOUBLE_EQ(scene->instruments[0].path[1].insertion, 0.080);
    const auto fast = read_instrument_paths(*scene, folder.write("fast.csv", "0,0,0\n1,80,0\n"));
    ASSERT_FALSE(fast.ok());
    EXPECT_TRUE(says(fast.error(), "fast.csv:2:3: "));
    EXPECT_TRUE(says(fast.error(), "row 2"));
    EXPECT_TRUE(says(fast.error(), "80 mm/s"));
}

/// The sound scene's wire and one in its bore, both moved by one file.
std::string moved_by_one_file(const std::string& core) {
    return spoil("\"path\": [[0, 20, 0], [1, 50, 1]]\n        }",
                 "\"path\": \"hand.csv\"}, \"core\": {\"inside\": \"wire\", \"length\": 400, \"radius\": 0.2, " + core + "}");
}

TEST(Scenes, OneCsvMovesTwoInstruments) {
    const SceneFolder folder;
    (void)folder.write("hand.csv", "t,wire.insertion,core.insertion,wire.rotation,core.rotation\n0,20,25,0,0\n2,80,95,1,-1\n");
    auto scene = read_scene(folder.write("scene.json", moved_by_one_file("\"path\": \"hand.csv\"")));
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_DOUBLE_EQ(scene->instruments[0].path[1].insertion, 0.080);
    EXPECT_DOUBLE_EQ(scene->instruments[1].path[1].insertion, 0.095);
    EXPECT_DOUBLE_EQ(scene->instruments[1].path[1].rotation, -1.0);
    EXPECT_DOUBLE_EQ(scene->instruments[1].inserted, 0.025);
    // Instead of the scene's: those that are named.
    ASSERT_TRUE(read_instrument_paths(*scene, folder.write("core.csv", "t,core.insertion,core.rotation\n0,30,0\n")).ok());
    EXPECT_DOUBLE_EQ(scene->instruments[0].path[1].insertion, 0.080);
    ASSERT_EQ(scene->instruments[1].path.size(), 1u);
    EXPECT_DOUBLE_EQ(scene->instruments[1].path[0].insertion, 0.030);
    const auto unknown = read_instrument_paths(*scene, folder.write("x.csv", "t,wier.insertion,wier.rotation\n0,30,0\n"));
    ASSERT_FALSE(unknown.ok());
    EXPECT_TRUE(says(unknown.error(), "x.csv:1:3: "));
    EXPECT_TRUE(says(unknown.error(), "nearest known instrument: \"wire\""));
    const auto fast = read_instrument_paths(
        *scene, folder.write("fast.csv", "t,wire.insertion,wire.rotation,core.insertion,core.rotation\n0,20,0,20,0\n1,30,0,90,0\n"));
    ASSERT_FALSE(fast.ok());
    EXPECT_TRUE(says(fast.error(), "fast.csv:3:8: ")) << fast.error().to_string();
    EXPECT_TRUE(says(fast.error(), "instruments.core.path"));
}

TEST(Scenes, UnusedColumnsOfACsvAreAMistake) {
    const SceneFolder folder;
    (void)folder.write("hand.csv", "t,wire.insertion,wire.rotation,cor.insertion,cor.rotation\n0,20,0,25,0\n");
    const auto nobody = read_scene(folder.write("a.json", moved_by_one_file("\"inserted\": 25")));
    ASSERT_FALSE(nobody.ok());
    EXPECT_TRUE(says(nobody.error(), "hand.csv:1:32: ")) << nobody.error().to_string();
    EXPECT_TRUE(says(nobody.error(), "nearest known instrument: \"core\""));
    (void)folder.write("hand.csv", "t,wire.insertion,wire.rotation,core.insertion,core.rotation\n0,20,0,25,0\n");
    const auto unused = read_scene(folder.write("b.json", moved_by_one_file("\"inserted\": 25")));
    ASSERT_FALSE(unused.ok());
    EXPECT_TRUE(says(unused.error(), "hand.csv:1:32: ")) << unused.error().to_string();
    EXPECT_TRUE(says(unused.error(), "the same \"path\" in that instrument"));
    (void)folder.write("hand.csv", "t,core.insertion,core.rotation\n0,25,0\n");
    const auto missing = read_scene(folder.write("c.json", moved_by_one_file("\"path\": \"hand.csv\"")));
    ASSERT_FALSE(missing.ok());
    EXPECT_TRUE(says(missing.error(), "holds no column wire.insertion")) << missing.error().to_string();
}

TEST(Scenes, APigtailOfTooFewNodesIsRefusedWhereItIsWritten) {
    const std::string text = spoil("\"path\": [[0, 20, 0], [1, 50, 1]]",
                                   "\"path\": [[0, 20, 0], [1, 50, 1]], \"segment\": 8, \"tip\": {\"shape\": \"pigtail\", \"length\": 40, "
                                   "\"angle\": 6}");
    const Error error = refusal(text);
    EXPECT_GT(error.line, 0u);
    EXPECT_GT(error.column, 0u);
    EXPECT_TRUE(says(error, "instruments.wire.segment")) << error.to_string();
    EXPECT_TRUE(says(error, "a segment of 5.33")) << error.to_string();
    EXPECT_TRUE(says(error, " mm"));
}

TEST(Scenes, AMistakeInARecipeIsShownInTheRecipe) {
    const SceneFolder folder;
    (void)folder.write("patient.json", "{\"units\": {\"length\": \"mm\"},\n \"terminls\": 3}");
    const auto file =
        folder.write("scene.json", spoil("{\"shape\": \"sphere\", \"radius\": 50}", "{\"recipe\": \"patient.json\", \"part\": \"liver\"}"));
    const auto scene = read_scene(file);
    ASSERT_FALSE(scene.ok());
    EXPECT_TRUE(says(scene.error(), "patient.json:2:2: terminls: unknown key"));
    EXPECT_TRUE(says(scene.error(), "nearest known key: \"terminals\""));
}

TEST(Recipes, LengthsAreConvertedAndRangesChecked) {
    const auto recipe = parse_recipe("{\"units\": {\"length\": \"cm\"}, \"liver_width\": 21, \"seed\": 7}", "r.json");
    ASSERT_TRUE(recipe.ok()) << recipe.error().to_string();
    EXPECT_DOUBLE_EQ(recipe->liver_width, 0.21);
    EXPECT_EQ(recipe->seed, 7U);
    EXPECT_EQ(recipe->terminals, anatomy::Recipe{}.terminals);
    const auto wrong = parse_recipe("{\"units\": {\"length\": \"cm\"}, \"liver_width\": 210}", "r.json");
    ASSERT_FALSE(wrong.ok());
    EXPECT_TRUE(says(wrong.error(), "was it meant in mm? then expected 21"));
    EXPECT_FALSE(parse_recipe("{\"seed\": 1}", "r.json").ok());
    EXPECT_FALSE(parse_recipe("{\"units\": {\"length\": \"cm\"}, \"seed\": 1.5}", "r.json").ok());
}

TEST(Budgets, AreReadAndWritten) {
    const std::array<std::pair<const char*, double>, 6> times = {
        {{"8ms", 8e-3}, {"250us", 250e-6}, {"0.1ms", 1e-4}, {"1 s", 1.0}, {"0ms", 0.0}, {"100ns", 1e-7}}};
    for (const auto& [text, seconds] : times) {
        const auto budget = parse_budget(text);
        ASSERT_TRUE(budget.ok()) << text;
        EXPECT_EQ(budget->limits.mode, BudgetMode::Wall);
        EXPECT_NEAR(budget->limits.wall_s, seconds, 1e-18) << text;
    }
    EXPECT_EQ(parse_budget("work:20000")->limits.work_units, 20000U);
    EXPECT_EQ(parse_budget("exact")->limits.mode, BudgetMode::Exact);
    for (const char* text : {"8ms", "250us", "work:20000", "exact", "0ms"}) EXPECT_EQ(parse_budget(text)->to_string(), text);
}

TEST(Budgets, NonsenseIsRefused) {
    for (const char* text : {"",
                             "8",
                             "-1ms",
                             "-0.5us",
                             "nan ms",
                             "infms",
                             "1e400ms",
                             "1e9s",
                             "7200s",
                             "ms",
                             "8 mm",
                             "8msx",
                             "work:",
                             "work:-5",
                             "work:1.5",
                             "work:99999999999999999999999",
                             "work:9999999999999999",
                             "Exact",
                             "work: 5",
                             "0x10ms",
                             "+5ms"}) {
        const auto budget = parse_budget(text);
        ASSERT_FALSE(budget.ok()) << text;
        EXPECT_NE(budget.error().message.find("expected "), std::string::npos);
    }
}

TEST(NearestNames, SwapsCountOnce) {
    EXPECT_EQ(edit_distance("tiem", "time"), 1U);
    EXPECT_EQ(edit_distance("Density", "density"), 0U);
    EXPECT_EQ(edit_distance("", "abc"), 3U);
    EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
    constexpr std::array<std::string_view, 3> names = {"radius", "density", "length"};
    EXPECT_EQ(find_nearest("lenght", names), "length");
    EXPECT_EQ(find_nearest("x", {}), "");
}

} // namespace
} // namespace trocar::engine
