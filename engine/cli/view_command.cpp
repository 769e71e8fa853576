#include "engine/cli/commands.hpp"
#include "engine/cli/number_range.hpp"
#include "engine/cli/progress.hpp"
#include "engine/igtl/bridge.hpp"
#include "engine/render/attach_culler.hpp"
#include "engine/time/interrupt.hpp"
#include "engine/viewer/page_file.hpp"
#include "engine/viewer/server.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <thread>

namespace trocar::engine {

namespace {

struct ViewOptions {
    std::filesystem::path scene, page;
    std::string address = "127.0.0.1", budget;
    std::uint16_t port = 0;
    std::optional<std::uint16_t> igtl; // port of the bridge
    double igtl_rate = 20.0;           // frames a second
    std::int64_t steps = 0; // 0: until interrupted
    bool paused = false, script = false, quiet = false, at_once = false, no_page = false;
};

/// Stops the loop when the program is asked to end: a signal's handler may do no more than set a flag.
class InterruptWatch {
public:
    explicit InterruptWatch(viewer::Exchange& exchange)
        : thread_([this, &exchange] {
              while (!done_) {
                  if (interrupt_requested()) exchange.stop = true;
                  wait_until_ns(monotonic_ns() + 20'000'000);
              }
          }) {}
    ~InterruptWatch() {
        done_ = true;
        thread_.join();
    }

private:
    std::atomic<bool> done_{false};
    std::thread thread_;
};

/// step_s  what a step simulates
void print_tally(RunStatistics& tally, double step_s) {
    const std::uint64_t slower = tally.count_slower_than_real_time(step_s);
    const double kept = tally.steps == 0 ? 1.0 : 1.0 - static_cast<double>(tally.overruns) / static_cast<double>(tally.steps);
    const Percentiles step = find_percentiles(tally.total_ms), collision = find_percentiles(tally.collision_ms);
    fmt::print("{} steps, step p50/p95/p99/max {:.3g}/{:.3g}/{:.3g}/{:.3g} ms, collision p50/p95/p99/max {:.3g}/{:.3g}/{:.3g}/{:.3g} ms, "
               "budget kept in {:.2f} %\n",
               tally.steps, step.p50, step.p95, step.p99, step.max, collision.p50, collision.p95, collision.p99, collision.max,
               100.0 * kept);
    fmt::print("{} of {} whole steps took longer than the {:.4g} ms they simulate\n", slower, tally.steps, 1e3 * step_s);
}

/// What 3D Slicer connects to, beside the page.
viewer::ServerOptions server_options(const ViewOptions& options, const PreparedScene& prepared, std::string page) {
    viewer::ServerOptions server{options.address, options.port, std::move(page), !options.no_page, {}};
    if (!options.igtl) return server;
    const igtl::BridgeOptions bridge{options.address, *options.igtl, options.igtl_rate, report_notice, // on the server's thread
                                     [&options](unsigned short port) { fmt::print("OpenIGTLink at {} port {}\n", options.address, port); }};
    server.beside = [&prepared, bridge](viewer::Hub& hub) { return igtl::Bridge::open(hub, prepared.model, bridge); };
    return server;
}

int serve(const ViewOptions& options, const Scene& scene, const PreparedScene& prepared, std::string page) {
    std::string culler;
    viewer::Session session(scene, prepared, [&culler](Simulator& simulator) { culler = attach_culler(simulator); });
    if (!culler.empty() && !options.quiet) report_notice(culler);
    for (const std::string& notice : prepared.notices) report_notice(notice);
    viewer::Exchange exchange;
    viewer::open_exchange(session, exchange);
    session.apply(viewer::Pause{options.paused});
    session.apply(viewer::FollowScript{options.script});
    auto server = viewer::Server::open(scene, prepared, session, exchange, server_options(options, prepared, std::move(page)));
    if (!server.ok()) return report_error(server.error());
    const InterruptHold hold(InterruptHold::Then::OwnerEnds); // the run's figures are told
    if (!options.no_page) fmt::print("{}\n", (*server)->url());
    const bool waits = !options.at_once && options.steps == 0; // with a number of steps, no viewer is waited for
    if (!options.quiet)
        fmt::print("{}{}; Ctrl-C ends the run\n", options.no_page ? "connect 3D Slicer to this port" : "open this address in a browser",
                   waits ? ": the first step waits for it" : "");
    std::fflush(stdout);
    RunStatistics tally;
    {
        const InterruptWatch watch(exchange);
        viewer::run_loop(session, exchange, {.steps = static_cast<std::uint64_t>(options.steps), .wait_for_viewer = waits}, tally);
    }
    server->reset();
    print_tally(tally, prepared.model.step_s);
    for (const std::string& note : session.simulator().cull_notes()) report_notice(note);
    if (!session.stopped()) return kExitFine;
    report_error({ErrorCode::NotFinite, "stopped: " + session.simulator().report().failure});
    return kExitNotFinite;
}

int view(const ViewOptions& options) {
    Result<Scene> scene = read_scene(options.scene);
    if (!scene.ok()) return report_error(scene.error());
    if (!options.budget.empty()) {
        const Result<BudgetSpec> budget = parse_budget(options.budget);
        if (!budget.ok()) {
            Error error = budget.error();
            error.key = "--budget";
            return report_error(error);
        }
        scene->budget.limits = budget->limits;
    }
    auto page = options.no_page ? Result<std::string>(std::string()) : options.page.empty() ? viewer::read_page() : viewer::read_page(options.page);
    if (!page.ok()) return report_error(page.error());
    ProgressLine progress(!options.quiet);
    const auto prepared = make_prepared_scene(*scene, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!prepared.ok()) return report_error(prepared.error());
    return serve(options, *scene, *prepared, std::move(*page));
}

} // namespace

Command add_view_command(CLI::App& app) {
    const auto view_options = std::make_shared<ViewOptions>();
    ViewOptions& options = *view_options;
    CLI::App* command = app.add_subcommand("view", "Serve a page on which a person drives the scene's instrument");
    command->add_option("scene", options.scene, "scene file (JSON)")->required();
    command->add_option("--port", options.port, "port to listen at; a free one where none is given")
        ->check(CLI::Range(0, 65535)); // before it is read as a number of 16 bits
    command->add_option("--address", options.address, "address to listen at; another than 127.0.0.1 lets other machines in");
    command->add_option("--budget", options.budget, "at the start, per step: a time (1ms, 250us), work:TESTS, or exact");
    command->add_option("-n,--steps", options.steps, "end after so many steps; they begin at once, with or without a viewer")
        ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000'000}));
    command->add_option("--page", options.page, "another page than the built one (HTML)");
    CLI::Option* igtl = command->add_option("--igtl", options.igtl, "also serve OpenIGTLink at this port, which 3D Slicer connects to (its own default is 18944; 0: a free one)")
                            ->check(CLI::Range(0, 65535));
    command->add_option("--igtl-rate", options.igtl_rate, "frames a second at most that an OpenIGTLink client gets")
        ->check(number_range(igtl::kLeastRate, igtl::kMostRate))
        ->needs(igtl);
    command->add_flag("--no-page", options.no_page, "serve no page: OpenIGTLink alone")->needs(igtl);
    command->add_flag("--at-once", options.at_once, "take steps from the start; without it the first one waits for the first viewer");
    command->add_flag("--paused", options.paused, "begin paused: the page's Space, or N for one step, goes on");
    command->add_flag("--script", options.script, "begin with the scene's own script at the catheter");
    command->add_flag("--quiet", options.quiet, "print the address alone, and no progress line");
    return {command, [view_options] { return view(*view_options); }};
}

} // namespace trocar::engine
