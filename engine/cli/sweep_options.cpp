#include "engine/cli/sweep_options.hpp"

#include "engine/cli/commands.hpp"
#include "engine/episodes/make_policy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

namespace trocar::engine {
namespace {

constexpr std::size_t kMostTried = 2000; // values of a varied option whose command line is checked beforehand
constexpr const char* kOwn = "found {}, which is the sweep's own affair; expected it left out";

Error at_options(const SweepSpec& spec, std::string message) {
    return {ErrorCode::BadUsage, std::move(message), spec.file.string(), spec.options_at.line, spec.options_at.column, "options"};
}

/// value  none: the pointer itself
Error at_axis(const SweepAxis& axis, std::size_t pointer, std::optional<std::size_t> value, std::string message) {
    const TextPosition at = !value || axis.value_at.empty() ? axis.pointer_at[pointer] : axis.value_at[*value];
    return {ErrorCode::BadUsage, std::move(message), axis.file, at.line, at.column, axis.pointers[pointer]};
}

/// A word that the sweep itself gives to every run.
bool is_own(const std::string& word) {
    for (const char* own : {"--out", "--force", "--quiet", "--resume", "--only", "--parent", "--set", "--no-report", "--help", "-h"})
        if (word == own || word.starts_with(std::string(own) + "=")) return true;
    return false;
}

Result<void> check_words(const SweepSpec& spec) {
    for (const std::string& word : spec.options)
        if (is_own(word)) return at_options(spec, fmt::format(kOwn, word));
    for (const SweepAxis& axis : spec.axes)
        for (std::size_t p = 0; p < axis.pointers.size(); ++p) {
            const std::string& pointer = axis.pointers[p];
            if (is_own(pointer)) return at_axis(axis, p, std::nullopt, fmt::format(kOwn, pointer));
            for (const std::string& word : spec.options)
                if ((word == "--budget" && pointer.starts_with("/budget")) || word == pointer)
                    return at_options(spec, fmt::format("found {}, and {} is varied; expected one of them", word, pointer));
        }
    return {};
}

/// Every value of a varied option, beside the first values of the others.
Result<void> check_varied(const SweepSpec& spec, const SweepPlan& plan) {
    PlannedRun run = plan.run(0);
    if (const auto taken = check_command_line(plan.command_line(run, "out")); !taken)
        return at_options(spec, fmt::format("{} does not take them: {}", command_name(spec.command), taken.error().to_string()));
    for (const SweepAxis& axis : spec.axes)
        for (std::size_t p = 0; p < axis.pointers.size(); ++p) {
            if (!is_option(axis.pointers[p])) continue;
            for (std::size_t k = 0; k < std::min(axis.values.size(), kMostTried); ++k) {
                for (auto& [name, value] : run.settings)
                    if (name == axis.pointers[p]) value = axis.values[k][p];
                if (const auto taken = check_command_line(plan.command_line(run, "out")); !taken)
                    return at_axis(axis, p, k, fmt::format("{} does not take it: {}", command_name(spec.command), taken.error().to_string()));
            }
        }
    return {};
}

/// A bad policy would fail in each of its episodes. Empty: it can be loaded.
std::string refuse_policy(const SweepSpec& spec, const std::string& policy) {
    const auto fits = check_policy(policy, spec.folder(), PolicyCheck::Import);
    if (fits) return {};
    return (fits.error().file.empty() ? "" : fits.error().file + ": ") + fits.error().message;
}

Result<void> check_policies(const SweepSpec& spec) {
    for (std::size_t i = 0; i < spec.options.size(); ++i) {
        const std::string& word = spec.options[i];
        const bool is_next = word == "--policy" && i + 1 < spec.options.size();
        if (!is_next && !word.starts_with("--policy=")) continue;
        const std::string refused = refuse_policy(spec, is_next ? spec.options[i + 1] : word.substr(word.find('=') + 1));
        if (!refused.empty()) return at_options(spec, refused);
    }
    std::set<std::string> known;
    for (const SweepAxis& axis : spec.axes)
        for (std::size_t p = 0; p < axis.pointers.size(); ++p)
            for (std::size_t k = 0; axis.pointers[p] == "--policy" && k < axis.values.size(); ++k) {
                const std::string policy = value_text(axis.values[k][p]);
                if (!known.insert(policy).second) continue;
                if (const std::string refused = refuse_policy(spec, policy); !refused.empty()) return at_axis(axis, p, k, refused);
            }
    return {};
}

} // namespace

Result<void> check_sweep_options(const SweepSpec& spec, const SweepPlan& plan) {
    if (const auto fits = check_words(spec); !fits) return fits;
    if (const auto fits = check_varied(spec, plan); !fits) return fits;
    return spec.command == SweepCommand::Episode ? check_policies(spec) : Result<void>();
}

} // namespace trocar::engine
