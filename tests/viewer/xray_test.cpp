// The X-ray monitor of the viewer: its picture is the projector's, contrast is injected by command and repeats, and looking changes nothing.
#include "live.hpp"

#include "engine/fluoroscopy/fluoroscope.hpp"
#include "engine/scene/override.hpp"
#include "engine/viewer/xray_monitor.hpp"

#include <gmock/gmock.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>

#include <unistd.h>

namespace trocar::engine::viewer::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// A wire in a bent tube, into which contrast can be injected.
std::string contrast_scene(const std::string& contrast = R"({"rate": 5, "start": 500, "duration": 0.5})") {
    std::string text = engine::test::bent_tube_scene({35, "work:20000"});
    const std::size_t effects = text.find("\"effects\":");
    return text.substr(0, effects) + R"("effects": {"coarse_contact": true, "exact_contact": true, "friction": true, "contrast": )" + contrast + "}}";
}

template <class T>
T read_at(const std::string& bytes, std::size_t at) {
    T value{};
    if (at + sizeof(T) <= bytes.size()) std::memcpy(&value, bytes.data() + at, sizeof(T));
    return value;
}

/// The next X-ray picture that `good` accepts.
std::string await_picture(Viewer& viewer, const std::function<bool(const std::string&)>& good) {
    for (const auto end = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < end;) {
        const auto message = viewer.read();
        if (!message) return {};
        if (!viewer.was_text() && read_at<std::uint8_t>(*message, 0) == kXrayMessage && good(*message)) return *message;
    }
    return {};
}

constexpr std::size_t kHeader = 48; // bytes before the grey values

TEST(XrayMonitor, ShowsWhatTheProjectorMakesOfTheState) {
    Live live(contrast_scene());
    Viewer driver(live);
    driver.send(R"({"type":"pause","on":true})");
    (void)driver.await_status([](const Json& status) { return status["paused"] == true; });
    driver.send(R"({"type":"xray","on":true})");
    driver.send(R"({"type":"carm","primary":0.7,"secondary":-0.3,"zoom":2,"at_tip":false,"pixels":128,"display":"log"})");
    const std::string picture = await_picture(driver, [](const std::string& one) { return std::abs(read_at<float>(one, 24) - 0.7f) < 1e-6f; });
    ASSERT_EQ(picture.size(), kHeader + 128 * 128);
    live.stop(); // the state is ours
    const State& state = live.session->simulator().state();
    XrayView view = XrayPatient::whole_view(live.session->model(), state, {512, 512});
    view.primary = 0.7, view.secondary = -0.3;
    view.pixels = {128, 128};
    for (double& side : view.detector) side /= 2.0;
    view.display = XrayDisplay::Log;
    view.bits = 8;
    view.noise = true;
    view.photons = 4000.0;
    const FluoroscopySpec spec;
    XrayPatient patient(spec, live.prepared.model);
    Fluoroscope scope(view);
    const XrayProjection projection = scope.project(patient, state).beam.projection();
    const GreyFrame frame = scope.frame(state.step, state.time);
    for (std::size_t k = 0; k < frame.values.size(); ++k) ASSERT_EQ(static_cast<std::uint8_t>(picture[kHeader + k]), frame.values[k]) << "pixel " << k;
    const auto tip = project(projection, state.instruments[0].rod.position.back());
    ASSERT_TRUE(tip);
    EXPECT_NEAR(read_at<float>(picture, 32), (*tip)[0], 1e-3);
    EXPECT_NEAR(read_at<float>(picture, 36), (*tip)[1], 1e-3);
    EXPECT_EQ(read_at<double>(picture, 16), state.time);
    const auto [darkest, brightest] = std::minmax_element(frame.values.begin(), frame.values.end());
    EXPECT_LT(*darkest, *brightest);
}

