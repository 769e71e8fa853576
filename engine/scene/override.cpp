#include "engine/scene/override.hpp"

#include "engine/scene/check.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/scene_table.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace trocar::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostKeys = kMaxJsonDepth; // deeper pointers lead nowhere in a scene

Json to_json(const JsonNode& node) {
    switch (node.type) {
    case JsonType::Null:
        return nullptr;
    case JsonType::Flag:
        return node.flag;
    case JsonType::Number:
        if (std::int64_t whole = 0; node.text.find_first_of(".eE") == std::string::npos) {
            const auto end = std::from_chars(node.text.data(), node.text.data() + node.text.size(), whole);
            if (end.ec == std::errc() && end.ptr == node.text.data() + node.text.size()) return whole;
        }
        return node.number;
    case JsonType::Text:
        return node.text;
    case JsonType::List: {
        Json list = Json::array();
        for (const JsonNode& child : node.children) list.push_back(to_json(child));
        return list;
    }
    case JsonType::Object: {
        Json object = Json::object();
        for (const JsonNode& child : node.children) object[child.key] = to_json(child);
        return object;
    }
    }
    return nullptr;
}

/// The value lies in no line of the scene.
void forget_positions(JsonNode& node) {
    node.at = node.key_at = {};
    for (JsonNode& child : node.children) forget_positions(child);
}

/// One walk from the root along the keys of a pointer, the table beside it.
class Walk {
public:
    Walk(const SceneOverride& override, std::vector<std::string> keys) : override_(override), keys_(std::move(keys)) {}

    std::optional<Error> put(JsonNode& root) {
        ValueSpec scene = object_value(scene_table());
        return step(&root, scene, 0);
    }

private:
    [[nodiscard]] std::string path_to(std::size_t count) const {
        std::string path;
        for (std::size_t i = 0; i < count; ++i) path += "/" + keys_[i];
        return path.empty() ? "the scene" : path;
    }

    Error fail(std::string message) const {
        return {ErrorCode::BadValue, std::move(message), {}, 0, 0, fmt::format("{:.200}", override_.pointer)};
    }

    /// node  where `count` keys have led
    std::optional<Error> step(JsonNode* node, const ValueSpec& spec, std::size_t count) {
        if (count == keys_.size()) {
            replace(*node);
            return std::nullopt;
        }
        const ValueSpec* chosen = choose(*node, spec, keys_[count]);
        if (chosen == nullptr || chosen->kind == ValueKind::Any)
            return fail(fmt::format("{} is {} here and has no \"{:.60}\"; expected {} itself, or an object there in the scene", path_to(count),
                                    describe(*node), keys_[count], path_to(count)));
        switch (chosen->kind) {
        case ValueKind::Object:
            return enter_object(*node, *chosen->object, count);
        case ValueKind::Map:
            return enter_map(*node, *chosen, count);
        case ValueKind::List:
            return enter_list(*node, chosen->alternatives.front(), count);
        case ValueKind::Rows:
        case ValueKind::Vector:
            return enter_numbers(*node, *chosen, count);
        default:
            return fail(fmt::format("{} is {}, which has nothing called \"{:.60}\"; expected the pointer to end there", path_to(count),
                                    expected(*chosen, Units{}), keys_[count]));
        }
    }

    /// The alternative that is there; of one that is made here, the first with such a key.
    static const ValueSpec* choose(const JsonNode& node, const ValueSpec& spec, std::string_view key) {
        if (spec.kind != ValueKind::Alternatives) return &spec;
        if (node.type != JsonType::Null) {
            const ValueSpec* chosen = choose_alternative(node, spec);
            const bool fits = chosen != nullptr && (node.type == JsonType::Object || node.type == JsonType::List);
            return fits ? chosen : nullptr;
        }
        for (const ValueSpec& one : spec.alternatives)
            if (one.object != nullptr && one.object->find(key) != nullptr) return &one;
        return nullptr;
    }

    std::optional<Error> enter_object(JsonNode& node, const ObjectSpec& object, std::size_t count) {
        const FieldSpec* field = object.find(keys_[count]);
        if (field == nullptr)
            return fail(refuse_unknown(count == 0 ? "key of a scene" : fmt::format("key of {}", path_to(count)), keys_[count], object.keys()));
        if (node.type == JsonType::Null) node.type = JsonType::Object; // made here
        if (node.type != JsonType::Object)
            return fail(fmt::format("{} is {} here; expected an object there in the scene", path_to(count), describe(node)));
        const auto there = std::find_if(node.children.begin(), node.children.end(), [&](const JsonNode& c) { return c.key == keys_[count]; });
        if (there != node.children.end()) return step(&*there, field->value, count + 1);
        JsonNode made; // null until a key is put into it
        made.key = keys_[count];
        node.children.push_back(std::move(made));
        return step(&node.children.back(), field->value, count + 1);
    }

    std::optional<Error> enter_map(JsonNode& node, const ValueSpec& map, std::size_t count) {
        std::vector<std::string_view> names;
        for (const JsonNode& member : node.children) names.push_back(member.key);
        for (JsonNode& member : node.children)
            if (member.key == keys_[count]) return step(&member, map.alternatives.front(), count + 1);
        return fail(refuse_unknown(fmt::format("name in {}", path_to(count)), keys_[count], names));
    }

