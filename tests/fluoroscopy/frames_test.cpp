// Frames of a run: the files, the table, what the summary says, and what is refused.
#include "engine/fluoroscopy/cone_beam.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/prepare/process.hpp"
#include "engine/report/observer.hpp"
#include "engine/step/simulator.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace trocar::engine {
namespace {

namespace fs = std::filesystem;

std::string ball_scene(const std::string& fluoroscopy, const std::string& bodies = "") {
    return fmt::format(R"({{"name": "ball", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 0.2}},
    "bodies": {{"ball": {{"kind": "static", "surface": {{"shape": "sphere", "centre": [20, -10, 30], "radius": 12, "subdivisions": 4}}}}{}}},
    "outputs": {{"fluoroscopy": {}}}}})",
                       bodies, fluoroscopy);
}

const std::string kContract = R"({"every": 3, "views": [{"name": "ap", "primary": "0 deg", "secondary": "0 deg", "isocentre": [0, 0, 0], "sid": 1050, "sod": 750,
    "detector": [300, 300], "pixels": [256, 256], "display": "linear", "noise": false}]})";

class Frames : public ::testing::Test {
protected:
    Frames() : temporary_(TemporaryFolder::make()) {
        EXPECT_TRUE(temporary_.ok());
        out = temporary_->path() / "out";
    }
    /// The error of reading, preparing or opening; nothing where the run went.
    std::optional<Error> run(const std::string& text, std::uint64_t steps) {
        Result<Scene> scene = parse_scene(text, "scenes/x.json");
        if (!scene.ok()) return scene.error();
        Result<PreparedScene> prepared = make_prepared_scene(*scene);
        if (!prepared.ok()) return prepared.error();
        ObserveOptions options;
        options.out = out, options.steps = steps, options.page = false, options.force = true;
        auto observer = RunObserver::open(*scene, *prepared, options);
        if (!observer.ok()) return observer.error();
        Simulator simulator(prepared->model);
        for (std::uint64_t k = 0; k < steps; ++k) (void)(*observer)->after_step(simulator, simulator.step());
        const RunSummary done = (*observer)->finish(simulator, 0.5, false);
        EXPECT_TRUE(done.missing_outputs.empty());
        return std::nullopt;
    }
    std::string refusal(const std::string& text) {
        const auto error = run(text, 1);
        return error ? error->to_string() : std::string("taken");
    }
    nlohmann::json summary() const { return nlohmann::json::parse(*read_file_bytes(out / "summary.json")); }
    Result<TemporaryFolder> temporary_;
    fs::path out;
};

TEST_F(Frames, AreThereAsTheContractHasThem) {
    const auto error = run(ball_scene(kContract), 7);
    ASSERT_FALSE(error) << error->to_string();
    for (const char* name : {"ap_000000.png", "ap_000003.png", "ap_000006.png"}) EXPECT_TRUE(fs::exists(out / "fluoro" / name)) << name;
    EXPECT_FALSE(fs::exists(out / "fluoro" / "ap_000001.png"));
    const nlohmann::json view = summary()["views"][0];
    EXPECT_EQ(view["name"], "ap");
    XrayProjection p;
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) p(r, c) = view["projection"][r][c];
    const auto at = project(p, Vec3(0.02, -0.01, 0.03));
    const double pitch = 0.3 / 256, depth = 0.75 - 0.01; // the ball is behind the isocentre: nearer to the source
    EXPECT_NEAR((*at)[0], 128.0 - 1.05 / depth * 0.02 / pitch, 1e-9) << "the patient's right on the left";
    EXPECT_NEAR((*at)[1], 128.0 - 1.05 / depth * 0.03 / pitch, 1e-9);
    EXPECT_EQ(summary()["fluoroscopy"]["bodies"][0]["matter"], "tissue");
}

TEST_F(Frames, AnglesInWordsAndInTheScenesUnitAreTheSame) {
    const auto angles = [](const std::string& primary, const std::string& secondary) {
        const Result<Scene> scene = parse_scene(ball_scene(fmt::format(R"({{"views": [{{"name": "a", "primary": {}, "secondary": {}}}]}})", primary, secondary)), "x.json");
        EXPECT_TRUE(scene.ok()) << scene.error().to_string();
        return std::pair(scene->outputs.fluoroscopy->views[0].primary, scene->outputs.fluoroscopy->views[0].secondary);
    };
    const auto [lao, cra] = angles(R"("LAO 30 deg")", R"("CRA 20 deg")");
    EXPECT_NEAR(lao, 0.5235987755982988, 1e-15);
    EXPECT_NEAR(cra, 0.3490658503988659, 1e-15);
    EXPECT_EQ(angles(R"("RAO 30 deg")", R"("CAU 20 deg")"), std::pair(-lao, -cra));
    EXPECT_EQ(angles(R"("30 deg")", R"("+20 deg")"), std::pair(lao, cra));
    EXPECT_EQ(angles("0.5235987755982988", R"("-0.25 rad")"), std::pair(0.5235987755982988, -0.25));
}

