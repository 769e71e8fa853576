#include "engine/cli/commands.hpp"
#include "engine/cli/help.hpp"
#include "engine/io/printable.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/time/interrupt.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <exception>
#include <new>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

namespace trocar::engine {

int report_error(const Error& error) {
    std::fputs(fmt::format("error: {}\n", printable(error.to_string())).c_str(), stderr); // fmt::print throws where the stream is closed
    return kExitBadInput;
}

void print_to_stderr(const std::string& line) { std::fputs((line + "\n").c_str(), stderr); }

void report_notice(const std::string& sentence) { print_to_stderr("notice: " + sentence); }

int WrittenOutputs::tell(const std::filesystem::path& place) const {
    if (all_there()) return kExitFine;
    std::fputs(fmt::format("{} of {} outputs are missing, see above; {}{}\n", missing_, outputs_,
                           missing_ == outputs_ ? "nothing was written" : "the others are written",
                           place.empty() || missing_ == outputs_ ? "" : " to " + printable(place.string()))
                   .c_str(),
               stderr);
    return kExitBadInput;
}

/// Checks that standard output was written: a lost answer is an error.
static int end_output(int code) {
    if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return code;
    const int failed = report_error({ErrorCode::CannotWrite, "the standard output cannot be written"});
    return code == kExitFine ? failed : code;
}

/// The command that was named, or its kind: as deep as the command line goes.
static const CLI::App& find_named(const CLI::App& app) {
    const std::vector<const CLI::App*> parsed = app.get_subcommands([](const CLI::App* command) { return command->parsed(); });
    return parsed.empty() ? app : find_named(*parsed.front());
}

/// "trocar run".
static std::string name_with_parents(const CLI::App& command) {
    return command.get_parent() == nullptr ? std::string("trocar") : name_with_parents(*command.get_parent()) + " " + command.get_name();
}

static std::string refuse_word(std::string_view kind, std::string_view word, const std::vector<std::string>& known) {
    return refuse_unknown(kind, word, std::vector<std::string_view>(known.begin(), known.end()));
}

/// What nobody takes, with what was probably meant; empty: all words were taken.
static std::string describe_extras(const CLI::App& command) {
    const std::vector<std::string> extras = command.remaining();
    std::vector<std::string> options, commands;
    for (const CLI::Option* option : command.get_options([](const CLI::Option* o) { return !o->get_group().empty(); })) {
        for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
    }
    for (const CLI::App* one : shown_commands(command)) commands.push_back(one->get_name());
    for (const std::string& word : extras)
        if (word.size() > 1 && word.front() == '-' && word != "--") return refuse_word("option", word.substr(0, word.find('=')), options);
    if (extras.empty()) return {};
    if (!commands.empty()) return refuse_word(command.get_parent() == nullptr ? "command" : "kind", extras.front(), commands);
    return fmt::format("found the argument \"{:.60}\" beyond those that it takes", extras.front());
}

/// "an integer from 0 to 9" of an option whose type the library writes as INT:INT in [0 - 9].
static std::string describe_type(const CLI::Option& option) {
    const std::string type = option.get_type_name(), kind = type.substr(0, type.find(':'));
    const std::string text = kind == "INT" || kind == "UINT" ? "an integer" : kind == "FLOAT" ? "a number" : "another value";
    const std::size_t open = type.find(" in ["), dash = type.find(" - ", open), close = type.find(']', dash);
    if (open != std::string::npos && close != std::string::npos)
        return fmt::format("{} from {} to {}", text, type.substr(open + 5, dash - open - 5), type.substr(dash + 3, close - dash - 3));
    return kind == "UINT" ? text + " of at least 0" : text;
}

/// A value, or a number of values, that an option does not take; none: the error is another.
static std::optional<Error> describe_value(const CLI::App& command, const CLI::ParseError& error) {
    constexpr std::string_view kNoNumber = "Could not convert: ";
    std::string said = error.what(); // NAME: REASON, or the prefix and NAME = VALUE
    if (said.starts_with(kNoNumber)) said.erase(0, kNoNumber.size());
    const CLI::Option* option = command.get_option_no_throw(said.substr(0, said.find_first_of(": ")));
    if (option == nullptr || option->get_positional()) return std::nullopt;
    const auto refuse = [&](std::string message) { return Error{ErrorCode::BadUsage, std::move(message), {}, 0, 0, option->get_name()}; };
    if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr) { // says "1 required INT:INT in [0 - 9] missing"
        const int values = option->get_items_expected_min();
        return refuse(fmt::format("found another number of values than it takes; expected {} after it",
                                  values == 1 ? "one value" : fmt::format("{} values", values)));
    }
    const std::string reason = said.substr(std::min(said.size(), said.find(": ") + 2));
    const bool is_bare = dynamic_cast<const CLI::ConversionError*>(&error) != nullptr || reason.find(" not in range ") != std::string::npos;
    if (is_bare && !option->results().empty()) return refuse(fmt::format("found {:.60}; expected {}", option->results().back(), describe_type(*option)));
    if (dynamic_cast<const CLI::ValidationError*>(&error) != nullptr) return refuse(reason);
    return std::nullopt;
}

