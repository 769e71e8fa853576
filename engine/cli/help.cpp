#include "engine/cli/help.hpp"

#include "engine/report/build_facts.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

namespace trocar::engine {

namespace {

struct Example {
    const char* command; // with its kind, where it has kinds
    const char* line;    // without the program's name
};

constexpr Example kExamples[] = {
    {"run", "run assets/scenes/u_bend.json --budget 8ms --out out/u_bend"},
    {"view", "view assets/scenes/aortic_arch.json --port 8080"},
    {"plan", "plan assets/scenes/aortic_arch.json --to left_carotid --out out/way"},
    {"cost", "cost assets/scenes/hepatic.json --budgets 0.1ms,1ms,exact -n 100 --out out/cost"},
    {"verify", "verify tests/regression/scenes.txt"},
    {"explain", "explain assets/scenes/hepatic.json"},
    {"prepare", "prepare liver.stl --unit mm --out out/liver"},
    {"bench", "bench laws --page laws.html"},
    {"ccd", "ccd queries.csv"},
    {"contacts", "contacts before.obj after.obj --out contacts.csv"},
    {"schema", "schema > scene.schema.json"},
    {"devices", "devices cobra_2"},
    {"episode", "episode assets/scenes/aortic_arch.json --policy advance --seed 3 --out out/arch"},
    {"score", "score out/episode --force-limit 0.5"},
    {"sweep", "sweep assets/sweeps/patients.json --out out/sweep --jobs 2 --collect table.csv"},
    {"sweep-worker", "sweep-worker out/sweep --chunk 0"},
    {"import", "import vessel carotids.stl --unit mm --out carotids"},
    {"import vessel", "import vessel carotids.stl --unit mm --inlet 12,-4,0 --out carotids"},
    {"import segmentation", "import segmentation ct.seg.nrrd --label aorta --out aorta"},
    {"import organ", "import organ liver.msh --unit mm --out liver"},
    {"import slicer", "import slicer centrelines.mrk.json --out vessel"},
    {"import vmtk", "import vmtk centrelines.vtp --out vessel"},
    {"import simvascular", "import simvascular project --out vessel"},
    {"import steve", "import steve --setup archvariety --out arch"},
    {"film", "film assets/scenes/hepatic.json --out film.png -n 500 --every 20"},
    {"docs", "docs outputs"},
};

bool is_shown(const CLI::App* command) { return !command->get_name().empty() && !command->get_group().empty(); }

/// "run", or "import vessel".
std::string full_name(const CLI::App& command) {
    const CLI::App* parent = command.get_parent();
    return parent != nullptr && parent->get_parent() != nullptr ? full_name(*parent) + " " + command.get_name() : command.get_name();
}

std::string example_of(const CLI::App& command) {
    const std::string name = full_name(command);
    const auto* found = std::find_if(std::begin(kExamples), std::end(kExamples), [&](const Example& e) { return name == e.command; });
    return found != std::end(kExamples) ? std::string("trocar ") + found->line : std::string();
}

/// Commands and their kinds.
template <class Do>
void for_each_command(const CLI::App& app, const Do& act) {
    for (const CLI::App* command : shown_commands(app)) {
        act(*command);
        for_each_command(*command, act);
    }
}

bool is_positional(const CLI::Option& option) { return option.get_positional(); }

std::vector<const CLI::Option*> options_of(const CLI::App& command, bool positional) {
    std::vector<const CLI::Option*> found;
    for (const CLI::Option* option : command.get_options())
        if (is_positional(*option) == positional) found.push_back(option);
    return found;
}

/// "-n", "--steps".
std::vector<std::string> names_of(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option.get_fnames()) std::replace_if(names.begin(), names.end(), [&](const std::string& n) { return n == name; }, name);
    return names;
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

/// "TEXT", "INT in [0 - 100]", "{vessel,organ}"; "" of a flag.
std::string value_of(const CLI::Option& option) {
    if (!takes_value(option)) return {};
    std::string type = option.get_type_name();
    const std::size_t colon = type.find(':');
    return colon == std::string::npos ? type : type.substr(colon + 1);
}

/// "vessel", "organ" of an option that takes one of them.
std::vector<std::string> choices_of(const CLI::Option& option) {
    const std::string value = value_of(option);
    std::vector<std::string> words;
    const std::size_t open = value.find('{'), close = value.find('}');
    if (open == std::string::npos || close == std::string::npos) return words;
    std::string list = value.substr(open + 1, close - open - 1);
    for (std::size_t at = 0; at <= list.size();) {
        const std::size_t end = std::min(list.find(',', at), list.size());
        words.push_back(list.substr(at, end - at));
        at = end + 1;
    }
    return words;
}

std::string usage_of(const CLI::App& command) {
    std::string usage = "trocar " + full_name(command);
    if (!options_of(command, false).empty()) usage += " [OPTIONS]";
    for (const CLI::Option* option : options_of(command, true)) {
        const std::string name = option->get_name(true) + (option->get_items_expected_max() > 1 ? "..." : "");
        usage += option->get_required() ? " " + name : " [" + name + "]";
    }
    if (!shown_commands(command).empty()) usage += " KIND";
    return usage;
}

std::string description_of(const CLI::Option& option) {
    std::string text = option.get_description();
    std::vector<std::string> other;
    for (const CLI::Option* one : option.get_excludes()) other.push_back(one->get_name());
    std::sort(other.begin(), other.end());
    if (!other.empty()) text += fmt::format(" (not with {})", fmt::join(other, ", "));
    if (option.get_required()) text += " (required)";
    if (!option.get_default_str().empty()) text += fmt::format(" (default: {})", option.get_default_str());
    return text;
}

std::string in_table(std::string text) {
    for (std::size_t at = text.find('|'); at != std::string::npos; at = text.find('|', at + 2)) text.insert(at, 1, '\\');
    for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 4)) text.replace(at, 1, "&lt;");
    return text;
}

