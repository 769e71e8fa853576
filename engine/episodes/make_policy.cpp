#include "engine/episodes/make_policy.hpp"

#include "engine/episodes/python_policy.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace trocar::engine {
namespace {

class RandomPolicy final : public Policy {
public:
    /// Of another sequence than the episode's own draws.
    RandomPolicy(const SceneModel& model, std::uint64_t seed) : model_(model), random_(~seed) {}

    Result<void> act(std::span<const float>, std::span<double> action) override {
        for (std::size_t i = 0; i < model_.instruments.size(); ++i) {
            const DriveLimits& limits = model_.instruments[i].limits;
            action[2 * i] = random_.uniform(-kMillimetre * limits.speed, kMillimetre * limits.speed);
            action[2 * i + 1] = random_.uniform(-limits.rotation, limits.rotation);
        }
        return {};
    }

private:
    const SceneModel& model_;
    anatomy::Random random_;
};

class AdvancePolicy final : public Policy {
public:
    explicit AdvancePolicy(const SceneModel& model) : model_(model) {}

    Result<void> act(std::span<const float>, std::span<double> action) override {
        std::fill(action.begin(), action.end(), 0.0);
        action[2 * kLeadInstrument] = kMillimetre * model_.instruments[kLeadInstrument].limits.speed;
        return {};
    }

private:
    const SceneModel& model_;
};

/// FILE.py:FUNCTION; nothing where the text names no file of Python.
std::optional<PythonFunction> python_function(const std::string& text, const std::filesystem::path& folder) {
    PythonFunction function{text, "act"};
    if (const std::size_t colon = text.rfind(".py:"); colon != std::string::npos) function = {text.substr(0, colon + 3), text.substr(colon + 4)};
    if (function.file.extension() != ".py" || function.name.empty()) return std::nullopt;
    function.file = (folder / function.file).lexically_normal();
    return function;
}

} // namespace

Result<std::unique_ptr<Policy>> make_policy(const std::string& text, const std::filesystem::path& folder, const Environment& environment, std::uint64_t seed) {
    if (const auto known = check_policy(text, folder, PolicyCheck::Name); !known) return known.error();
    const SceneModel& model = environment.task().model();
    if (text == "random") return std::unique_ptr<Policy>(std::make_unique<RandomPolicy>(model, seed));
    if (text == "advance") return std::unique_ptr<Policy>(std::make_unique<AdvancePolicy>(model));
    return make_python_policy(*python_function(text, folder), environment, seed);
}

Result<void> check_policy(const std::string& text, const std::filesystem::path& folder, PolicyCheck check) {
    if (text == "random" || text == "advance") return {};
    const auto function = python_function(text, folder);
    if (!function)
        return Error{ErrorCode::BadUsage, fmt::format("found \"{:.100}\"; expected random, advance, or a file as in policy.py or policy.py:function", text), {}, 0, 0, "--policy"};
    std::error_code none;
    if (!std::filesystem::is_regular_file(function->file, none))
        return Error{ErrorCode::FileNotFound, "does not exist; expected a file with a policy in Python", function->file.string(), 0, 0, "--policy"};
    return check == PolicyCheck::Import ? check_python_function(*function) : Result<void>();
}

} // namespace trocar::engine
