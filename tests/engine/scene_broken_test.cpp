// Every broken scene gives one error: where it is, what was found, what was expected.
#include "scene_fixture.hpp"

namespace trocar::engine {
namespace {

struct Broken {
    const char* name;
    const char* piece;
    const char* other;
    const char* key;   // of the error
    const char* found; // part of the message
    const char* right; // part of the message
};

void PrintTo(const Broken& broken, std::ostream* out) { *out << broken.name; }

class BrokenScene : public testing::TestWithParam<Broken> {};

TEST_P(BrokenScene, IsRefusedWithItsPlaceWhatWasFoundAndWhatWouldBeRight) {
    const Broken& broken = GetParam();
    const Error error = refusal(spoil(broken.piece, broken.other));
    EXPECT_EQ(error.file, "scenes/test.json");
    EXPECT_GT(error.line, 0U) << error.to_string();
    EXPECT_GT(error.column, 0U) << error.to_string();
    EXPECT_EQ(error.key, broken.key) << error.to_string();
    EXPECT_TRUE(says(error, broken.found));
    EXPECT_TRUE(says(error, broken.right));
}

// clang-format off: a row is a case
const Broken kBroken[] = {
    // keys
    {"UnknownKey", "\"density\"", "\"densty\"", "bodies.organ.material.densty", "unknown key \"densty\"", "nearest known key: \"density\""},
    {"UnknownTopKey", "\"time\"", "\"tiem\"", "tiem", "unknown key \"tiem\"", "nearest known key: \"time\""},
    {"UnknownSurfaceKey", "\"shape\": \"sphere\"", "\"fiel\": \"x.obj\"", "bodies.organ.surface.fiel", "unknown key", "\"file\""},
    {"MaterialOnStaticBody", "\"hollow\": true", "\"material\": {}", "bodies.vessel.material", "unused key \"material\"", "deformable"},
    {"FixedOnStaticBody", "\"hollow\": true", "\"fixed\": []", "bodies.vessel.fixed", "unused key", "kind is \"static\" here"},
    {"MotionOnStaticBody", "\"hollow\": true", "\"motion\": [[0, 0, 0, 0]]", "bodies.vessel.motion", "unused key", "kinematic"},
    {"AngleOnStraightTip", "\"radius\": 0.4", "\"radius\": 0.4, \"tip\": {\"shape\": \"straight\", \"angle\": 1}",
     "instruments.wire.tip.angle", "unused key \"angle\"", "J or simmons or pigtail"},
    {"RadiusOnTube", "\"shape\": \"tube\"", "\"shape\": \"tube\", \"radius\": 3", "bodies.vessel.surface.radius", "unused key",
     "sphere or torus"},
    {"BlendWithoutCarrier", "\"embedded_in\": \"organ\",", "", "bodies.vessel.blend", "unused key", "embedded_in"},
    {"MaxVolumeOfLattice", "\"kind\": \"deformable\",", "\"kind\": \"deformable\", \"coarse\": {\"max_volume\": 1},",
     "bodies.organ.coarse.max_volume", "unused key \"max_volume\": mesher is not named here, which means \"lattice\"", "used where it is tetgen"},
    {"MaxVolumeOfNamedLattice", "\"kind\": \"deformable\",",
     "\"kind\": \"deformable\", \"coarse\": {\"mesher\": \"lattice\", \"max_volume\": 1},", "bodies.organ.coarse.max_volume",
     "mesher is \"lattice\" here", "used where it is tetgen"},
    {"WeldToleranceWithoutWeld", "{\"shape\": \"sphere\", \"radius\": 50}",
     "{\"file\": \"" TROCAR_SOURCE_DIR "/README.md\", \"weld_tolerance\": 1}", "bodies.organ.surface.weld_tolerance", "unused key", "weld"},
    {"MissingUnits", "\"units\": {\"length\": \"mm\", \"pressure\": \"kPa\"},", "", "units", "\"units\" is missing", "length"},
    {"MissingLength", "\"length\": \"mm\", ", "", "units.length", "\"length\" is missing", "\"mm\""},
    {"MissingKind", "\"kind\": \"static\",", "", "bodies.vessel.kind", "\"kind\" is missing", "\"static\""},
    {"MissingSurface", "\"surface\": {\"shape\": \"sphere\", \"radius\": 50},", "", "bodies.organ.surface", "\"surface\" is missing",
     "a file name"},
    {"MissingDuration", ", \"duration\": 1", "", "time.duration", "\"duration\" is missing", "a number in s"},
    {"MissingRadius", "\"sphere\", \"radius\": 50", "\"sphere\"", "bodies.organ.surface.radius", "\"radius\" is missing", "a number in mm"},
    {"MissingMotion", "\"kind\": \"static\",", "\"kind\": \"kinematic\",", "bodies.vessel.embedded_in", "unused key \"embedded_in\"",
     "static"},
    {"EmptySurface", "{\"shape\": \"sphere\", \"radius\": 50}", "{}", "bodies.organ.surface", "found no key that says what this is",
     "file, recipe, shape"},
    {"TwoSurfaces", "{\"shape\": \"sphere\", \"radius\": 50}", "{\"shape\": \"sphere\", \"recipe\": \"x\"}", "bodies.organ.surface",
     "exclude each other", "one of them"},
    {"DuplicateKey", "\"density\": 1060", "\"density\": 1060, \"density\": 1000", "density", "already given in line", "expected once"},
    {"BadName", "\"organ\": {", "\"my organ\": {", "bodies", "\"my organ\"", "letters"},
    // types and lengths
    {"TextForNumber", "1060", "\"1060\"", "bodies.organ.material.density", "found the string \"1060\"", "a number in kg/m^3"},
    {"NumberForText", "\"lumen\": \"vessel\"", "\"lumen\": 3", "instruments.wire.lumen", "found 3", "a string"},
    {"NullForNumber", "1060", "null", "bodies.organ.material.density", "found null", "a number"},
    {"NumberForFlag", "\"hollow\": true", "\"hollow\": 1", "bodies.vessel.hollow", "found 1", "true or false"},
    {"ListForObject", "{\"young_modulus\": 5, \"density\": 1060}", "[5]", "bodies.organ.material", "found a list of 1", "an object"},
    {"ObjectForList", "[[0, 20, 0], [1, 50, 1]]", "{}", "instruments.wire.path", "found an object",
     "rows of 3 numbers [t, insertion, rotation]"},
    {"ShortVector", "[0, 0, 10]", "[0, 10]", "instruments.wire.entry.position", "found a list of 2", "3 numbers [x, y, z] in mm"},
    {"LongVector", "[0, 0, 10]", "[0, 0, 0, 10]", "instruments.wire.entry.position", "found a list of 4", "3 numbers"},
    {"TextInVector", "[0, 0, 10]", "[0, \"0\", 10]", "instruments.wire.entry.position[1]", "found the string \"0\"", "a number in mm"},
    {"ShortRow", "[1, 50, 1]", "[1, 50]", "instruments.wire.path[1]", "found a list of 2",
     "3 numbers [t, insertion, rotation] in s, mm, rad"},
    {"EmptyPath", "[[0, 20, 0], [1, 50, 1]]", "[]", "instruments.wire.path", "found a list of 0", "at least 1"},
    {"BodiesAsList", "\"targets\": {\"end\": {\"position\": [0, 0, 150]}}", "\"targets\": []", "targets", "found a list of 0", "an object"},
    {"HalfACount", "\"radius\": 50}", "\"radius\": 50, \"subdivisions\": 2.5}", "bodies.organ.surface.subdivisions", "found 2.5",
     "an integer from 0 to 7"},
    {"HugeCount", "\"radius\": 50}", "\"radius\": 50, \"subdivisions\": 1e300}", "bodies.organ.surface.subdivisions", "found 1e300",
     "an integer"},
    {"WrongChoice", "\"static\"", "\"statik\"", "bodies.vessel.kind", "found the string \"statik\"", "nearest known value: \"static\""},
    {"WrongUnit", "\"mm\"", "\"furlong\"", "units.length", "found the string \"furlong\"", "known: m, cm, mm"},
    {"WrongRepair", "{\"shape\": \"sphere\", \"radius\": 50}",
     "{\"file\": \"" TROCAR_SOURCE_DIR "/README.md\", \"repair\": [\"fil_holes\"]}", "bodies.organ.surface.repair[0]", "fil_holes",
     "\"fill_holes\""},
    {"WrongEffect", "\"damping\"", "\"dampening\"", "effects[1]", "dampening", "nearest known value: \"damping\""},
    {"EffectTwice", "\"damping\"", "\"elasticity\"", "effects[1]", "listed twice", "expected once"},
    // ranges and units
    {"NegativeDensity", "1060", "-1060", "bodies.organ.material.density", "found -1060 kg/m^3", "50 to 23000 kg/m^3"},
    {"DensityInGramsPerCm", "1060", "1.06", "bodies.organ.material.density", "found 1.06 kg/m^3",
     "was it meant in g/cm^3? then expected 1060"},
    {"ModulusOfMetalInTissue", "\"young_modulus\": 5,", "\"young_modulus\": 2e8,", "bodies.organ.material.young_modulus",
     "that is 2e+11 Pa", "soft tissue"},
    {"ModulusMeantInMPa", "60000", "60", "instruments.wire.young_modulus", "found 60 kPa, that is 60000 Pa",
     "was it meant in MPa? then expected 60000"},
    {"NegativeModulus", "\"young_modulus\": 5,", "\"young_modulus\": -5,", "bodies.organ.material.young_modulus", "found -5 kPa",
     "expected "},
    {"PoissonOneHalf", "1060}", "1060, \"poisson_ratio\": 0.5}", "bodies.organ.material.poisson_ratio", "found 0.5", "0 to 0.4999"},
    {"RadiusInMetres", "\"radius\": 0.4", "\"radius\": 0.0004", "instruments.wire.radius", "found 0.0004 mm",
     "was it meant in m? then expected 0.4"},
    {"AngleInDegrees", "\"radius\": 0.4", "\"radius\": 0.4, \"tip\": {\"angle\": 45}", "instruments.wire.tip.angle", "found 45 rad",
     "was it meant in deg?"},
    {"StepZero", "\"step\": 0.01", "\"step\": 0", "time.step", "found 0 s", "more than 0"},
    {"NegativeStep", "\"step\": 0.01", "\"step\": -0.01", "time.step", "found -0.01 s", "more than 0"},
    {"NegativeDuration", "\"duration\": 1", "\"duration\": -1", "time.duration", "found -1 s", "more than 0"},
    {"DurationBelowAStep", "\"duration\": 1", "\"duration\": 0.001", "time.duration", "less than a step of 0.01 s", "at least one step"},
    {"TooManySteps", "\"step\": 0.01", "\"step\": 1e-12", "time.step", "1e+12 steps", "at most 10^9"},
    {"FarAway", "[0, 0, 10]", "[0, 0, 1e9]", "instruments.wire.entry.position[2]", "found 1e9 mm", "-100000 to 100000 mm"},
    {"FractionAboveOne", "\"fraction\": 0.2", "\"fraction\": 15", "bodies.organ.fixed[0].fraction", "found 15",
     "more than 0 and at most 1"},
    {"BranchWithoutTime", "\"density\": 1060", "\"density\": 1060, \"g1\": 0.5", "bodies.organ.material.g1", "g1 is 0.5 and tau1 is 0", "tau1 above 0 s"},
    {"TimeWithoutBranch", "\"density\": 1060", "\"density\": 1060, \"tau2\": 0.5", "bodies.organ.material.tau2", "unused key: g2 is 0 here", "g2 above 0"},
    {"SpringThatPushesAway", "\"fixed\": [", "\"loads\": [{\"spring\": 1, \"over\": [[0, 1], [1, -0.5]]}], \"fixed\": [", "bodies.organ.loads[0].over",
     "found the factor -0.5 of a spring", "expected 0 or more"},
    {"EmptyBox", "{\"direction\": [0, 0, 1], \"fraction\": 0.2}", "{\"box\": [[0, 0, 0], [1, -1, 1]]}", "bodies.organ.fixed[0].box",
     "empty box", "lower corner"},
    {"ThreeCorners", "{\"direction\": [0, 0, 1], \"fraction\": 0.2}", "{\"box\": [[0, 0, 0], [1, 1, 1], [2, 2, 2]]}",
     "bodies.organ.fixed[0].box", "found a list of 3", "a list of 2 rows"},
    {"ZeroDirection", "[0, 0, 2]", "[0, 0, 0]", "instruments.wire.entry.direction", "length 0", "[0, 0, 1]"},
    {"GravityInMetresPerSecond", "\"effects\": [", "\"gravity\": [0, 0, -9.81], \"effects\": [\"gravity\", ", "gravity",
     "found a gravity of 9.81 mm/s^2", "9806.65 mm/s^2"},
    {"GravityMissing", "\"elasticity\",", "\"gravity\",", "effects", "gravity", "expected it added"},
    {"BudgetWithoutUnit", "\"effects\": [", "\"budget\": \"8\", \"effects\": [", "budget", "without a unit", "\"8ms\""},
    {"NegativeBudget", "\"effects\": [", "\"budget\": {\"limit\": \"-1ms\"}, \"effects\": [", "budget.limit", "negative", "\"8ms\""},
    {"RepeatedTubePoint", "[0, 0, 200, 4]", "[0, 0, 0, 4]", "bodies.vessel.surface.axis[1]", "same point", "another point"},
    // references
    {"UnknownCarrier", "\"embedded_in\": \"organ\"", "\"embedded_in\": \"orgn\"", "bodies.vessel.embedded_in", "unknown body \"orgn\"",
     "nearest known deformable body: \"organ\""},
    {"EmbeddedInItself", "\"embedded_in\": \"organ\"", "\"embedded_in\": \"vessel\"", "bodies.vessel.embedded_in", "not deformable",
     "\"organ\""},
    {"UnknownLumen", "\"lumen\": \"vessel\"", "\"lumen\": \"vesel\"", "instruments.wire.lumen", "\"vesel\"",
     "nearest known hollow body: \"vessel\""},
    {"SolidLumen", "\"lumen\": \"vessel\"", "\"lumen\": \"organ\"", "instruments.wire.lumen", "not hollow", "\"vessel\""},
    {"UnknownTarget", "\"path\": [[0, 20, 0], [1, 50, 1]]", "\"follow\": {\"target\": \"nd\"}", "instruments.wire.follow.target",
     "unknown target \"nd\"", "\"end\""},
    {"LandmarkWithoutRecipe", "{\"position\": [0, 0, 10], \"direction\": [0, 0, 2]}", "{\"landmark\": \"femoral_entry\"}",
     "instruments.wire.entry.landmark", "no landmarks", "expected a position"},
    {"MissingFile", "{\"shape\": \"sphere\", \"radius\": 50}", "\"liver.obj\"", "bodies.organ.surface", "\"liver.obj\" does not exist",
     "relative to the scene's folder"},
    {"FolderAsFile", "{\"shape\": \"sphere\", \"radius\": 50}", "\"/\"", "bodies.organ.surface", "is a folder", "a file"},
    {"UnknownVariable", "{\"shape\": \"sphere\", \"radius\": 50}", "\"${HOME}/x.obj\"", "bodies.organ.surface", "\"HOME\"",
     "TROCAR_TEST_DATA"},
    {"UnclosedVariable", "{\"shape\": \"sphere\", \"radius\": 50}", "\"${HOME\"", "bodies.organ.surface", "variable", "TROCAR_TEST_DATA"},
    {"InsideNobody", "\"radius\": 0.4", "\"radius\": 0.4, \"inside\": \"cathter\"", "instruments.wire.entry", "unused", "left out"},
    {"NoEntryAndNotInside", "\"entry\": {\"position\": [0, 0, 10], \"direction\": [0, 0, 2]},", "", "instruments.wire.entry", "is missing",
     "\"inside\""},
    {"NoLumenAndNotInside", "\"lumen\": \"vessel\",", "", "instruments.wire.lumen", "is missing", "\"inside\""},
    {"StiffnessTwice", "\"radius\": 0.4", "\"radius\": 0.4, \"stiffness\": [[0, 0.5]], \"tip\": {\"stiffness\": 0.3}",
     "instruments.wire.tip.stiffness", "beside the instrument's rows", "one of them"},
    {"StiffnessGoesBack", "\"radius\": 0.4", "\"radius\": 0.4, \"stiffness\": [[0, 0.5], [30, 0.8], [20, 1]]",
     "instruments.wire.stiffness[2]", "found 20 mm after 30 mm", "ascend"},
    {"NoStiffness", "\"radius\": 0.4", "\"radius\": 0.4, \"stiffness\": [[0, 0]]", "instruments.wire.stiffness[0][1]", "found 0",
     "0.0001 to 10000"},
    {"NoShape", "\"radius\": 0.4", "\"radius\": 0.4, \"tip\": {\"shape\": \"pigtale\"}", "instruments.wire.tip.shape", "\"pigtale\"",
     "\"pigtail\""},
    {"PoissonsRatioAboveHalf", "\"radius\": 0.4", "\"radius\": 0.4, \"poisson_ratio\": 0.6", "instruments.wire.poisson_ratio", "found 0.6",
     "at most 0.5"},
    {"TwistOfMassSpring", "\"radius\": 0.4,", "\"radius\": 0.4, \"kind\": \"mass_spring\", \"tip\": {\"shape\": \"pigtail\"},",
     "instruments.wire", "no torsion", "the kind \"rod\""},
    // drive paths
    {"TimeGoesBack", "[1, 50, 1]", "[0, 50, 1]", "instruments.wire.path[1]", "row 2: found the time 0 s after 0 s", "increasing times"},
    {"NegativeTime", "[0, 20, 0]", "[-1, 20, 0]", "instruments.wire.path[0][0]", "found -1 s", "0 to"},
    {"TooFast", "[1, 50, 1]", "[1, 60, 1]", "instruments.wire.path[1]",
     "row 2: insertion from 20 mm to 60 mm within 1 s needs 40 mm/s, beyond the limit of 35 mm/s", "\"limits\": {\"speed\": 40}"},
    {"PulledTooFast", "[[0, 20, 0], [1, 50, 1]]", "[[0, 60, 0], [1, 20, 1]]", "instruments.wire.path[1]", "40 mm/s", "\"limits\""},
    {"TurnedTooFast", "[1, 50, 1]", "[1, 50, -4]", "instruments.wire.path[1]",
     "row 2: rotation from 0 rad to -4 rad within 1 s needs 4 rad/s", "\"limits\": {\"rotation\": 4}"},
    {"TooDeep", "[1, 50, 1]", "[100, 350, 1]", "instruments.wire.path[1]", "found the insertion 350 mm",
     "0 to the instrument's length, 300 mm"},
    {"PathAndFollow", "\"path\":", "\"follow\": {\"target\": \"end\"}, \"path\":", "instruments.wire.follow", "both a path and follow",
     "one of them"},
    {"StartsElsewhere", "\"path\":", "\"inserted\": 30, \"path\":", "instruments.wire.inserted", "begins at 20 mm", "left out"},
    {"FollowTooFast", "\"path\": [[0, 20, 0], [1, 50, 1]]", "\"follow\": {\"target\": \"end\", \"speed\": 40}",
     "instruments.wire.follow.speed", "found 40 mm/s", "35 mm/s"},
    {"InsertedBeyondLength", "\"path\": [[0, 20, 0], [1, 50, 1]]", "\"inserted\": 400", "instruments.wire.inserted", "found 400 mm",
     "300 mm"},
    {"TipLongerThanWire", "\"length\": 300", "\"length\": 12, \"segment\": 1", "instruments.wire.tip.length", "found 15 mm", "12 mm"},
    {"TwoSegments", "\"length\": 300", "\"length\": 300, \"segment\": 100", "instruments.wire.segment",
     "divides the length of 300 mm into 3", "75 mm"},
    // outputs
    {"PictureAfterTheEnd", "\"effects\": [", "\"outputs\": {\"pictures\": [{\"view\": \"tip\", \"time\": 2}]}, \"effects\": [",
     "outputs.pictures[0].time", "found 2 s", "at most the duration, 1 s"},
    {"XrayWithoutEffect", "\"effects\": [", "\"outputs\": {\"pictures\": [{\"view\": \"fluoroscopy\", \"time\": 1}]}, \"effects\": [",
     "outputs.pictures[0].view", "effect is off", "expected it among the effects"},
    {"HalfAPixel", "\"effects\": [", "\"outputs\": {\"size\": [640.5, 480]}, \"effects\": [", "outputs.size", "found 640.5",
     "integers"},
};
// clang-format on

INSTANTIATE_TEST_SUITE_P(All, BrokenScene, testing::ValuesIn(kBroken), [](const auto& broken) { return std::string(broken.param.name); });

TEST(BrokenSceneFixture, TheSoundSceneItselfIsAccepted) {
    const auto scene = parse_scene(kSoundScene, "scenes/test.json");
    EXPECT_TRUE(scene.ok()) << scene.error().to_string();
}

TEST(BrokenScenes, LineAndColumnPointAtTheValue) {
    const Error error = refusal("{\n  \"units\": {\"length\": \"mm\"},\n  \"time\": {\"step\": 0.01,\n           \"duration\": -1}\n}");
    EXPECT_EQ(error.line, 4U);
    EXPECT_EQ(error.column, 24U);
    EXPECT_EQ(error.to_string().substr(0, 22), "scenes/test.json:4:24:");
}

TEST(BrokenScenes, ColumnsCountCharactersNotBytes) {
    const Error error = refusal("{\"units\": {\"length\": \"mm\"}, \"name\": \"L\xC3\xA9"
                                "ber\", \"tiem\": 1}");
    EXPECT_EQ(error.column, 46U);
}

TEST(BrokenScenes, BreathingNeedsFixedNodes) {
    std::string text = spoil("\"fixed\": [{\"direction\": [0, 0, 1], \"fraction\": 0.2}]", "\"fixed\": []");
    text.replace(text.find("\"damping\""), 9, "\"breathing\"");
    const Error error = refusal(text);
    EXPECT_TRUE(says(error, "breathing moves the fixed nodes"));
    EXPECT_GT(error.line, 0U);
}

TEST(BrokenScenes, UnsetTestDataFolderIsNamed) {
    const char* folder = std::getenv("TROCAR_TEST_DATA");
    const std::string kept = folder != nullptr ? folder : "";
    unsetenv("TROCAR_TEST_DATA");
    const Error error = refusal(spoil("{\"shape\": \"sphere\", \"radius\": 50}", "\"${TROCAR_TEST_DATA}/x.obj\""));
    if (folder != nullptr) setenv("TROCAR_TEST_DATA", kept.c_str(), 1);
    EXPECT_EQ(error.code, ErrorCode::FileNotFound);
    EXPECT_TRUE(says(error, "environment variable TROCAR_TEST_DATA"));
    EXPECT_TRUE(says(error, "not set"));
}

TEST(BrokenScenes, SpeedAboveTheDrivesNeedsExplicitLimits) {
    const std::string fast = spoil("[1, 50, 1]", "[1, 90, 4]");
    EXPECT_TRUE(says(refusal(fast), "70 mm/s"));
    std::string allowed = fast;
    allowed.replace(allowed.find("\"path\":"), 7, "\"limits\": {\"speed\": 70, \"rotation\": 4}, \"path\":");
    const auto scene = parse_scene(allowed, "scenes/test.json");
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_NEAR(scene->instruments[0].limits.speed, 0.070, 1e-15);
}

} // namespace
} // namespace trocar::engine