/// A command line that is none, as any other error.
static Error describe_usage(const CLI::App& app, const CLI::ParseError& error) {
    const CLI::App& command = find_named(app);
    std::string message = describe_extras(command);
    if (message.empty())
        if (auto described = describe_value(command, error)) return *described;
    if (message.empty()) message = error.what();
    for (char& c : message)
        if (c == '\n') c = ' ';
    return {ErrorCode::BadUsage, message};
}

/// An empty value would be taken for an option that was not given: in a script it is a variable that was not set.
static std::optional<Error> check_values(const CLI::App& command) {
    for (const CLI::Option* option : command.get_options())
        for (const std::string& value : option->results())
            if (value.empty())
                return Error{ErrorCode::BadUsage, "found an empty value; give it one, or leave it out", {}, 0, 0, option->get_name()};
    return std::nullopt;
}

Result<void> check_command_line(std::vector<std::string> words) {
    CLI::App app{"", "trocar"};
    app.require_subcommand(1);
    const Command commands[] = {add_run_command(app), add_plan_command(app), add_cost_command(app), add_verify_command(app), add_episode_command(app)};
    std::reverse(words.begin(), words.end()); // as the library wants them
    try {
        app.parse(words);
    } catch (const CLI::ParseError& error) {
        return describe_usage(app, error);
    }
    for (const Command& command : commands)
        if (const auto empty = command.app->parsed() ? check_values(*command.app) : std::nullopt) return *empty;
    return {};
}

int run_program(int argc, char** argv, AnswerBench answer_bench) {
    CLI::App app{"Time-critical, interactive surgical simulation", "trocar"};
    app.set_version_flag("--version", build_text());
    app.require_subcommand(1);
    app.footer(
        "Example: trocar run assets/scenes/u_bend.json -n 200 --out first\n\n"
        "Exit codes: 0 fine, 2 bad usage, bad input, or an output that cannot be written, 3 a state left its bounds, 4 budget missed, "
        "5 an answer differs from its reference (verify, --replay, ccd, score), "
        "130 interrupted.");
    const Command commands[] = {
        add_run_command(app),    add_view_command(app),     add_plan_command(app),    add_cost_command(app),
        add_verify_command(app), add_explain_command(app),  add_prepare_command(app), add_bench_command(app, std::move(answer_bench)),
        add_ccd_command(app),    add_contacts_command(app), add_schema_command(app),   add_devices_command(app),
        add_episode_command(app), add_score_command(app),  add_sweep_command(app),    add_sweep_worker_command(app), add_import_command(app), add_film_command(app),
        add_docs_command(app),
    };
    give_examples(app);
    std::vector<std::string> words(argv + 1, argv + std::max(argc, 1));
    if (!words.empty() && words.front() == "help") std::rotate(words.begin(), words.begin() + 1, words.end()), words.back() = "--help"; // `help run`
    std::reverse(words.begin(), words.end()); // as the library wants them
    try {
        app.parse(std::move(words));
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return end_output(app.exit(error)); // help and version
        Error described = describe_usage(app, error);
        described.message += fmt::format("; `{} --help` shows what it takes", name_with_parents(find_named(app)));
        return report_error(described);
    }
    std::signal(SIGXFSZ, SIG_IGN); // a file beyond the system's limit is then an error of its write
    catch_interrupts();
    for (const Command& command : commands)
        if (const auto empty = command.app->parsed() ? check_values(*command.app) : std::nullopt) return report_error(*empty);
    try {
        for (const Command& command : commands)
            if (command.app->parsed()) return end_output(command.run());
    } catch (const std::filesystem::filesystem_error& error) {
        return report_error({ErrorCode::FileNotFound, fmt::format("cannot be examined: {}", error.code().message()), error.path1().string()});
    } catch (const std::system_error& error) { // of fmt::print
        return report_error({ErrorCode::CannotWrite, fmt::format("an output stream cannot be written: {}", error.what())});
    } catch (const std::bad_alloc&) { // files that are to be whole are written under another name first: none is half-written
        std::fputs("error: out of memory: this input needs more than the system grants; a smaller mesh or scene would do\n", stderr);
    } catch (const std::exception& error) {
        return report_error({ErrorCode::ToolFailed, fmt::format("a fault of this program ended the command: {}", error.what())});
    }
    return kExitBadInput;
}

} // namespace trocar::engine
