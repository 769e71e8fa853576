#include "engine/scene/check.hpp"

#include "engine/io/printable.hpp"
#include "engine/scene/nearest.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar::engine {
namespace {

constexpr std::size_t kMaxNameLength = 64;
constexpr double kLargestCount = 9007199254740992.0; // 2^53: beyond it integers are not exact

std::string in_quotes(std::string_view key) { return printable(fmt::format("\"{:.60}\"", key)); }

class Checker {
public:
    explicit Checker(CheckContext& context) : context_(context) {}

    std::optional<Error> object(const JsonNode& node, const ObjectSpec& spec, const std::string& path) {
        if (node.type != JsonType::Object) return mismatch(node, object_value(spec), path);
        if (auto error = unknown_key(node, spec, path)) return error;
        if (auto error = unused_key(node, spec, path)) return error;
        if (auto error = missing_key(node, spec, path)) return error; // before values: their ranges depend on the units
        const JsonNode* const outside = std::exchange(around_, &node);
        for (const JsonNode& member : node.children)
            if (auto error = value(member, spec.find(member.key)->value, join_key(path, member.key))) return error;
        around_ = outside;
        return std::nullopt;
    }

    std::optional<Error> value(const JsonNode& node, const ValueSpec& spec, const std::string& path) {
        context_.positions[path] = node.at;
        switch (spec.kind) {
        case ValueKind::Number:
            return number(node, spec, path);
        case ValueKind::Count:
            return count(node, spec, path);
        case ValueKind::Flag:
            return node.type == JsonType::Flag ? std::nullopt : mismatch(node, spec, path);
        case ValueKind::Text:
            return text(node, spec, path);
        case ValueKind::Path:
            return file(node, spec, path);
        case ValueKind::Choice:
            return choice(node, spec, path);
        case ValueKind::Vector:
            return vector(node, spec, spec.columns, path);
        case ValueKind::Rows:
            return rows(node, spec, path);
        case ValueKind::List:
            return list(node, spec, path);
        case ValueKind::Object:
            return object(node, *spec.object, path);
        case ValueKind::Map:
            return map(node, spec, path);
        case ValueKind::Alternatives:
            return alternatives(node, spec, path);
        case ValueKind::Any:
            return std::nullopt;
        }
        return std::nullopt;
    }

private:
    Error fail(TextPosition at, const std::string& path, std::string message) const {
        return error_at(context_, at, path, std::move(message));
    }

    std::optional<Error> mismatch(const JsonNode& node, const ValueSpec& spec, const std::string& path) const {
        return fail(node.at, path, fmt::format("found {}; expected {}", describe(node), expected(spec, context_.units)));
    }

    std::optional<Error> unknown_key(const JsonNode& node, const ObjectSpec& spec, const std::string& path) const {
        for (const JsonNode& member : node.children) {
            if (spec.find(member.key) != nullptr) continue;
            return fail(member.key_at, join_key(path, fmt::format("{:.60}", member.key)),
                        fmt::format("unknown key {}; {}", in_quotes(member.key), suggest("key", member.key, spec.keys())));
        }
        return std::nullopt;
    }

    /// Keys unused under the value of the discriminator, and a missing or wrong discriminator.
    std::optional<Error> unused_key(const JsonNode& node, const ObjectSpec& spec, const std::string& path) {
        if (spec.discriminator.empty()) return std::nullopt;
        const FieldSpec& field = *spec.find(spec.discriminator);
        const JsonNode* member = node.find(spec.discriminator);
        if (member == nullptr && field.is_required) return missing(node, field, path);
        const bool decided_beside = !spec.decided_by.empty() && around_ != nullptr && around_->find(spec.decided_by) != nullptr;
        if (member == nullptr && decided_beside) return std::nullopt;
        if (member != nullptr)
            if (auto error = value(*member, field.value, join_key(path, field.key))) return error;
        const std::string_view chosen = member != nullptr ? member->text : std::get<std::string_view>(field.otherwise);
        for (const JsonNode& other : node.children) {
            const std::vector<std::string_view>& used = spec.find(other.key)->used_when;
            if (used.empty() || std::find(used.begin(), used.end(), chosen) != used.end()) continue;
            return fail(other.key_at, join_key(path, other.key),
                        fmt::format("unused key {}: {} {}; the key is used where it is {}; expected it left out{}", in_quotes(other.key), spec.discriminator,
                                    member != nullptr ? fmt::format("is {} here", in_quotes(chosen)) : fmt::format("is not named here, which means {}", in_quotes(chosen)), fmt::join(used, " or "),
                                    member != nullptr ? "" : fmt::format(", or {} named", spec.discriminator)));
        }
        return std::nullopt;
    }

