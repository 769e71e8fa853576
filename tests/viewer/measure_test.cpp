// The cost of a viewer, and the latency from input to picture. Not part of the tests: prints figures, decides nothing.
//   test_viewer --gtest_also_run_disabled_tests --gtest_filter='*Measured*'      scene: TROCAR_VIEWER_SCENE
#include "live.hpp"

#include "engine/time/clock.hpp"

#include <algorithm>
#include <cstdlib>

namespace trocar::engine::viewer::test {
namespace {

constexpr double kSeconds = 6.0;                                   // of each run
constexpr std::int64_t kAnswer = 15'000'000, kStill = 150'000'000; // ns with and without a drive command
constexpr int kRounds = 5;                                         // without and with a viewer, by turns

std::string scene_file() {
    const char* given = std::getenv("TROCAR_VIEWER_SCENE");
    return given != nullptr ? given : TROCAR_SOURCE_DIR "/assets/scenes/hepatic.json";
}

double middle(std::vector<double> values) {
    if (values.empty()) return 0.0;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

struct Watched {
    std::size_t frames = 0, bytes = 0;
    std::vector<double> latency_ms;
};

/// Drives to and fro, and waits each time until a frame's status shows it.
Watched watch(Live& live) {
    Watched seen;
    Viewer viewer(live);
    Json status = viewer.await_type("status");
    const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(1e9 * kSeconds);
    for (int k = 0; monotonic_ns() < end; ++k) {
        const double insertion = status["insertion_m"], sign = k % 2 == 0 ? 1.0 : -1.0;
        const std::int64_t start = monotonic_ns();
        viewer.send(fmt::format(R"({{"type":"drive","insertion":{},"rotation":0}})", sign));
        status = viewer.await_status([&](const Json& json) { return sign * (json["insertion_m"].get<double>() - insertion) > 1e-5; });
        if (status.is_null()) break;
        seen.latency_ms.push_back(1e-6 * static_cast<double>(monotonic_ns() - start));
        viewer.send(R"({"type":"drive","insertion":0,"rotation":0})");
        const std::int64_t rest = monotonic_ns() + kStill;
        while (monotonic_ns() < rest)
            if (const auto message = viewer.read(); message && !viewer.was_text()) {
                ++seen.frames;
                seen.bytes += message->size();
            } else if (message) {
                if (const Json json = Json::parse(*message, nullptr, false); json["type"] == "status") status = json;
            }
    }
    return seen;
}

/// The same to and fro without a viewer: the comparison is of viewing, not of driving.
void drive_unwatched(Live& live) {
    const std::int64_t end = monotonic_ns() + static_cast<std::int64_t>(1e9 * kSeconds);
    for (int k = 0; monotonic_ns() < end; ++k) {
        (void)live.exchange.commands.push(Drive{k % 2 == 0 ? 1.0 : -1.0, 0.0});
        wait_until_ns(monotonic_ns() + kAnswer); // as long as a viewer waits for the answer
        (void)live.exchange.commands.push(Drive{});
        wait_until_ns(monotonic_ns() + kStill);
    }
}

TEST(DISABLED_ViewerMeasured, StepsWithAndWithoutAViewer) {
    const std::string file = scene_file();
    const Result<Scene> read = read_scene(file);
    ASSERT_TRUE(read.ok()) << read.error().to_string();
    const Result<PreparedScene> prepared = make_prepared_scene(*read);
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    std::vector<double> p50[2], p99[2], latency, rate, size;
    for (int round = 0; round < 2 * kRounds; ++round) {
        const bool watched = round % 2 == 1;
        Live live(*read, *prepared);
        if (watched) {
            const std::int64_t start = monotonic_ns();
            const Watched seen = watch(live);
            const double seconds = 1e-9 * static_cast<double>(monotonic_ns() - start);
            latency.insert(latency.end(), seen.latency_ms.begin(), seen.latency_ms.end());
            rate.push_back(static_cast<double>(seen.frames) / seconds);
            size.push_back(static_cast<double>(seen.bytes) / static_cast<double>(std::max<std::size_t>(1, seen.frames)));
        } else
            drive_unwatched(live);
        live.stop();
        const Percentiles step = find_percentiles(live.tally.total_ms);
        p50[watched].push_back(step.p50);
        p99[watched].push_back(step.p99);
        fmt::print("{}: {} steps, p50 {:.3f} ms, p95 {:.3f} ms, p99 {:.3f} ms\n", watched ? "one viewer" : "no viewer ", live.tally.steps,
                   step.p50, step.p95, step.p99);
    }
    fmt::print("step p50 {:.3f} ms without, {:.3f} ms with a viewer ({:+.1f} %); p99 {:.3f} and {:.3f} ms\n", middle(p50[0]),
               middle(p50[1]), 100.0 * (middle(p50[1]) / middle(p50[0]) - 1.0), middle(p99[0]), middle(p99[1]));
    fmt::print("command to the frame that shows it: median {:.1f} ms, worst {:.1f} ms of {}; {:.0f} frames a second of {:.0f} KB\n",
               middle(latency), latency.empty() ? 0.0 : *std::max_element(latency.begin(), latency.end()), latency.size(), middle(rate),
               middle(size) / 1e3);
}

} // namespace
} // namespace trocar::engine::viewer::test