TEST_F(Frames, OfABiplaneSystemWithMasksDepthAndDicom) {
    const std::string views = R"({"every": 5, "views": [
        {"name": "front", "pixels": [64, 48], "masks": true, "depth": true, "dicom": true},
        {"name": "side", "primary": "LAO 90 deg", "pixels": [32, 32], "display": "log", "noise": true, "blur": 0.3, "scatter": 0.2}]})";
    const auto error = run(ball_scene(views), 5);
    ASSERT_FALSE(error) << error->to_string();
    for (const char* name : {"front_000005.png", "front_000005_device.png", "front_000005_vessel.png", "front_000005_depth.png", "front.dcm", "side_000005.png", "frames.csv"})
        EXPECT_TRUE(fs::exists(out / "fluoro" / name)) << name;
    const std::string noisy = *read_file_bytes(out / "fluoro" / "side_000005.png");
    ASSERT_FALSE(run(ball_scene(views), 5));
    EXPECT_EQ(*read_file_bytes(out / "fluoro" / "side_000005.png"), noisy) << "the same seed: the same bytes";
}

TEST_F(Frames, OfAMovingArmHaveTheirOwnProjections) {
    const auto error = run(ball_scene(R"({"every": 10, "views": [{"name": "a", "pixels": [32, 32], "arm": [[0, 0, 0], [0.1, 0.5, 0.2]]}]})"), 10);
    ASSERT_FALSE(error) << error->to_string();
    const std::string table = *read_file_bytes(out / "fluoro" / "frames.csv");
    EXPECT_NE(table.find("a,0,0,a_000000.png,0,0"), std::string::npos) << table;
    EXPECT_NE(table.find("a_000010.png,28.6"), std::string::npos) << table;
}

TEST_F(Frames, HostileViewsAreRefusedByName) {
    const auto view = [](const std::string& keys) { return ball_scene(fmt::format(R"({{"views": [{{"name": "a", {}}}]}})", keys)); };
    EXPECT_NE(refusal(view(R"("primary": "LAO 400 deg")")).find("no C-arm reaches"), std::string::npos);
    EXPECT_NE(refusal(view(R"("secondary": "CRA 91 deg")")).find("no C-arm reaches"), std::string::npos);
    for (const char* angle : {"LAO -30 deg", "CRA 30 deg", "30", "thirty", " ", "nan deg", "inf deg", "1e999 deg", "30 degrees"})
        EXPECT_NE(refusal(view(fmt::format(R"("primary": "{}")", angle))).find("expected an angle"), std::string::npos) << angle;
    for (const char* pixels : {"[0, 64]", "[64, 0]", "[1000000000, 1000000000]", "[8192, 8192]", "[1.5, 64]", "[-1, 64]", "[64]", "64"})
        EXPECT_NE(refusal(view(fmt::format(R"("pixels": {})", pixels))).find("pixels"), std::string::npos) << pixels;
    EXPECT_NE(refusal(view(R"("sod": 1200)")).find("beyond the isocentre"), std::string::npos);
    EXPECT_NE(refusal(view(R"("isocentre": [20, 740, 30])")).find("stands inside \"ball\""), std::string::npos);
    EXPECT_NE(refusal(view(R"("arm": [[0, 0, 0], [1, 1.5707963, 0]], "isocentre": [-730, -10, 30])")).find("stands inside"), std::string::npos) << "on its way";
    EXPECT_NE(refusal(view(R"("window": [1, 1])")).find("window"), std::string::npos);
    EXPECT_NE(refusal(view(R"("bits": 12)")).find("8 or 16"), std::string::npos);
    EXPECT_NE(refusal(view(R"("display": "colour")")).find("display"), std::string::npos);
    EXPECT_NE(refusal(view(R"("detector": [0, 300])")).find("detector"), std::string::npos);
    EXPECT_NE(refusal(ball_scene(R"({"views": [{"name": "../a"}]})")).find("letters"), std::string::npos);
    EXPECT_NE(refusal(ball_scene(R"({"views": [{"name": "a"}, {"name": "a"}]})")).find("second time"), std::string::npos);
    EXPECT_NE(refusal(ball_scene(R"({"views": []})")).find("views"), std::string::npos);
    EXPECT_NE(refusal(ball_scene(R"({"every": 0, "views": [{"name": "a"}]})")).find("every"), std::string::npos);
    EXPECT_NE(refusal(ball_scene(R"({"views": [{"name": "a"}], "matter": {"nobody": "bone"}})")).find("nobody"), std::string::npos);
    EXPECT_FALSE(fs::exists(out / "fluoro")) << "nothing is left behind";
}

TEST_F(Frames, ThickerAndDenserMatterAttenuatesMore) {
    const auto transmitted = [&](const std::string& matter) {
        const auto error = run(ball_scene(fmt::format(R"({{"every": 100, "views": [{{"name": "a", "isocentre": [20, -10, 30], "pixels": [9, 9], "detector": [90, 90]}}]{}}})", matter)), 1);
        EXPECT_FALSE(error) << error->to_string();
        return summary()["fluoroscopy"]["bodies"][0]["attenuation_per_m"].get<double>();
    };
    EXPECT_NEAR(transmitted(""), 0.02048 * 1060.0, 1e-9);
    EXPECT_NEAR(transmitted(R"(, "matter": {"ball": "bone"})"), 0.03148 * 1920.0, 1e-9);
}

} // namespace
} // namespace trocar::engine