std::string command_section(const CLI::App& command) {
    const bool is_kind = command.get_parent()->get_parent() != nullptr;
    std::string page = fmt::format("\n{} {}\n\n{}.\n\n    {}\n", is_kind ? "###" : "##", full_name(command), command.get_description(), usage_of(command));
    std::string rows;
    for (const bool positional : {true, false})
        for (const CLI::Option* option : options_of(command, positional)) {
            const std::string name = positional ? option->get_name(true) : fmt::format("{}", fmt::join(names_of(*option), ", "));
            const std::string value = positional ? std::string() : value_of(*option);
            rows += fmt::format("| `{}{}` | {} |\n", name, value.empty() ? "" : " " + in_table(value), in_table(description_of(*option)));
        }
    if (!rows.empty()) page += "\n| argument | meaning |\n| --- | --- |\n" + rows;
    if (const std::string example = example_of(command); !example.empty()) page += fmt::format("\nExample: `{}`\n", example);
    return page;
}

/// Text for a line of roff: no character starts a request or an escape.
std::string roff(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else
            out += c;
    }
    return out.starts_with('.') || out.starts_with('\'') ? "\\&" + out : out;
}

constexpr const char* kExitCodes[][2] = {
    {"0", "fine"},
    {"2", "bad usage or bad input, with file, line, key and what is expected; or an output that cannot be written: the others are, and "
          "`missing_outputs` of `summary.json` names it"},
    {"3", "a state left its bounds: the last good state is saved, and the element is named"},
    {"4", "with `--fail-on-overrun`: a step missed its budget"},
    {"5", "an answer differs from its reference: `verify`, `run --replay`, `score`, a contact that `ccd` misses, a bound of `bench`"},
    {"130", "interrupted"},
};

