// Devices of the catalogue, and instruments made of tubes, layers, curves and coatings.
#include "engine/scene/device.hpp"

#include "engine/scene/section.hpp"
#include "fem/rod/rod_model.hpp"
#include "fem/rod/tip_arcs.hpp"
#include "step_fixture.hpp"
#include "tests/temp_folder.hpp"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <cmath>
#include <fstream>
#include <random>

namespace trocar::engine {
namespace {

/// A tube of 3 mm with a bend, in mm, MPa and degrees, and one or two instruments.
std::string scene_with(const std::string& instruments, const std::string& effects = R"("coarse_contact", "exact_contact", "friction")") {
    return fmt::format(R"({{
    "name": "devices", "units": {{"length": "mm", "pressure": "MPa", "angle": "deg"}}, "time": {{"step": 0.01, "duration": 3}}, "budget": "exact",
    "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [{}], "sides": 20}}}}}},
    "instruments": {{{}}}, "effects": [{}]
}})",
                       test::bent_axis(25.0, 3.0), instruments, effects);
}

constexpr const char* kPlace = R"("lumen": "tube", "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]}, "path": [[0, 20, 0], [3, 110, 90]])";

std::string instrument(const std::string& keys, const std::string& name = "catheter") { return fmt::format("\"{}\": {{{}, {}}}", name, keys, kPlace); }

Scene accepted(const std::string& text) {
    auto scene = parse_scene(text, "scenes/test.json");
    EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
    return scene.ok() ? *scene : Scene{};
}

std::string refused(const std::string& text) {
    const auto scene = parse_scene(text, "scenes/test.json");
    EXPECT_FALSE(scene.ok()) << text;
    return scene.ok() ? std::string() : scene.error().to_string();
}

std::uint64_t hash_after(const std::string& text, int steps) {
    const PreparedScene prepared = test::prepare(text);
    Simulator simulator(prepared.model);
    for (int k = 0; k < steps; ++k) EXPECT_TRUE(simulator.step().finite);
    return hash_state(simulator.state());
}

TEST(Devices, OfTheCatalogueAreReadWithoutAQuestionAndNameTheirSource) {
    ASSERT_GE(device_texts().size(), 12u);
    for (const DeviceText& text : device_texts()) {
        const Result<Device> device = parse_device(text.text, text.file);
        ASSERT_TRUE(device.ok()) << device.error().to_string();
        EXPECT_TRUE(device->questions.empty()) << text.file << ": " << device->questions.front();
        EXPECT_GT(device->source.size(), 40u) << text.file;
        EXPECT_FALSE(device->about.empty()) << text.file;
        Scene scene = accepted(scene_with(instrument(fmt::format("\"device\": \"{}\"", text.name()))));
        ASSERT_EQ(scene.instruments.size(), 1u);
        EXPECT_TRUE(fem::make_rod_model(solid_section(scene.instruments[0])).ok()) << text.file;
    }
}

TEST(Devices, StayInATubeThatTheyArePushedThrough) {
    for (const char* name : {"cobra_2", "judkins_left_4", "simmons_2", "pigtail", "guide_6f", "hydrophilic_angled", "lunderquist_extra_stiff"}) {
        const PreparedScene prepared = test::prepare(scene_with(instrument(fmt::format("\"device\": \"{}\", \"skin_triangles\": 2000", name))));
        Simulator simulator(prepared.model);
        const test::Tally tally = test::run_steps(simulator, 300);
        std::cout << name << ": " << tally << '\n';
        EXPECT_EQ(tally.steps, 300u) << name << tally;
        EXPECT_EQ(tally.lumen_exits, 0u) << name << tally;
    }
}