    std::optional<Error> missing_key(const JsonNode& node, const ObjectSpec& spec, const std::string& path) const {
        std::string_view chosen;
        if (!spec.discriminator.empty()) {
            const JsonNode* member = node.find(spec.discriminator);
            chosen = member != nullptr ? member->text : std::get<std::string_view>(spec.find(spec.discriminator)->otherwise); // see unused_key
        }
        for (const FieldSpec& field : spec.fields) {
            if (!field.is_required || node.find(field.key) != nullptr) continue;
            const bool used = field.used_when.empty() || std::find(field.used_when.begin(), field.used_when.end(), chosen) != field.used_when.end();
            if (used) return missing(node, field, path);
        }
        return std::nullopt;
    }

    Error missing(const JsonNode& node, const FieldSpec& field, const std::string& path) const {
        return fail(
            node.at, join_key(path, field.key),
            fmt::format("the key {} is missing; expected {}: {}", in_quotes(field.key), expected(field.value, context_.units), field.doc));
    }

    std::optional<Error> number(const JsonNode& node, const ValueSpec& spec, const std::string& path) {
        if (node.type != JsonType::Number) return mismatch(node, spec, path);
        return in_range(node, spec.dimension, spec.range, path);
    }

    std::optional<Error> count(const JsonNode& node, const ValueSpec& spec, const std::string& path) {
        if (node.type != JsonType::Number || node.number != std::floor(node.number) || std::abs(node.number) > kLargestCount)
            return mismatch(node, spec, path);
        return in_range(node, Dimension::None, spec.range, path);
    }

    std::optional<Error> in_range(const JsonNode& node, Dimension dimension, const Range& range, const std::string& path) {
        const double si = node.number * context_.units.factor(dimension);
        if (!range.contains(si))
            return fail(node.at, path, out_of_range(node, dimension, range, context_.units));
        if (si < range.usual_least || si > range.usual_most)
            context_.questions.push_back(fmt::format("{}: {} is unusual{}{}", path, with_unit(si, dimension, context_.units),
                                                     range.what.empty() ? "" : ": ", range.what));
        return std::nullopt;
    }

    std::optional<Error> text(const JsonNode& node, const ValueSpec& spec, const std::string& path) const {
        if (node.type != JsonType::Text) return mismatch(node, spec, path);
        if (node.text.empty()) return fail(node.at, path, "found an empty string; expected a name");
        if (has_control_characters(node.text)) // a terminal would interpret them, a zero byte would end a message
            return fail(node.at, path, fmt::format("found {}; expected text without control characters", in_quotes(node.text)));
        return std::nullopt;
    }

    std::optional<Error> file(const JsonNode& node, const ValueSpec& spec, const std::string& path) const {
        if (auto error = text(node, spec, path)) return error;
        const auto resolved = resolve_file(node.text, context_.folder);
        if (resolved) return std::nullopt;
        return error_at(context_, node.at, path, resolved.error().message, resolved.error().code);
    }

    std::optional<Error> choice(const JsonNode& node, const ValueSpec& spec, const std::string& path) const {
        if (node.type != JsonType::Text) return mismatch(node, spec, path);
        if (std::find(spec.choices.begin(), spec.choices.end(), node.text) != spec.choices.end()) return std::nullopt;
        return fail(node.at, path, fmt::format("found {}; {}", describe(node), suggest("value", node.text, spec.choices)));
    }

    std::optional<Error> vector(const JsonNode& node, const ValueSpec& spec, const std::vector<Column>& columns, const std::string& path) {
        if (node.type != JsonType::List || node.children.size() != columns.size()) return mismatch(node, spec, path);
        for (std::size_t i = 0; i < columns.size(); ++i) {
            const JsonNode& element = node.children[i];
            ValueSpec number_spec;
            number_spec.dimension = columns[i].dimension;
            number_spec.range = columns[i].range;
            if (auto error = number(element, number_spec, fmt::format("{}[{}]", path, i))) return error;
        }
        return std::nullopt;
    }

    std::optional<Error> rows(const JsonNode& node, const ValueSpec& spec, const std::string& path) {
        if (node.type != JsonType::List || bad_length(node, spec)) return mismatch(node, spec, path);
        ValueSpec row;
        row.kind = ValueKind::Vector;
        row.columns = spec.columns;
        for (std::size_t i = 0; i < node.children.size(); ++i)
            if (auto error = vector(node.children[i], row, spec.columns, fmt::format("{}[{}]", path, i))) return error;
        return std::nullopt;
    }

    static bool bad_length(const JsonNode& node, const ValueSpec& spec) {
        return node.children.size() < spec.least_count || node.children.size() > spec.most_count;
    }

