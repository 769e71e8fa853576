// What the program says of itself: help with an example for each command, and what is made of it: the reference page, the manual page,
// completions of shells.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace trocar::engine {

/// Puts an example under the help of every command, and the same help option into each.
void give_examples(CLI::App& app);

/// The commands that a user may call, in the order of the help; those of the program itself are left out.
[[nodiscard]] std::vector<const CLI::App*> shown_commands(const CLI::App& app);

/// docs/commands.md.
[[nodiscard]] std::string commands_markdown(const CLI::App& app);
/// trocar.1, in roff.
[[nodiscard]] std::string manual_page(const CLI::App& app);
/// For bash-completion, and for zsh's compinit.
[[nodiscard]] std::string bash_completion(const CLI::App& app);
[[nodiscard]] std::string zsh_completion(const CLI::App& app);

/// docs/outputs.md: every file, column and key that the program writes.
[[nodiscard]] std::string outputs_markdown();

} // namespace trocar::engine