TEST(Devices, AreTheSameAsTheirKeysWrittenOut) {
    const std::string keys = R"("length": 1000, "radius": 0.835, "inner_radius": 0.55, "young_modulus": 500, "density": 1150, "friction": 0.1,
        "segment": 2.5, "skin_triangles": 2000, "tip": {"shape": "curve", "arcs": [[30, -35, 0], [45, 140, 0], [20, -25, 0], [8, 0, 0]]})";
    EXPECT_EQ(hash_after(scene_with(instrument(R"("device": "cobra_2", "skin_triangles": 2000)")), 40), hash_after(scene_with(instrument(keys)), 40));
}

TEST(Devices, KeysOfTheSceneReplaceTheirs) {
    const SceneInstrument plain = accepted(scene_with(instrument(R"("device": "guide_6f")"))).instruments[0];
    EXPECT_EQ(plain.device, "guide_6f");
    EXPECT_EQ(plain.layers.size(), 3u);
    EXPECT_EQ(plain.design.stiffness.size(), 4u);
    const SceneInstrument changed =
        accepted(scene_with(instrument(R"("device": "guide_6f", "young_modulus": 100, "density": 1100, "friction": 0.3, "tip": {"shape": "J", "stiffness": 0.5})"))).instruments[0];
    EXPECT_TRUE(changed.layers.empty()) << "one material takes their place";
    EXPECT_TRUE(changed.design.stiffness.empty()) << "the tip's stiffness takes the place of rows";
    EXPECT_DOUBLE_EQ(changed.friction, 0.3);
    EXPECT_DOUBLE_EQ(changed.design.length, 1.0);
    EXPECT_NEAR(solid_section(changed).young_modulus, 100e6 * (1.0 - std::pow(0.86, 4)), 1.0);
    EXPECT_NEAR(solid_section(changed).stretch_factor, 1.0 / (1.0 + 0.86 * 0.86), 1e-12);
    const SceneInstrument longer = accepted(scene_with(instrument(R"("device": "pigtail", "length": 800, "tip": {"angle": 300})"))).instruments[0];
    EXPECT_EQ(longer.design.tip, fem::TipShape::Pigtail);
    EXPECT_NEAR(longer.design.tip_length, 0.045, 1e-12) << "the device's, not the default";
    EXPECT_NEAR(longer.design.tip_angle, 300.0 * std::numbers::pi / 180.0, 1e-12);
}

TEST(Devices, TakeTheKeysOfATipThatTheirOwnShapeUsesAndNoOthers) {
    const struct {
        const char *device, *tip, *key, *expected;
    } unused[] = {
        {"guide_6f", R"("length": 20)", "length", "J or simmons or pigtail"},
        {"guide_6f", R"("angle": 30)", "angle", "J or simmons or pigtail"},
        {"guide_6f", R"("stiffness": 0.5)", "stiffness", "J or simmons or pigtail or curve"},
        {"guide_6f", R"("arcs": [[30, -35, 0]])", "arcs", "curve"},
        {"pigtail", R"("points": [[0, 0, 0], [0, 0, 5], [0, 5, 9]])", "points", "curve"},
        {"cobra_2", R"("length": 20)", "length", "J or simmons or pigtail"},
        {"cobra_2", R"("angle": 30)", "angle", "J or simmons or pigtail"},
    };
    for (const auto& one : unused) {
        const std::string message = refused(scene_with(instrument(fmt::format(R"("device": "{}", "tip": {{{}}})", one.device, one.tip))));
        const std::string unused_key = fmt::format("tip.{0}: unused key \"{0}\": the tip of the device {1} has the shape", one.key, one.device);
        EXPECT_NE(message.find(unused_key), std::string::npos) << message;
        EXPECT_NE(message.find(fmt::format("used where it is {}; expected it left out, or shape named", one.expected)), std::string::npos) << message;
    }
    const auto design = [](const char* keys) { return accepted(scene_with(instrument(keys))).instruments[0].design; };
    const fem::RodDesign arcs = design(R"("device": "cobra_2", "tip": {"arcs": [[30, -35, 0]]})");
    EXPECT_EQ(arcs.tip, fem::TipShape::Curve);
    EXPECT_EQ(arcs.arcs.size(), 1u);
    EXPECT_NEAR(arcs.tip_length, 0.03, 1e-12);
    EXPECT_DOUBLE_EQ(design(R"("device": "cobra_2", "tip": {"stiffness": 0.5})").tip_stiffness, 0.5);
    EXPECT_DOUBLE_EQ(design(R"("device": "guide_6f", "tip": {"shape": "J", "length": 20})").tip_length, 0.02);
}

