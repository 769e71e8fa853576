#include "engine/cli/commands.hpp"
#include "engine/scene/schema.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>

namespace trocar::engine {

Command add_schema_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("schema", "Print the JSON Schema of scenes");
    return {command, [] {
                std::fputs(scene_schema_text().c_str(), stdout);
                return static_cast<int>(kExitFine);
            }};
}

} // namespace trocar::engine