    /// fails  no such element
    Result<JsonNode*> element(JsonNode& node, std::size_t count) const {
        std::size_t index = 0;
        const std::string& key = keys_[count];
        const auto end = std::from_chars(key.data(), key.data() + key.size(), index);
        const bool is_index = end.ec == std::errc() && end.ptr == key.data() + key.size() && (key == "0" || key.front() != '0');
        if (node.type != JsonType::List)
            return fail(fmt::format("{} is {} here and has no \"{:.60}\"; expected {} itself", path_to(count),
                                    node.type == JsonType::Null ? "not given" : describe(node), key, path_to(count)));
        if (is_index && index < node.children.size()) return &node.children[index];
        return fail(fmt::format("found \"{:.60}\" in {}, which is a list of {} here; expected an index{}", key, path_to(count), node.children.size(),
                                node.children.empty() ? " in a longer list" : fmt::format(" from 0 to {}", node.children.size() - 1)));
    }

    std::optional<Error> enter_list(JsonNode& node, const ValueSpec& spec, std::size_t count) {
        const auto found = element(node, count);
        if (!found) return found.error();
        return step(*found, spec, count + 1);
    }

    /// Rows hold vectors, vectors hold numbers; both take their columns' ranges from the whole, which is checked afterwards.
    std::optional<Error> enter_numbers(JsonNode& node, const ValueSpec& spec, std::size_t count) {
        const auto found = element(node, count);
        if (!found) return found.error();
        ValueSpec inner;
        inner.kind = spec.kind == ValueKind::Rows ? ValueKind::Vector : ValueKind::Number;
        inner.columns = spec.columns;
        return step(*found, inner, count + 1);
    }

    void replace(JsonNode& node) const {
        std::string key = std::move(node.key);
        node = override_.value;
        node.key = std::move(key);
    }

    const SceneOverride& override_;
    std::vector<std::string> keys_;
};

} // namespace

std::string SceneOverride::to_string() const { return pointer + "=" + json_text(value); }

Result<SceneOverride> parse_override(std::string_view text) {
    const std::size_t equal = text.find('=');
    const auto fail = [&](std::string message) { return Error{ErrorCode::BadUsage, std::move(message), {}, 0, 0, "--set"}; };
    if (equal == std::string_view::npos || equal == 0)
        return fail(fmt::format("found \"{:.60}\"; expected POINTER=VALUE, as in /budget=work:100", text));
    SceneOverride override{std::string(text.substr(0, equal)), {}};
    const std::string_view value = text.substr(equal + 1);
    if (const auto keys = split_pointer(override.pointer); !keys) return fail(keys.error().message);
    if (auto tree = parse_json_tree(value, "--set")) {
        override.value = std::move(*tree);
        forget_positions(override.value);
    } else {
        if (!value.empty() && (value.front() == '{' || value.front() == '[' || value.front() == '"')) return fail(tree.error().message);
        override.value.type = JsonType::Text;
        override.value.text = value;
    }
    return override;
}

Result<std::vector<std::string>> split_pointer(std::string_view pointer) {
    const auto fail = [](std::string message) { return Error{ErrorCode::BadValue, std::move(message)}; };
    if (pointer.empty() || pointer.front() != '/')
        return fail(fmt::format("found \"{:.60}\"; expected a JSON pointer, as in /instruments/catheter/friction", pointer));
    std::vector<std::string> keys;
    for (std::size_t i = 0; i < pointer.size(); ++i) {
        if (pointer[i] == '/') {
            keys.emplace_back();
            continue;
        }
        if (pointer[i] != '~') {
            keys.back() += pointer[i];
            continue;
        }
        const char next = i + 1 < pointer.size() ? pointer[i + 1] : ' ';
        if (next != '0' && next != '1') return fail(fmt::format("found \"{:.60}\"; in a JSON pointer ~ is followed by 0 (for ~) or 1 (for /)", pointer));
        keys.back() += next == '0' ? '~' : '/';
        ++i;
    }
    if (keys.size() > kMostKeys) return fail(fmt::format("found a pointer of {} keys; expected at most {}", keys.size(), kMostKeys));
    return keys;
}

std::string dotted_key(std::string_view pointer) {
    const auto keys = split_pointer(pointer);
    if (!keys) return std::string(pointer);
    std::string path;
    for (const std::string& key : *keys) {
        const bool index = !key.empty() && std::all_of(key.begin(), key.end(), [](char c) { return c >= '0' && c <= '9'; });
        path = index && !path.empty() ? fmt::format("{}[{}]", path, key) : join_key(path, key);
    }
    return path;
}

std::optional<Error> apply_override(JsonNode& scene, const SceneOverride& override) {
    auto keys = split_pointer(override.pointer);
    if (!keys) {
        Error error = keys.error();
        error.key = fmt::format("{:.200}", override.pointer);
        return error;
    }
    return Walk(override, std::move(*keys)).put(scene);
}

std::string json_text(const JsonNode& node) { return to_json(node).dump(-1, ' ', false, Json::error_handler_t::replace); }

} // namespace trocar::engine