std::string quoted_for_zsh(const std::string& text) {
    std::string out;
    for (const char c : text) {
        if (c == '\'')
            out += "'\\''";
        else if (c == '[' || c == ']' || c == ':')
            out += std::string("\\") + c;
        else
            out += c;
    }
    return out;
}

std::string function_name(const CLI::App& command) {
    std::string name = full_name(command);
    std::replace(name.begin(), name.end(), ' ', '_');
    return "_trocar_" + name;
}

std::vector<std::string> command_names(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* command : shown_commands(app)) names.push_back(command->get_name());
    return names;
}

} // namespace

std::vector<const CLI::App*> shown_commands(const CLI::App& app) {
    std::vector<const CLI::App*> commands = app.get_subcommands([](const CLI::App*) { return true; });
    std::erase_if(commands, [](const CLI::App* command) { return !is_shown(command); });
    return commands;
}

void give_examples(CLI::App& app) {
    for (CLI::App* command : app.get_subcommands([](CLI::App*) { return true; })) {
        if (const std::string example = example_of(*command); !example.empty()) command->footer("Example: " + example);
        give_examples(*command);
    }
}

std::string commands_markdown(const CLI::App& app) {
    std::string page = "# Commands\n\nThis page is written by the program: `trocar docs commands`. `trocar COMMAND --help` says the same on a "
                       "terminal, and `man trocar` where it is installed.\n\n| command | does |\n| --- | --- |\n";
    for (const CLI::App* command : shown_commands(app))
        page += fmt::format("| [{0}](#{0}) | {1} |\n", command->get_name(), in_table(command->get_description()));
    page += "\nWhat each writes: [outputs.md](outputs.md). What a scene may say: [scene.md](scene.md). What a budget is: "
            "[budget.md](budget.md).\n\n## Exit codes\n\n| code | means |\n| --- | --- |\n";
    for (const auto& [code, meaning] : kExitCodes) page += fmt::format("| {} | {} |\n", code, meaning);
    for_each_command(app, [&](const CLI::App& command) { page += command_section(command); });
    return page;
}

std::string manual_page(const CLI::App& app) {
    std::string page = fmt::format(".TH TROCAR 1 \"\" \"trocar {}\" \"User Commands\"\n.SH NAME\ntrocar \\- {}\n.SH SYNOPSIS\n.B trocar\n"
                                   ".I COMMAND\n[\\fIOPTIONS\\fR]\n.SH COMMANDS\n",
                                   build_facts().version, roff(app.get_description()));
    for_each_command(app, [&](const CLI::App& command) {
        page += fmt::format(".SS {}\n{}.\n.PP\n.B {}\n", roff(full_name(command)), roff(command.get_description()), roff(usage_of(command)));
        for (const bool positional : {true, false})
            for (const CLI::Option* option : options_of(command, positional)) {
                const std::string name = positional ? option->get_name(true) : fmt::format("{}", fmt::join(names_of(*option), ", "));
                const std::string value = positional ? std::string() : value_of(*option);
                page += fmt::format(".TP\n.B {}{}\n{}\n", roff(name), value.empty() ? "" : " \\fI" + roff(value) + "\\fR",
                                    roff(description_of(*option)));
            }
        if (const std::string example = example_of(command); !example.empty()) page += fmt::format(".PP\nExample: {}\n", roff(example));
    });
    page += ".SH EXIT STATUS\n";
    for (const auto& [code, meaning] : kExitCodes) page += fmt::format(".TP\n.B {}\n{}\n", code, roff(meaning));
    return page + ".SH SEE ALSO\nThe pages of the documentation, installed beside this one under share/doc.\n";
}