TEST(XrayMonitor, FollowsTheRunAndOnlyTheDriverMovesTheArm) {
    const Live live(contrast_scene());
    Viewer driver(live), watcher(live);
    (void)watcher.await_type("status");
    watcher.send(R"({"type":"carm","primary":0.7,"secondary":0,"zoom":1,"at_tip":false,"pixels":64,"display":"log"})");
    EXPECT_THAT(watcher.await_type("error")["text"].get<std::string>(), HasSubstr("you watch"));
    watcher.send(R"({"type":"xray","on":true})");
    const std::string first = await_picture(watcher, [](const std::string&) { return true; });
    ASSERT_EQ(first.size(), kHeader + 512 * 512);
    const std::string later = await_picture(watcher, [&](const std::string& one) { return read_at<double>(one, 16) > read_at<double>(first, 16); });
    EXPECT_FALSE(later.empty());
    EXPECT_EQ(read_at<float>(later, 24), 0.0f);
    EXPECT_GT(read_at<std::uint32_t>(later, 4), read_at<std::uint32_t>(first, 4));
}

TEST(XrayMonitor, SubtractionShowsContrastAlone) {
    const Live live(contrast_scene());
    Viewer driver(live);
    driver.send(R"({"type":"xray","on":true})");
    driver.send(R"({"type":"carm","primary":0,"secondary":0,"zoom":1,"at_tip":false,"pixels":128,"display":"subtraction"})");
    driver.send(R"({"type":"mask"})");
    const auto darkest = [](const std::string& one) {
        return *std::min_element(one.begin() + kHeader, one.end(), [](char a, char b) { return static_cast<std::uint8_t>(a) < static_cast<std::uint8_t>(b); });
    };
    const std::string mask = await_picture(driver, [](const std::string& one) { return read_at<std::uint32_t>(one, 12) == 2 && (read_at<std::uint16_t>(one, 2) & kXrayNewMask) != 0; });
    ASSERT_FALSE(mask.empty());
    std::set<char> greys(mask.begin() + kHeader, mask.end());
    EXPECT_EQ(greys.size(), 1u); // nothing is new in the mask frame itself
    driver.send(R"({"type":"inject"})");
    const std::string filled = await_picture(driver, [](const std::string& one) { return (read_at<std::uint16_t>(one, 2) & kXrayHasContrast) != 0; });
    ASSERT_FALSE(filled.empty());
    const std::string dark = await_picture(driver, [&](const std::string& one) { return static_cast<std::uint8_t>(darkest(one)) < static_cast<std::uint8_t>(*greys.begin()) / 2; });
    EXPECT_FALSE(dark.empty());
    const Json status = driver.await_status([](const Json& json) { return json["injection"]["injected_mg"] > 0.0; });
    EXPECT_LT(status["injection"]["start_s"], 100.0);
}

TEST(XrayMonitor, LookingChangesNothing) {
    const auto hash_after = [](bool watched) {
        const std::string text = contrast_scene(R"({"rate": 1, "start": 0.2})");
        const Scene scene = *parse_scene(text, "scenes/live.json");
        const PreparedScene prepared = *make_prepared_scene(scene);
        Session session(scene, prepared);
        Exchange exchange;
        open_exchange(session, exchange);
        exchange.viewers = exchange.xray_wanted = watched;
        XrayMonitor monitor(scene, prepared.model, exchange);
        monitor.show(watched);
        session.apply(Drive{1.0, 0.3});
        RunStatistics tally;
        run_loop(session, exchange, {150, false}, tally);
        return hash_state(session.simulator().state());
    };
    EXPECT_EQ(hash_after(true), hash_after(false));
}

/// What a recording says of an injection, after steps before and after it.
struct Injected {
    Scene scene;
    PreparedScene prepared;
    std::optional<Session> session;
    explicit Injected(const std::string& text) : scene(*parse_scene(text, "scenes/viewer.json")), prepared(*make_prepared_scene(scene)) { session.emplace(scene, prepared); }
    void steps(int count) {
        for (int k = 0; k < count; ++k) {
            session->apply(Drive{k % 40 < 30 ? 1.0 : -0.4, 0.5});
            session->step();
        }
    }
    [[nodiscard]] std::string text() const {
        return session->recording()->text(scene, session->recording()->steps(), hash_state(const_cast<Session&>(*session).simulator().state()));
    }
};

