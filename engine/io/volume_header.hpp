// Text headers of label maps: numbers out of their values, with the key in every error.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"
#include "engine/io/shown.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine::volume {

inline constexpr std::size_t kMostHeaderBytes = std::size_t{4} << 20; // segments' names and colours included

inline std::string_view strip(std::string_view text) {
    const std::size_t first = text.find_first_not_of(" \t\r\n");
    if (first == text.npos) return {};
    return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

inline std::string lower(std::string_view text) {
    std::string small(text);
    for (char& c : small)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return small;
}

inline std::vector<std::string_view> words_of(std::string_view text) {
    std::vector<std::string_view> words;
    while (!(text = strip(text)).empty()) {
        const std::size_t end = std::min(text.find_first_of(" \t\r\n"), text.size());
        words.push_back(text.substr(0, end));
        text.remove_prefix(end);
    }
    return words;
}

template <class Number>
bool parse_number(std::string_view word, Number& number) {
    if (!word.empty() && word.front() == '+') word.remove_prefix(1);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
    return error == std::errc() && end == word.data() + word.size();
}

/// Exactly `count` numbers, finite where they are real.
template <class Number>
bool parse_numbers(std::string_view text, std::size_t count, std::vector<Number>& numbers) {
    const std::vector<std::string_view> words = words_of(text);
    if (words.size() != count) return false;
    for (const std::string_view word : words) {
        Number number{};
        if (!parse_number(word, number)) return false;
        if constexpr (std::is_floating_point_v<Number>)
            if (!std::isfinite(number)) return false;
        numbers.push_back(number);
    }
    return true;
}

/// Keys and values of a text header, and where they stand.
class HeaderFields {
public:
    explicit HeaderFields(std::string file) : file_(std::move(file)) {}
    /// Returns whether the key is new.
    bool add(const std::string& key, std::string value, std::size_t line) { return fields_.try_emplace(key, Field{std::move(value), line}).second; }
    [[nodiscard]] bool has(const std::string& key) const { return fields_.contains(key); }
    /// Empty where there is none.
    [[nodiscard]] std::string get(const std::string& key) const {
        const auto found = fields_.find(key);
        return found == fields_.end() ? std::string() : found->second.value;
    }
    [[nodiscard]] Error bad(const std::string& key, std::string message) const {
        const auto found = fields_.find(key);
        return {ErrorCode::BadValue, std::move(message), file_, found == fields_.end() ? 0 : found->second.line, 0, key};
    }

private:
    struct Field {
        std::string value;
        std::size_t line = 0;
    };
    std::string file_;
    std::map<std::string, Field> fields_;
};

} // namespace trocar::engine::volume