std::string bash_completion(const CLI::App& app) {
    std::string text = fmt::format("# bash completion of trocar; written by `trocar docs bash`\n_trocar() {{\n    local word=${{COMP_WORDS[COMP_CWORD]}} "
                                   "before=${{COMP_WORDS[COMP_CWORD-1]}} command=${{COMP_WORDS[1]}} words=\n    COMPREPLY=()\n"
                                   "    if ((COMP_CWORD == 1)); then\n        COMPREPLY=($(compgen -W '{} --help --version' -- \"$word\"))\n"
                                   "        return\n    fi\n",
                                   fmt::join(command_names(app), " "));
    for (const CLI::App* command : shown_commands(app))
        if (const auto kinds = command_names(*command); !kinds.empty())
            text += fmt::format("    if [[ $command == {0} ]]; then\n        if ((COMP_CWORD == 2)); then\n            COMPREPLY=($(compgen -W '{1} "
                                "--help' -- \"$word\"))\n            return\n        fi\n        command=\"{0} ${{COMP_WORDS[2]}}\"\n    fi\n",
                                command->get_name(), fmt::join(kinds, " "));
    text += "    case \"$command:$before\" in\n";
    for_each_command(app, [&](const CLI::App& command) {
        for (const CLI::Option* option : options_of(command, false))
            if (const auto choices = choices_of(*option); !choices.empty())
                for (const std::string& name : names_of(*option))
                    text += fmt::format("    '{}:{}') words='{}' ;;\n", full_name(command), name, fmt::join(choices, " "));
    });
    text += "    esac\n    if [[ -n $words ]]; then\n        COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n        return\n    fi\n"
            "    if [[ $word == -* ]]; then\n        case $command in\n";
    for_each_command(app, [&](const CLI::App& command) {
        std::vector<std::string> words;
        for (const CLI::Option* option : options_of(command, false))
            for (const std::string& name : names_of(*option)) words.push_back(name);
        text += fmt::format("        '{}') words='{}' ;;\n", full_name(command), fmt::join(words, " "));
    });
    return text + "        esac\n        COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n        return\n    fi\n"
                  "    COMPREPLY=($(compgen -f -- \"$word\"))\n}\ncomplete -o filenames -F _trocar trocar\n";
}

std::string zsh_completion(const CLI::App& app) {
    std::string text = "#compdef trocar\n# zsh completion of trocar; written by `trocar docs zsh`\n";
    const auto list = [](const CLI::App& parent) {
        std::string lines;
        for (const CLI::App* command : shown_commands(parent))
            lines += fmt::format("        '{}:{}'\n", command->get_name(), quoted_for_zsh(command->get_description()));
        return lines;
    };
    for_each_command(app, [&](const CLI::App& command) {
        text += function_name(command) + "() {\n";
        if (const std::string kinds = list(command); !kinds.empty()) {
            text += "    local -a kinds=(\n" + kinds + "    )\n    if ((CURRENT == 2)); then\n        _describe kind kinds\n        return\n    fi\n"
                    "    local kind=$words[2]\n    shift words\n    ((CURRENT--))\n    (($+functions[" +
                    function_name(command) + "_$kind])) && " + function_name(command) + "_$kind\n}\n";
            return;
        }
        text += "    _arguments \\\n";
        for (const CLI::Option* option : options_of(command, false))
            for (const std::string& name : names_of(*option)) {
                const auto choices = choices_of(*option);
                const std::string value = !takes_value(*option) ? std::string()
                                          : choices.empty()     ? std::string(":value:_files")
                                                                : fmt::format(":value:({})", fmt::join(choices, " "));
                text += fmt::format("        '{}[{}]{}' \\\n", name, quoted_for_zsh(option->get_description()), value);
            }
        text += "        '*:file:_files'\n}\n";
    });
    return text + "_trocar() {\n    local -a commands=(\n" + list(app) +
           "    )\n    if ((CURRENT == 2)); then\n        _describe command commands\n        return\n    fi\n    local command=$words[2]\n"
           "    shift words\n    ((CURRENT--))\n    (($+functions[_trocar_$command])) && _trocar_$command\n}\n_trocar \"$@\"\n";
}

} // namespace trocar::engine