TEST(XrayInjection, RepeatsBitForBitWithTheOptionThatTheRecordingSays) {
    for (const std::string& contrast : {std::string(R"({"rate": 1, "start": 500, "duration": 0.3})"), std::string("true")}) {
        const std::string scene_text = [&] { // in ms: starts that have no exact fraction
            std::string text = contrast_scene(contrast);
            return text;
        }();
        Injected run(scene_text);
        run.session->apply(SetBudget{{BudgetMode::Work, 0, 20'000}});
        if (contrast == "true") run.session->apply(Inject{}); // from 0 on: as the scene says, and nothing twice
        run.steps(contrast == "true" ? 60 : 37);
        run.session->apply(Inject{});
        run.steps(60);
        const std::string csv = run.text();
        if (contrast == "true") { // the scene's own injection, from 0 for 2 s, was under way
            EXPECT_THAT(csv, HasSubstr("# Bit for bit"));
            EXPECT_THAT(csv, Not(HasSubstr("contrast")));
            continue;
        }
        const std::size_t option = csv.find("--set ");
        ASSERT_NE(option, std::string::npos) << csv.substr(0, 300);
        const std::string set = csv.substr(option + 6, csv.find(' ', option + 6) - option - 6);
        const auto override = parse_override(set);
        ASSERT_TRUE(override.ok()) << set;
        const std::filesystem::path file = std::filesystem::temp_directory_path() / fmt::format("trocar-xray-{}.csv", getpid());
        std::ofstream(file) << csv;
        Result<Scene> scene = parse_scene(scene_text, "scenes/viewer.json", std::span(&*override, 1));
        ASSERT_TRUE(scene.ok()) << scene.error().to_string();
        ASSERT_TRUE(read_instrument_paths(*scene, file).ok());
        std::filesystem::remove(file);
        scene->budget.limits = {BudgetMode::Work, 0, 20'000};
        const PreparedScene prepared = *make_prepared_scene(*scene);
        Simulator simulator(prepared.model);
        for (std::size_t k = 0; k < run.session->recording()->steps(); ++k) simulator.step();
        EXPECT_EQ(hash_state(simulator.state()), hash_state(run.session->simulator().state())) << set;
        EXPECT_GT(effects::measure_contrast(prepared.model, simulator.state()).injected, 0.0);
        EXPECT_EQ(effects::measure_contrast(prepared.model, simulator.state()).injected,
                  effects::measure_contrast(run.session->model(), run.session->simulator().state()).injected);
    }
}

TEST(XrayInjection, SaysWhyItDoesNotRepeat) {
    Injected twice(contrast_scene());
    twice.steps(5);
    twice.session->apply(Inject{});
    twice.steps(60); // 0.5 s, and a while
    twice.session->apply(Inject{});
    EXPECT_THAT(twice.text(), HasSubstr("a second time"));
    twice.session->apply(Restart{});
    EXPECT_EQ(twice.session->status().injection->start, 500.0); // the scene's own again
    EXPECT_THAT(twice.text(), HasSubstr("# Bit for bit"));

    Injected listed(engine::test::bent_tube_scene({35, "work:20000", R"("coarse_contact", "exact_contact", "contrast")"}));
    listed.steps(220); // its own is over after 2 s
    listed.session->apply(Inject{});
    EXPECT_THAT(listed.text(), HasSubstr("lists its effects by name"));
}

TEST(XrayInjection, OfASceneWithoutContrastIsRefused) {
    const Live live;
    Viewer driver(live);
    driver.send(R"({"type":"inject"})");
    EXPECT_THAT(driver.await_type("error")["text"].get<std::string>(), HasSubstr("the scene has no contrast"));
    EXPECT_TRUE(driver.await_type("status")["injection"].is_null());
}

} // namespace
} // namespace trocar::engine::viewer::test
