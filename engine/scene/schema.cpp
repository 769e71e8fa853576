#include "engine/scene/schema.hpp"

#include "engine/scene/check.hpp"
#include "engine/scene/describe_table.hpp"
#include "engine/scene/scene_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

using Json = nlohmann::ordered_json;

std::string definition_name(const ObjectSpec& object) {
    std::string name(object.name);
    std::replace(name.begin(), name.end(), ' ', '_');
    return name;
}

/// Bounds that hold in every unit: all bounds of dimensionless numbers, the sign of the others.
void add_bounds(Json& schema, const Range& range, Dimension dimension) {
    const bool any_unit = dimension != Dimension::None;
    if (std::isfinite(range.least) && (!any_unit || range.least == 0.0))
        schema[range.above_least ? "exclusiveMinimum" : "minimum"] = range.least;
    else if (any_unit && range.least > 0.0)
        schema["exclusiveMinimum"] = 0;
    if (std::isfinite(range.most) && !any_unit) schema["maximum"] = range.most;
}

Json number_schema(const Range& range, Dimension dimension) {
    Json schema{{"type", "number"}};
    add_bounds(schema, range, dimension);
    return schema;
}

Json vector_schema(const ValueSpec& value) {
    Json columns = Json::array();
    for (const Column& column : value.columns) {
        Json one = number_schema(column.range, column.dimension);
        one["title"] = column.name;
        columns.push_back(std::move(one));
    }
    return {{"type", "array"}, {"prefixItems", columns}, {"minItems", value.columns.size()}, {"maxItems", value.columns.size()}};
}

Json value_schema(const ValueSpec& value);

Json list_schema(const ValueSpec& value, Json element) {
    Json schema{{"type", "array"}, {"items", std::move(element)}};
    if (value.least_count > 0) schema["minItems"] = value.least_count;
    if (value.most_count < std::numeric_limits<std::size_t>::max()) schema["maxItems"] = value.most_count;
    return schema;
}

Json any_schema(const ValueSpec& value) {
    Json all = Json::array();
    for (const ValueSpec& one : value.alternatives) all.push_back(value_schema(one));
    return {{"anyOf", all}};
}

Json value_schema(const ValueSpec& value) {
    switch (value.kind) {
    case ValueKind::Number:
        return number_schema(value.range, value.dimension);
    case ValueKind::Count: {
        Json schema{{"type", "integer"}};
        add_bounds(schema, value.range, Dimension::None);
        return schema;
    }
    case ValueKind::Flag:
        return {{"type", "boolean"}};
    case ValueKind::Text:
    case ValueKind::Path:
        return {{"type", "string"}, {"minLength", 1}};
    case ValueKind::Choice:
        return {{"enum", value.choices}};
    case ValueKind::Vector:
        return vector_schema(value);
    case ValueKind::Rows:
        return list_schema(value, vector_schema(value));
    case ValueKind::List:
        return list_schema(value, value_schema(value.alternatives.front()));
    case ValueKind::Object:
        return {{"$ref", "#/$defs/" + definition_name(*value.object)}};
    case ValueKind::Any:
        return Json::object();
    case ValueKind::Map:
        if (value.any_names) return {{"type", "object"}, {"additionalProperties", value_schema(value.alternatives.front())}};
        return {{"type", "object"},
                {"propertyNames", {{"pattern", "^[A-Za-z0-9_-]{1,64}$"}}},
                {"additionalProperties", value_schema(value.alternatives.front())}};
    case ValueKind::Alternatives:
        return any_schema(value);
    }
    return {};
}

Json field_schema(const FieldSpec& field) {
    Json schema = value_schema(field.value);
    std::string text(field.doc);
    const bool has_dimension = field.value.dimension != Dimension::None && field.value.kind == ValueKind::Number;
    const std::string range = has_dimension ? range_text(field.value.range, field.value.dimension) : "";
    if (!range.empty()) text += fmt::format(" In SI: {}.", range);
    if (const std::string otherwise = default_text(field); !otherwise.empty()) text += fmt::format(" Default: {}.", otherwise);
    schema["description"] = text;
    return schema;
}

/// Keys that a discriminator's value leaves without use, or makes necessary.
Json conditions(const ObjectSpec& object) {
    Json all = Json::array();
    for (const FieldSpec& field : object.fields) {
        if (field.used_when.empty()) continue;
        const FieldSpec& discriminator = *object.find(object.discriminator);
        Json is_used{{"properties", {{object.discriminator, {{"enum", field.used_when}}}}}};
        const auto* otherwise = std::get_if<std::string_view>(&discriminator.otherwise);
        const bool used_by_default =
            otherwise != nullptr && std::find(field.used_when.begin(), field.used_when.end(), *otherwise) != field.used_when.end();
        if (!used_by_default && object.decided_by.empty()) is_used["required"] = {object.discriminator};
        Json condition{{"if", is_used}};
        if (field.is_required) condition["then"] = {{"required", {field.key}}};
        condition["else"] = {{"properties", {{field.key, false}}}};
        all.push_back(std::move(condition));
    }
    return all;
}

