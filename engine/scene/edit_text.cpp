#include "engine/scene/edit_text.hpp"

#include "engine/io/shown.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <optional>

namespace trocar::engine {

namespace {

/// Bytes from begin to end of the text.
struct Extent {
    std::size_t begin = 0, end = 0;
};

/// Walks over JSON that was parsed before, comments allowed: it is known to be well formed.
class Walker {
public:
    explicit Walker(std::string_view text) : text_(text) {}

    /// The first byte from `at` on that is neither blank nor part of a comment.
    [[nodiscard]] std::size_t skip_blanks(std::size_t at) const {
        for (;;) {
            if (at < text_.size() && std::string_view(" \t\r\n\xEF\xBB\xBF").find(text_[at]) != std::string_view::npos)
                ++at;
            else if (text_.substr(at, 2) == "//")
                at = std::min(text_.find('\n', at), text_.size());
            else if (text_.substr(at, 2) == "/*")
                at = text_.find("*/", at + 2) + 2;
            else
                return at;
        }
    }

    /// One past the value that begins at `at`.
    [[nodiscard]] std::size_t skip_value(std::size_t at) const {
        if (text_[at] == '"') return skip_string(at);
        if (text_[at] != '{' && text_[at] != '[') return std::min(text_.find_first_of(",]} \t\r\n/", at), text_.size());
        std::size_t depth = 0;
        do {
            at = skip_blanks(at);
            if (text_[at] == '"') {
                at = skip_string(at);
                continue;
            }
            if (text_[at] == '{' || text_[at] == '[') ++depth;
            if (text_[at] == '}' || text_[at] == ']') --depth;
            ++at;
        } while (depth > 0);
        return at;
    }

    /// The value of an object's member, and of every member before it.
    /// last  the end of the last value that was passed; none: the object is empty
    [[nodiscard]] std::optional<Extent> find_member(std::size_t object, std::string_view key, std::optional<Extent>& last) const {
        for (std::size_t at = skip_blanks(object + 1); text_[at] != '}'; at = skip_blanks(at)) {
            if (text_[at] == ',') {
                ++at;
                continue;
            }
            const std::size_t after_key = skip_string(at);
            const std::string name = nlohmann::json::parse(text_.substr(at, after_key - at)).get<std::string>();
            const std::size_t value = skip_blanks(skip_blanks(after_key) + 1); // behind the colon
            const Extent extent{value, skip_value(value)};
            if (name == key) return extent;
            last = Extent{at, extent.end};
            at = extent.end;
        }
        return std::nullopt;
    }

private:
    [[nodiscard]] std::size_t skip_string(std::size_t at) const {
        for (++at; text_[at] != '"'; ++at)
            if (text_[at] == '\\') ++at;
        return at + 1;
    }

    std::string_view text_;
};

/// The value within objects that are made for the keys.
std::string nest(std::span<const std::string> keys, std::string_view value) {
    std::string text;
    for (const std::string& key : keys) text += fmt::format("{{{}: ", json_string(key));
    return text + std::string(value) + std::string(keys.size(), '}');
}

/// Blanks at the start of the line that `at` stands in; none: something stands before it.
std::optional<std::string> indent_of(std::string_view text, std::size_t at) {
    const std::size_t line = text.rfind('\n', at) + 1;
    const std::string_view before = text.substr(line, at - line);
    if (line == 0 || before.find_first_not_of(" \t") != std::string_view::npos) return std::nullopt;
    return std::string(before);
}

/// As the last member, in a line of its own where the one before it has one.
std::string add_member(std::string_view text, std::size_t object, const std::optional<Extent>& last, const std::string& member) {
    std::string out(text);
    if (!last) return out.insert(object + 1, member);
    const auto indent = indent_of(text, last->begin);
    const std::size_t brace = Walker(text).skip_blanks(last->end);
    const std::size_t end = indent ? text.find_last_not_of(" \t\r\n", brace - 1) + 1 : last->end; // behind a comment of the last one
    out.insert(end, indent ? fmt::format("{}\n{}{}", end == last->end ? "," : "", *indent, member) : ", " + member);
    if (end != last->end) out.insert(last->end, ",");
    return out;
}

} // namespace

std::string json_string(std::string_view text) { return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace); }

Result<std::string> set_json_value(std::string_view text, std::span<const std::string> keys, std::string_view value) {
    const Walker walker(text);
    std::size_t object = walker.skip_blanks(0);
    for (std::size_t k = 0; k < keys.size(); ++k) {
        if (text[object] != '{')
            return Error{ErrorCode::BadValue, fmt::format("found no object for the key \"{}\" to be set in", shown(keys[k]))};
        std::optional<Extent> last;
        const auto found = walker.find_member(object, keys[k], last);
        if (!found) return add_member(text, object, last, fmt::format("{}: {}", json_string(keys[k]), nest(keys.subspan(k + 1), value)));
        if (k + 1 == keys.size()) return std::string(text).replace(found->begin, found->end - found->begin, value);
        object = found->begin;
    }
    return std::string(text);
}

} // namespace trocar::engine
