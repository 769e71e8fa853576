// Members of a message from the page, each checked as it is read.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"
#include "engine/io/printable.hpp"
#include "engine/io/shown.hpp"
#include "engine/viewer/command.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>

namespace trocar::engine::viewer {

using Parsed = nlohmann::json;

/// m; nothing that can be pulled is larger.
inline constexpr double kFurthestTarget = 10.0;
/// Of weights that a page computed.
inline constexpr double kWeightRounding = 1e-3;

/// One message's members, each read once; the first error is kept, and an unread member is one.
class Members {
public:
    explicit Members(const Parsed& object) : object_(object) { asked_.insert("type"); }

    double number(const char* key, double least, double most) {
        const Parsed* value = find(key);
        if (value == nullptr) return least;
        const double number = value->is_number() ? value->get<double>() : std::nan("");
        if (number >= least && number <= most) return number;
        complain(fmt::format("\"{}\" is {}; expected a number from {:g} to {:g}", key, text_of(*value), least, most));
        return least;
    }
    std::uint64_t whole(const char* key, std::uint64_t least, std::uint64_t most) {
        const Parsed* value = find(key);
        if (value == nullptr) return least;
        if (value->is_number_unsigned())
            if (const auto number = value->get<std::uint64_t>(); number >= least && number <= most) return number;
        complain(fmt::format("\"{}\" is {}; expected an integer from {} to {}", key, text_of(*value), least, most));
        return least;
    }
    bool flag(const char* key) {
        const Parsed* value = find(key);
        if (value == nullptr) return false;
        if (!value->is_boolean()) complain(fmt::format("\"{}\" is {}; expected true or false", key, text_of(*value)));
        return value->is_boolean() && value->get<bool>();
    }
    std::string word(const char* key) {
        const Parsed* value = find(key);
        if (value == nullptr) return {};
        if (!value->is_string()) complain(fmt::format("\"{}\" is {}; expected a text", key, text_of(*value)));
        return value->is_string() ? value->get<std::string>() : std::string();
    }
    Vec3 point(const char* key) {
        const Parsed* value = find(key);
        Vec3 point = Vec3::Zero();
        if (value == nullptr) return point;
        bool good = value->is_array() && value->size() == 3;
        for (std::size_t axis = 0; good && axis < 3; ++axis) {
            good = (*value)[axis].is_number() && std::abs((*value)[axis].get<double>()) <= kFurthestTarget;
            if (good) point[static_cast<int>(axis)] = (*value)[axis].get<double>();
        }
        if (!good) complain(fmt::format("\"{}\" is {}; expected three numbers in metres", key, text_of(*value)));
        return point;
    }
    /// Three, of which each is at least 0, and their sum 1 but for rounding: the sum of what is returned is 1.
    std::array<double, 3> weights(const char* key) {
        const Parsed* value = find(key);
        std::array<double, 3> weights{1.0, 0.0, 0.0};
        if (value == nullptr) return weights;
        bool good = value->is_array() && value->size() == 3;
        double sum = 0.0;
        for (std::size_t k = 0; good && k < 3; ++k) {
            good = (*value)[k].is_number() && (*value)[k].get<double>() >= -kWeightRounding && (*value)[k].get<double>() <= 1.0 + kWeightRounding;
            if (good) sum += weights[k] = std::max(0.0, (*value)[k].get<double>());
        }
        good = good && std::abs(sum - 1.0) <= kWeightRounding;
        if (!good) complain(fmt::format("\"{}\" is {}; expected three numbers from 0 to 1, with the sum 1", key, text_of(*value)));
        for (double& weight : weights) weight = good ? weight / sum : 0.0;
        return weights;
    }
    /// Of something that is kept under it.
    std::string name(const char* key) {
        const std::string name = word(key);
        if (name.empty() || name.size() > kLongestStateName || has_control_characters(name))
            complain(fmt::format("\"{}\" is \"{}\"; expected 1 to {} bytes, and no control characters", key, shown(name), kLongestStateName));
        return name;
    }
    void complain(std::string what) {
        if (!error_) error_ = Error{ErrorCode::BadValue, std::move(what)};
    }
    /// The error, also for members that were not read.
    [[nodiscard]] std::optional<Error> finish() {
        for (const auto& member : object_.items())
            if (!asked_.contains(member.key())) complain(fmt::format("\"{}\" means nothing here", shown(member.key())));
        return error_;
    }

private:
    const Parsed* find(const char* key) {
        asked_.insert(key);
        const auto found = object_.find(key);
        if (found != object_.end()) return &*found;
        complain(fmt::format("\"{}\" is missing", key));
        return nullptr;
    }
    static std::string text_of(const Parsed& value) { return shown(value.dump(-1, ' ', true, Parsed::error_handler_t::replace)); }

    const Parsed& object_;
    std::set<std::string, std::less<>> asked_;
    std::optional<Error> error_;
};

} // namespace trocar::engine::viewer
