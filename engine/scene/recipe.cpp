#include "engine/scene/recipe.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/scene/check.hpp"
#include "engine/scene/scene_table.hpp"
#include "engine/scene/values.hpp"

#include <fmt/format.h>

namespace trocar::engine {
namespace {

Dimension to_dimension(anatomy::RecipeDimension dimension) {
    switch (dimension) {
    case anatomy::RecipeDimension::Length:
        return Dimension::Length;
    case anatomy::RecipeDimension::Angle:
        return Dimension::Angle;
    case anatomy::RecipeDimension::Count:
    case anatomy::RecipeDimension::Ratio:
        break;
    }
    return Dimension::None;
}

FieldSpec to_field(const anatomy::RecipeField& field) {
    const double usual = anatomy::recipe_value(anatomy::Recipe{}, field);
    if (field.dimension == anatomy::RecipeDimension::Count)
        return count_field(field.name, field.least, field.most, field.doc).by_default(usual);
    return number_field(field.name, to_dimension(field.dimension), between(field.least, field.most), field.doc).by_default(usual);
}

} // namespace

const ObjectSpec& recipe_table() {
    static const ObjectSpec table = [] {
        ObjectSpec recipe{"recipe", "A generated patient; the seed alone gives another one.", "", "", {}};
        recipe.fields.push_back(text_field("$schema", "Where editors find the schema; not read."));
        recipe.fields.push_back(object_field("units", units_table(), "Units of all numbers in this file.").required());
        for (const anatomy::RecipeField& field : anatomy::recipe_fields()) recipe.fields.push_back(to_field(field));
        return recipe;
    }();
    return table;
}

Result<std::string> read_json_file(const std::filesystem::path& file) {
    std::error_code problem;
    if (std::filesystem::is_regular_file(file, problem)) {
        const auto size = std::filesystem::file_size(file, problem);
        if (!problem && size > kMaxSceneBytes)
            return Error{ErrorCode::BadSyntax,
                         fmt::format("found {} bytes; expected at most {}: long paths belong in CSV files, meshes in mesh files", size,
                                     kMaxSceneBytes),
                         file.string()};
    }
    return read_file_bytes(file);
}

Result<JsonNode> parse_checked(std::string_view text, const ObjectSpec& table, CheckContext& context) {
    auto tree = parse_json_tree(text, context.file_name);
    if (!tree) return tree;
    if (tree->type == JsonType::Object)
        if (auto error = read_units(*tree, units_table(), context)) return *error;
    if (auto error = check_object(*tree, table, "", context)) return *error;
    return tree;
}

Result<anatomy::Recipe> parse_recipe(std::string_view text, const std::filesystem::path& file) {
    CheckContext context{file.string(), file.parent_path(), {}, {}, {}};
    const auto tree = parse_checked(text, recipe_table(), context);
    if (!tree) return tree.error();
    const Values values(&tree.value(), recipe_table(), context.units, "");
    anatomy::Recipe recipe;
    for (const anatomy::RecipeField& field : anatomy::recipe_fields()) anatomy::set_recipe_value(recipe, field, values.number(field.name));
    const auto checked = anatomy::check_recipe(recipe);
    if (checked) return recipe;
    const JsonNode* member = tree->find(checked.error().key);
    return error_at(context, member != nullptr ? member->at : tree->at, checked.error().key, checked.error().message);
}

Result<anatomy::Recipe> read_recipe(const std::filesystem::path& file) {
    const auto text = read_json_file(file);
    if (!text) return text.error();
    return parse_recipe(*text, file);
}

} // namespace trocar::engine