Json object_schema(const ObjectSpec& object) {
    Json properties = Json::object(), required = Json::array();
    for (const FieldSpec& field : object.fields) {
        properties[std::string(field.key)] = field_schema(field);
        if (field.is_required && field.used_when.empty()) required.push_back(field.key);
    }
    Json schema{{"type", "object"}, {"description", object.doc}, {"properties", properties}, {"additionalProperties", false}};
    if (!required.empty()) schema["required"] = required;
    if (Json all = conditions(object); !all.empty()) schema["allOf"] = all;
    return schema;
}

/// What a value may be, with links to the objects' sections.
std::string value_page(const ValueSpec& value) {
    switch (value.kind) {
    case ValueKind::Number: {
        const std::string range = range_text(value.range, value.dimension);
        return range.empty() ? expected(value, Units{}) : "a number: " + range;
    }
    case ValueKind::Object: {
        std::string anchor(value.object->name); // as Markdown's readers make it of the heading
        std::replace(anchor.begin(), anchor.end(), ' ', '-');
        return fmt::format("[{}](#{})", value.object->name, anchor);
    }
    case ValueKind::Map:
        return fmt::format("an object: name -> {}", value_page(value.alternatives.front()));
    case ValueKind::List:
        return fmt::format("a list of {}", value_page(value.alternatives.front()));
    case ValueKind::Alternatives: {
        std::vector<std::string> all;
        for (const ValueSpec& one : value.alternatives) all.push_back(value_page(one));
        return fmt::format("{}", fmt::join(all, ", or "));
    }
    default:
        return expected(value, Units{});
    }
}

std::string key_default(const FieldSpec& field) {
    if (field.is_required) return "required";
    return default_text(field);
}

std::string object_page(const ObjectSpec& object) {
    std::string page =
        fmt::format("\n## {}\n\n{}\n\n| key | value | default | meaning |\n| --- | --- | --- | --- |\n", object.name, object.doc);
    for (const FieldSpec& field : object.fields) {
        std::string meaning(field.doc);
        if (!field.used_when.empty())
            meaning += fmt::format(" Only where `{}` is {}.", object.discriminator, fmt::join(field.used_when, " or "));
        if (field.value.kind == ValueKind::Number && !field.value.range.what.empty())
            meaning += fmt::format(" ({})", field.value.range.what);
        page += fmt::format("| `{}` | {} | {} | {} |\n", field.key, value_page(field.value), key_default(field), meaning);
    }
    return page;
}

constexpr std::string_view kIntroduction = R"(# Scene files

A scene is a JSON file (`//` and `/* */` comments are allowed) that says what is simulated. It declares its units once;
every number in it is in those units, and is turned into SI when it is read. Ranges and defaults below are in SI.

- A key that is unknown or has no use where it stands is an error, with line, column and the nearest known key.
- A number out of any tissue's or metal's range is an error that says which unit was probably meant; an unusual one is
  noted by `trocar explain`.
- Names of files are relative to the scene's folder; `${TROCAR_TEST_DATA}` stands for that environment variable.
- Directions need not be unit vectors.
- Names of bodies, instruments and targets are letters, digits, `-` and `_`.

This page is written by the engine from the table that also checks scenes and makes `assets/scene.schema.json`.
)";

} // namespace

Json make_schema(std::string_view title, const ObjectSpec& root) {
    Json definitions = Json::object();
    for (const ObjectSpec* object : reachable_objects(root)) definitions[definition_name(*object)] = object_schema(*object);
    return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
            {"title", title},
            {"$ref", "#/$defs/" + definition_name(root)},
            {"$defs", definitions}};
}

Json scene_schema() { return make_schema("Trocar scene", scene_table()); }

std::string reference_markdown(const ObjectSpec& root) {
    std::string page;
    for (const ObjectSpec* object : reachable_objects(root)) page += object_page(*object);
    return page;
}

std::string scene_schema_text() { return scene_schema().dump(2) + "\n"; }

std::string scene_reference_markdown() {
    std::string page(kIntroduction);
    for (const ObjectSpec* object : reachable_objects(scene_table())) page += object_page(*object);
    page += "\n# Recipe files\n\nA recipe is a JSON file of the same kind; a body names it with `{\"recipe\": FILE, "
            "\"part\": \"liver\"}`.\n";
    return page + object_page(recipe_table());
}

} // namespace trocar::engine