    std::optional<Error> list(const JsonNode& node, const ValueSpec& spec, const std::string& path) {
        if (node.type != JsonType::List || bad_length(node, spec)) return mismatch(node, spec, path);
        for (std::size_t i = 0; i < node.children.size(); ++i)
            if (auto error = value(node.children[i], spec.alternatives.front(), fmt::format("{}[{}]", path, i))) return error;
        return std::nullopt;
    }

    std::optional<Error> map(const JsonNode& node, const ValueSpec& spec, const std::string& path) {
        if (node.type != JsonType::Object) return mismatch(node, spec, path);
        for (const JsonNode& member : node.children) {
            if (!spec.any_names && !is_name(member.key))
                return fail(
                    member.key_at, path,
                    fmt::format("found the name {}; expected up to {} letters, digits, - and _", in_quotes(member.key), kMaxNameLength));
            if (auto error = value(member, spec.alternatives.front(), join_key(path, member.key))) return error;
        }
        return std::nullopt;
    }

    static bool is_name(std::string_view name) {
        const auto allowed = [](char c) {
            return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
        };
        return !name.empty() && name.size() <= kMaxNameLength && std::all_of(name.begin(), name.end(), allowed);
    }

    std::optional<Error> alternatives(const JsonNode& node, const ValueSpec& spec, const std::string& path) {
        if (const ValueSpec* chosen = choose_alternative(node, spec)) return value(node, *chosen, path);
        std::vector<std::string_view> markers, found;
        for (const ValueSpec& one : spec.alternatives)
            if (one.object != nullptr) markers.push_back(one.object->marker);
        if (node.type != JsonType::Object || markers.empty()) return mismatch(node, spec, path);
        for (const std::string_view marker : markers)
            if (node.find(marker) != nullptr) found.push_back(marker);
        if (found.size() > 1)
            return fail(node.find(found[1])->key_at, path,
                        fmt::format("the keys {} exclude each other; expected one of them", fmt::join(found, " and ")));
        for (const JsonNode& member : node.children)
            if (!known_in_some(member.key, spec))
                return fail(member.key_at, join_key(path, fmt::format("{:.60}", member.key)),
                            fmt::format("unknown key {}; {}", in_quotes(member.key), suggest("key", member.key, markers)));
        return fail(node.at, path, fmt::format("found no key that says what this is; expected one of {}", fmt::join(markers, ", ")));
    }

    static bool known_in_some(std::string_view key, const ValueSpec& spec) {
        return std::any_of(spec.alternatives.begin(), spec.alternatives.end(),
                           [&](const ValueSpec& one) { return one.object != nullptr && one.object->find(key) != nullptr; });
    }

    CheckContext& context_;
    const JsonNode* around_ = nullptr; // the object whose member is being checked
};

bool takes(const ValueSpec& value, JsonType type) {
    switch (value.kind) {
    case ValueKind::Number:
    case ValueKind::Count:
        return type == JsonType::Number;
    case ValueKind::Flag:
        return type == JsonType::Flag;
    case ValueKind::Text:
    case ValueKind::Path:
    case ValueKind::Choice:
        return type == JsonType::Text;
    case ValueKind::Vector:
    case ValueKind::Rows:
    case ValueKind::List:
        return type == JsonType::List;
    case ValueKind::Object:
    case ValueKind::Map:
        return type == JsonType::Object;
    case ValueKind::Alternatives:
        return false;
    case ValueKind::Any:
        return true;
    }
    return false;
}

} // namespace

std::string join_key(std::string_view path, std::string_view key) {
    return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

Error error_at(const CheckContext& context, TextPosition at, std::string key, std::string message, ErrorCode code) {
    return {code, std::move(message), context.file_name, at.line, at.column, std::move(key)};
}

const ValueSpec* choose_alternative(const JsonNode& node, const ValueSpec& value) {
    const ValueSpec *marked = nullptr, *unmarked = nullptr;
    for (const ValueSpec& one : value.alternatives) {
        if (!takes(one, node.type)) continue;
        if (one.kind != ValueKind::Object || one.object->marker.empty()) return &one;
        if (node.find(one.object->marker) != nullptr) {
            if (marked != nullptr) return nullptr;
            marked = &one;
        } else if (!one.object->find(one.object->marker)->is_required)
            unmarked = &one;
    }
    return marked != nullptr ? marked : unmarked;
}

std::optional<Error> check_object(const JsonNode& node, const ObjectSpec& spec, const std::string& path, CheckContext& context) {
    context.positions[path] = node.at;
    return Checker(context).object(node, spec, path);
}

} // namespace trocar::engine
