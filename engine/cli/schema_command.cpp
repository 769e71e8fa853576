#include "engine/cli/commands.hpp"
#include "engine/experiments/sweep/sweep_spec.hpp"
#include "engine/scene/schema.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>

namespace trocar::engine {

Command add_schema_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("schema", "Print the JSON Schema of scenes");
    const auto of_sweeps = std::make_shared<bool>(false);
    command->add_flag("--sweep", *of_sweeps, "of sweeps instead");
    return {command, [of_sweeps] {
                std::fputs((*of_sweeps ? sweep_schema_text() : scene_schema_text()).c_str(), stdout);
                return static_cast<int>(kExitFine);
            }};
}

} // namespace trocar::engine
