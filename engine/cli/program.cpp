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
    app.footer("Exit codes: 0 fine, 2 bad usage or input, 3 a state left its bounds, 4 budget missed, 5 verify differs, "
               "130 interrupted.");
    const Command commands[] = {
        add_run_command(app),    add_view_command(app),     add_plan_command(app),    add_cost_command(app),
        add_verify_command(app), add_explain_command(app),  add_prepare_command(app), add_bench_command(app),
        add_ccd_command(app),    add_contacts_command(app), add_schema_command(app),
    };
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        const int code = app.exit(error);
        return code == 0 ? kExitFine : kExitBadInput; // help and version end with 0
    }
    for (const Command& command : commands)
        if (command.app->parsed()) return command.run();
    return kExitBadInput;
}

} // namespace seldinger::engine