TEST(Devices, OfFilesHaveUnitsOfTheirOwn) {
    const TempFolder folder;
    std::ofstream(folder.path() / "mine.json") << R"({"units": {"length": "cm", "pressure": "GPa"}, "about": "mine", "source": "measured at home",
        "length": 40, "radius": 0.05, "young_modulus": 0.2, "tip": {"shape": "J", "length": 1.5, "angle": 0.5}})";
    const std::string text = scene_with(instrument(R"("device": "mine.json")"));
    const auto scene = parse_scene(text, folder.path() / "scene.json");
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_DOUBLE_EQ(scene->instruments[0].design.length, 0.4);
    EXPECT_DOUBLE_EQ(scene->instruments[0].design.young_modulus, 2e8);
    EXPECT_DOUBLE_EQ(scene->instruments[0].design.tip_angle, 0.5) << "radians there, degrees in the scene";
    std::ofstream(folder.path() / "bad.json") << "{\"units\": {\"length\": \"cm\"}, \"about\": \"mine\", \"source\": \"x\",\n \"length\": 40, \"radius\": 0.05, \"entry\": {}}";
    const auto bad = parse_scene(scene_with(instrument(R"("device": "bad.json")")), folder.path() / "scene.json");
    ASSERT_FALSE(bad.ok());
    EXPECT_NE(bad.error().to_string().find("bad.json:2:"), std::string::npos) << bad.error().to_string();
    EXPECT_NE(bad.error().to_string().find("entry"), std::string::npos) << bad.error().to_string();
}

TEST(Devices, ThatAreNoneAreRefusedWithWhatWasExpected) {
    const std::string tube = R"("length": 300, "radius": 1, )";
    const struct {
        std::string keys, expected;
    } cases[] = {
        {R"("device": "cobra_3")", "nearest known device: \"cobra_2\""},
        {R"("device": "nowhere.json")", "nowhere.json"},
        {R"("radius": 0.5)", "the key \"length\" is missing; expected a number in mm, or a device"},
        {tube + R"("inner_radius": 1)", "found 1 mm; expected less than the radius, 1 mm"},
        {tube + R"("layers": [[0.5, 100, 1000], [0.9, 100, 1000]])", "found a last outer radius of 0.9 mm; expected the instrument's radius, 1 mm"},
        {tube + R"("inner_radius": 0.6, "layers": [[0.5, 100, 1000], [1, 100, 1000]])", "found an outer radius of 0.5 mm around one of 0.6 mm"},
        {tube + R"("density": 1000, "layers": [[1, 100, 1000]])", "found beside layers"},
        {tube + R"("tip": {"shape": "curve"})", "expected \"arcs\" or \"points\""},
        {tube + R"("tip": {"shape": "J", "arcs": [[10, 30, 0]]})", "arcs"},
        {tube + R"("tip": {"shape": "curve", "arcs": [[10, 30, 0]], "points": [[0, 0, 0], [0, 0, 1], [0, 1, 2]]})", "found beside arcs"},
        {tube + R"("tip": {"shape": "curve", "points": [[0, 0, 0], [0, 0, 1], [0, 0, 1]]})", "found the point before it again"},
        {tube + R"("tip": {"shape": "curve", "arcs": [[310, 30, 0]]})", "expected at most the instrument's length"},
        {tube + R"("segment": 5, "tip": {"shape": "curve", "arcs": [[10, 180, 0]]})", "the tip's curve turns by"},
        {tube + R"("kind": "mass_spring", "tip": {"shape": "curve", "arcs": [[40, 90, 0]]})", "a pigtail or a curve twists"},
        {tube + R"("coating": [[10, 1], [5, 1]])", "expected lengths from the tip that ascend"},
    };
    for (const auto& one : cases) {
        const std::string message = refused(scene_with(instrument(one.keys)));
        EXPECT_NE(message.find(one.expected), std::string::npos) << one.keys << "\n" << message;
    }
}

