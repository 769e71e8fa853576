#include "engine/cli/commands.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdio>

namespace seldinger::engine {

int report_error(const Error& error) {
    fmt::print(stderr, "error: {}\n", error.to_string());
    return kExitBadInput;
}

int run_program(int argc, char** argv) {
    CLI::App app{"Time-critical, interactive surgical simulation", "seldinger"};
    app.set_version_flag("--version", "seldinger 0.1.0");
    app.require_subcommand(1);
    app.footer("Exit codes: 0 fine, 2 bad usage or input, 3 a state left its bounds, 4 budget missed, 130 interrupted.");

    RunOptions run;
    CLI::App* run_app = app.add_subcommand("run", "Simulate a scene without a display and report what was done");
    run_app->add_option("scene", run.scene, "scene file (JSON)")->required();
    run_app->add_option("--out", run.out, "output folder; out/<scene name> where none is given");
    run_app->add_option("-n,--steps", run.steps, "steps to take instead of the scene's duration")
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}));
    run_app->add_option("--budget", run.budget, "per step: a time (1ms, 250us), work:TESTS, or exact");
    run_app->add_option("--path", run.path, "CSV t,insertion,rotation in the scene's units, instead of the scene's script");
    run_app->add_flag("--record", run.record, "write states for ParaView (PVD, VTP)");
    run_app->add_flag("--force", run.force, "write into an output folder that is not empty");
    run_app->add_flag("--fail-on-overrun", run.fail_on_overrun, "exit 4 when a step missed its budget");
    run_app->add_flag("!--no-pictures", run.pictures, "take no pictures");
    run_app->add_flag("--quiet", run.quiet, "no progress line");

    ExplainOptions explain;
    CLI::App* explain_app = app.add_subcommand("explain", "Say what a scene simulates and why, and what it will cost");
    explain_app->add_option("scene", explain.scene, "scene file (JSON)")->required();

    CLI::App* schema_app = app.add_subcommand("schema", "Print the JSON Schema of scenes");

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const int code = app.exit(error);
        return code == 0 ? kExitFine : kExitBadInput; // help and version end with 0
    }
    if (run_app->parsed()) return run_command(run);
    if (explain_app->parsed()) return explain_command(explain);
    if (schema_app->parsed()) return schema_command();
    return kExitBadInput;
}

} // namespace seldinger::engine
