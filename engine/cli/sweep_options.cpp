#include "engine/cli/sweep_options.hpp"

#include "engine/cli/commands.hpp"
#include "engine/episodes/make_policy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <optional>
#include <set>

namespace trocar::engine {
namespace {

constexpr std::size_t kMostTried = 2000; // values of a varied option whose command line is checked beforehand
constexpr std::string_view kBudget = "--budget";
constexpr const char* kOwn = "found {}, which is the sweep's own affair; expected it left out";

Error at_options(const SweepSpec& spec, std::string message) {
    return {ErrorCode::BadUsage, std::move(message), spec.file.string(), spec.options_at.line, spec.options_at.column, "options"};
}

/// value  none: the pointer itself
Error at_axis(const SweepAxis& axis, std::size_t pointer, std::optional<std::size_t> value, std::string message) {
    const TextPosition at = axis.place(pointer, value);
    return {ErrorCode::BadUsage, std::move(message), axis.file, at.line, at.column, axis.pointers[pointer]};
}

/// A word that the sweep itself gives to every run.
bool is_own(const std::string& word) {
    for (const char* own : {"--out", "--force", "--quiet", "--resume", "--only", "--parent", "--set", "--no-report", "--help", "-h"})
        if (word == own || word.starts_with(std::string(own) + "=")) return true;
    return false;
}

bool varies(const SweepSpec& spec, std::string_view name) {
    for (const SweepAxis& axis : spec.axes)
        if (std::find(axis.pointers.begin(), axis.pointers.end(), name) != axis.pointers.end()) return true;
    return false;
}

/// Would this option of every run take the place of what is varied?
bool decides(const std::string& option, const std::string& pointer) {
    return option == pointer || (option == "-n" && pointer == "--steps") || (option == kBudget && pointer.starts_with("/budget"));
}

Result<void> check_words(const SweepSpec& spec) {
    for (const std::string& word : spec.options) {
        if (is_own(word)) return at_options(spec, fmt::format(kOwn, word));
        if (word.starts_with("--record-grants"))
            return at_options(spec, fmt::format("found {}, and every run would write the same file; expected it left out", word));
    }
    for (const SweepAxis& axis : spec.axes)
        for (std::size_t p = 0; p < axis.pointers.size(); ++p) {
            const std::string& pointer = axis.pointers[p];
            if (is_own(pointer)) return at_axis(axis, p, std::nullopt, fmt::format(kOwn, pointer));
            if (pointer.starts_with("/budget") && varies(spec, kBudget))
                return at_axis(axis, p, std::nullopt, fmt::format("{} is varied, too, and would decide alone; expected one of them", kBudget));
            for (const std::string& word : spec.options)
                if (const std::string name = word.substr(0, word.find('=')); decides(name, pointer))
                    return at_options(spec, fmt::format("found {}, and {} is varied; expected one of them", name, pointer));
        }
    return {};
}

/// What the command says against a varied option: its value, or its name.
Error refuse_varied(const SweepSpec& spec, const SweepAxis& axis, std::size_t pointer, std::size_t value, const Error& said) {
    const bool is_value = said.key == axis.pointers[pointer];
    return at_axis(axis, pointer, is_value ? std::optional(value) : std::nullopt,
                   is_value ? said.message : fmt::format("{} does not take it: {}", command_name(spec.command), said.to_string()));
}

/// The first values of all varied options; where they are refused, which one is to blame.
Result<void> check_first(const SweepSpec& spec, const SweepPlan& plan) {
    PlannedRun run = plan.run(0);
    if (check_command_line(plan.command_line(run, "out"))) return {};
    std::erase_if(run.settings, [](const auto& setting) { return is_option(setting.first); });
    if (const auto taken = check_command_line(plan.command_line(run, "out")); !taken)
        return at_options(spec, fmt::format("{} does not take them: {}", command_name(spec.command), taken.error().to_string()));
    for (const SweepAxis& axis : spec.axes)
        for (std::size_t p = 0; p < axis.pointers.size(); ++p) {
            if (!is_option(axis.pointers[p])) continue;
            run.settings.emplace_back(axis.pointers[p], axis.values[0][p]);
            if (const auto taken = check_command_line(plan.command_line(run, "out")); !taken) return refuse_varied(spec, axis, p, 0, taken.error());
        }
    return {};
}

/// Every value of a varied option, beside the first values of the others.
Result<void> check_varied(const SweepSpec& spec, const SweepPlan& plan) {
    if (auto first = check_first(spec, plan); !first) return first;
    for (const SweepAxis& axis : spec.axes)
        for (std::size_t p = 0; p < axis.pointers.size(); ++p) {
            if (!is_option(axis.pointers[p])) continue;
            PlannedRun run = plan.run(0);
            for (std::size_t k = 0; k < std::min(axis.values.size(), kMostTried); ++k) {
                for (auto& [name, value] : run.settings)
                    if (name == axis.pointers[p]) value = axis.values[k][p];
                if (const auto taken = check_command_line(plan.command_line(run, "out")); !taken) return refuse_varied(spec, axis, p, k, taken.error());
            }
        }
    return {};
}

/// What a word of the options gives to the option `name`: the next one, or what follows its "="; empty: it does not name it.
std::string value_after(const std::vector<std::string>& words, std::size_t word, std::string_view name) {
    if (words[word] == name) return word + 1 < words.size() ? words[word + 1] : std::string();
    return words[word].starts_with(std::string(name) + "=") ? words[word].substr(name.size() + 1) : std::string();
}

/// Every value of an option that has to be looked at before anything runs.
/// refuse  what is wrong with a value; empty: nothing
Result<void> check_values_of(const SweepSpec& spec, std::string_view name, const std::function<std::string(const std::string&)>& refuse) {
    for (std::size_t i = 0; i < spec.options.size(); ++i)
        if (const std::string value = value_after(spec.options, i, name); !value.empty())
            if (const std::string refused = refuse(value); !refused.empty()) return at_options(spec, refused);
    std::set<std::string> known;
    for (const SweepAxis& axis : spec.axes)
        for (std::size_t p = 0; p < axis.pointers.size(); ++p)
            for (std::size_t k = 0; axis.pointers[p] == name && k < axis.values.size(); ++k) {
                const std::string value = value_text(axis.values[k][p]);
                if (!known.insert(value).second) continue;
                if (const std::string refused = refuse(value); !refused.empty()) return at_axis(axis, p, k, refused);
            }
    return {};
}

/// A bad policy would fail in each of its episodes. Empty: it can be loaded.
std::string refuse_policy(const SweepSpec& spec, const std::string& policy) {
    const auto fits = check_policy(policy, spec.folder(), PolicyCheck::Import);
    if (fits) return {};
    return (fits.error().file.empty() ? "" : fits.error().file + ": ") + fits.error().message;
}

std::string refuse_path(const SweepSpec& spec, const std::string& path) {
    std::error_code none;
    if (std::filesystem::exists(spec.folder() / path, none)) return {};
    return fmt::format("the file \"{:.200}\" does not exist; expected a file relative to the sweep's folder", path);
}

} // namespace

Result<void> check_sweep_options(const SweepSpec& spec, const SweepPlan& plan) {
    if (const auto fits = check_words(spec); !fits) return fits;
    if (const auto fits = check_varied(spec, plan); !fits) return fits;
    if (auto fits = check_values_of(spec, "--path", [&](const std::string& path) { return refuse_path(spec, path); }); !fits) return fits;
    return check_values_of(spec, "--policy", [&](const std::string& policy) { return refuse_policy(spec, policy); });
}

} // namespace trocar::engine