TEST(Curves, OfPointsLeadThroughThem) {
    std::mt19937_64 random(21);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    double worst = 0.0;
    for (int k = 0; k < 30; ++k) {
        const std::vector<fem::TipArc> arcs{{0.01 + 0.02 * share(random), 2.0 * share(random) - 1.0, 0.0}, {0.03, 3.0 * share(random) - 1.5, 6.0 * share(random) - 3.0}, {0.02 * share(random) + 0.005, share(random), 0.0}};
        const std::vector<Vec3> points = fem::draw_arcs(arcs, 24);
        std::string rows;
        for (const Vec3& p : points) rows += fmt::format("{}[{:.9f}, {:.9f}, {:.9f}]", rows.empty() ? "" : ", ", 7.0 + 1e3 * p.y(), 1e3 * p.z() - 3.0, 1e3 * p.x());
        const Scene scene = accepted(scene_with(instrument(fmt::format(R"("device": "cobra_2", "tip": {{"shape": "curve", "points": [{}]}})", rows))));
        ASSERT_EQ(scene.instruments.size(), 1u);
        const std::vector<Vec3> line = fem::draw_arcs(scene.instruments[0].design.arcs, 24);
        Eigen::Matrix3Xd told(3, 25), drawn(3, 25);
        for (int i = 0; i < 25; ++i) told.col(i) = points[static_cast<std::size_t>(i)], drawn.col(i) = line[static_cast<std::size_t>(i)];
        const Eigen::Matrix4d onto = Eigen::umeyama(drawn, told, false);
        const Eigen::Matrix3Xd moved = (onto.topLeftCorner<3, 3>() * drawn).colwise() + onto.topRightCorner<3, 1>();
        worst = std::max(worst, (moved - told).colwise().norm().maxCoeff() / scene.instruments[0].design.tip_length);
    }
    std::printf("margin: the curve passes the points by %.2e of its length\n", worst);
    EXPECT_LT(worst, 5e-3) << "seed 21";
}

TEST(Tubes, OfEqualLayersAreTubesOfOneMaterial) {
    const fem::RodDesign one = solid_section(accepted(scene_with(instrument(R"("length": 300, "radius": 1, "inner_radius": 0.5, "young_modulus": 200, "density": 1200)"))).instruments[0]);
    const fem::RodDesign layered =
        solid_section(accepted(scene_with(instrument(R"("length": 300, "radius": 1, "inner_radius": 0.5, "layers": [[0.6, 200, 1200], [0.8, 200, 1200], [1, 200, 1200]])"))).instruments[0]);
    EXPECT_NEAR(one.young_modulus, 200e6 * (1.0 - std::pow(0.5, 4)), 1e-3) << "E pi / 4 (R^4 - r^4)";
    EXPECT_NEAR(one.density, 1200.0 * 0.75, 1e-9);
    EXPECT_NEAR(one.stretch_factor * one.young_modulus, 200e6 * 0.75, 1e-3) << "E pi (R^2 - r^2)";
    EXPECT_NEAR(one.turn_factor, 1.25, 1e-12) << "(R^2 + r^2) / R^2";
    EXPECT_NEAR(layered.young_modulus, one.young_modulus, 1e-6 * one.young_modulus);
    EXPECT_NEAR(layered.density, one.density, 1e-9 * one.density);
    EXPECT_NEAR(layered.stretch_factor, one.stretch_factor, 1e-12);
    EXPECT_NEAR(layered.turn_factor, one.turn_factor, 1e-12);
}

TEST(Tubes, OfDifferentLayersAddUpRingByRing) {
    const fem::RodDesign design =
        solid_section(accepted(scene_with(instrument(R"("length": 300, "radius": 1, "inner_radius": 0.5, "layers": [[0.8, 1000, 2000], [1, 100, 1000]])"))).instruments[0]);
    const auto ring = [](double from, double to, int power) { return std::pow(to, power) - std::pow(from, power); };
    const double bend = 1e9 * ring(0.5, 0.8, 4) + 1e8 * ring(0.8, 1.0, 4), stretch = 1e9 * ring(0.5, 0.8, 2) + 1e8 * ring(0.8, 1.0, 2);
    const double mass = 2000.0 * ring(0.5, 0.8, 2) + 1000.0 * ring(0.8, 1.0, 2), turn = 2000.0 * ring(0.5, 0.8, 4) + 1000.0 * ring(0.8, 1.0, 4);
    EXPECT_NEAR(design.young_modulus, bend, 1e-9 * bend);
    EXPECT_NEAR(design.stretch_factor * design.young_modulus, stretch, 1e-9 * stretch);
    EXPECT_NEAR(design.density, mass, 1e-9 * mass);
    EXPECT_NEAR(design.turn_factor * design.density, turn, 1e-9 * turn);
}

TEST(Tubes, TakeNoWireThatIsAsWideAsTheirBore) {
    const std::string wire = R"("wire": {"inside": "catheter", "length": 400, "radius": 0.5, "young_modulus": 100, "tip": {"shape": "straight"}, "inserted": 20})";
    EXPECT_NE(refused(scene_with(instrument(R"("length": 300, "radius": 0.8, "inner_radius": 0.45)") + ", " + wire)).find("catheter's bore is 0.45 mm; expected a thinner wire"),
              std::string::npos);
    accepted(scene_with(instrument(R"("length": 300, "radius": 0.8, "inner_radius": 0.55)") + ", " + wire));
}

TEST(Coatings, OfOneFactorAreThatMuchLessFriction) {
    const auto keys = [](const char* friction) { return fmt::format(R"("length": 200, "radius": 0.5, "young_modulus": 60, "skin_triangles": 1500, "tip": {{"shape": "J", "length": 12, "angle": 40}}, {})", friction); };
    const std::uint64_t half = hash_after(scene_with(instrument(keys(R"("friction": 0.25)"))), 0);
    EXPECT_EQ(half, hash_after(scene_with(instrument(keys(R"("friction": 0.5, "coating": [[0, 0.5], [100, 0.5]])"))), 0));
    const auto tip_after = [&](const char* friction) {
        const PreparedScene prepared = test::prepare(scene_with(instrument(keys(friction))));
        Simulator simulator(prepared.model);
        double handle = 0.0;
        for (int k = 0; k < 250; ++k) handle = simulator.step().handle_force_n;
        return std::pair(simulator.report().tip, handle);
    };
    const auto plain = tip_after(R"("friction": 0.25)"), coated = tip_after(R"("friction": 0.5, "coating": [[0, 0.5], [100, 0.5]])");
    const auto rough = tip_after(R"("friction": 0.5)"), at_the_tip = tip_after(R"("friction": 0.5, "coating": [[0, 0.5], [5, 0.5], [6, 1]])");
    EXPECT_EQ((plain.first - coated.first).norm(), 0.0) << "0.5 times 0.5 is 0.25 to the bit";
    EXPECT_EQ(plain.second, coated.second);
    std::printf("margin: handle %.4f N at friction 0.25, %.4f N at 0.5, %.4f N where the last 5 mm are coated\n", plain.second, rough.second, at_the_tip.second);
    EXPECT_NE((plain.first - at_the_tip.first).norm(), 0.0);
    EXPECT_NE((rough.first - at_the_tip.first).norm(), 0.0);
}

} // namespace
} // namespace trocar::engine
