// The published files agree with the table, and the schema agrees with the reader.
// TROCAR_WRITE_GENERATED=1 writes the published files instead of comparing them.
#include "engine/scene/json_tree.hpp"
#include "engine/scene/recipe.hpp"
#include "engine/scene/schema.hpp"
#include "scene_fixture.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>
#include <sstream>

namespace trocar::engine {
namespace {

using Json = nlohmann::ordered_json;

std::string file_text(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

void expect_published(const std::filesystem::path& file, const std::string& text) {
    if (std::getenv("TROCAR_WRITE_GENERATED") != nullptr) std::ofstream(file, std::ios::binary) << text;
    EXPECT_TRUE(file_text(file) == text) << file << " is out of date; run this test with TROCAR_WRITE_GENERATED=1";
}

/// As much of JSON Schema as the scene's uses. Returns where the first violation is, or nothing.
class Validator {
public:
    explicit Validator(Json schema) : root_(std::move(schema)) {}
    std::string first_violation(const Json& value) const { return check(value, root_, "$"); }

private:
    std::string check(const Json& value, const Json& schema, const std::string& at) const {
        if (schema.is_boolean()) return schema.get<bool>() ? "" : at + " is not allowed";
        for (const auto& [word, rule] : schema.items()) {
            std::string violation = check_word(value, schema, word, rule, at);
            if (!violation.empty()) return violation;
        }
        return "";
    }

    std::string check_word(const Json& value, const Json& schema, const std::string& word, const Json& rule, const std::string& at) const {
        if (word == "$ref") return check(value, root_.at(Json::json_pointer(rule.get<std::string>().substr(1))), at);
        if (word == "type") return has_type(value, rule.get<std::string>()) ? "" : at + " is not of type " + rule.get<std::string>();
        if (word == "enum") return std::find(rule.begin(), rule.end(), value) != rule.end() ? "" : at + " is none of " + rule.dump();
        if (word == "anyOf") return check_any(value, rule, at);
        if (word == "allOf") {
            for (const Json& one : rule)
                if (std::string violation = check(value, one, at); !violation.empty()) return violation;
            return "";
        }
        if (word == "if") {
            const char* branch = check(value, rule, at).empty() ? "then" : "else";
            return schema.contains(branch) ? check(value, schema.at(branch), at) : "";
        }
        if (value.is_object()) return check_object_word(value, schema, word, rule, at);
        if (value.is_array()) return check_array_word(value, word, rule, at);
        if (value.is_number()) return check_number_word(value.get<double>(), word, rule, at);
        if (word == "minLength" && value.is_string() && value.get<std::string>().size() < rule.get<std::size_t>())
            return at + " is too short";
        return "";
    }

    std::string check_any(const Json& value, const Json& rule, const std::string& at) const {
        std::string all = at + " fits no alternative:";
        for (const Json& one : rule) {
            const std::string violation = check(value, one, at);
            if (violation.empty()) return "";
            all += " " + violation + ";";
        }
        return all;
    }

    std::string check_object_word(const Json& value, const Json& schema, const std::string& word, const Json& rule,
                                  const std::string& at) const {
        if (word == "required") {
            for (const Json& key : rule)
                if (!value.contains(key.get<std::string>())) return at + " lacks " + key.get<std::string>();
        }
        if (word == "properties")
            for (const auto& [key, sub] : rule.items())
                if (value.contains(key))
                    if (std::string violation = check(value.at(key), sub, at + "." + key); !violation.empty()) return violation;
        if (word == "additionalProperties")
            for (const auto& [key, sub] : value.items())
                if (!schema.contains("properties") || !schema.at("properties").contains(key))
                    if (std::string violation = check(sub, rule, at + "." + key); !violation.empty()) return violation;
        return "";
    }

    std::string check_array_word(const Json& value, const std::string& word, const Json& rule, const std::string& at) const {
        if (word == "minItems" && value.size() < rule.get<std::size_t>()) return at + " has too few items";
        if (word == "maxItems" && value.size() > rule.get<std::size_t>()) return at + " has too many items";
        for (std::size_t i = 0; i < value.size(); ++i) {
            const std::string here = at + "[" + std::to_string(i) + "]";
            std::string violation;
            if (word == "items") violation = check(value[i], rule, here);
            if (word == "prefixItems" && i < rule.size()) violation = check(value[i], rule[i], here);
            if (!violation.empty()) return violation;
        }
        return "";
    }

    static std::string check_number_word(double value, const std::string& word, const Json& rule, const std::string& at) {
        if (word == "minimum" && value < rule.get<double>()) return at + " is too small";
        if (word == "exclusiveMinimum" && value <= rule.get<double>()) return at + " is too small";
        if (word == "maximum" && value > rule.get<double>()) return at + " is too large";
        return "";
    }

    static bool has_type(const Json& value, const std::string& type) {
        if (type == "object") return value.is_object();
        if (type == "array") return value.is_array();
        if (type == "string") return value.is_string();
        if (type == "boolean") return value.is_boolean();
        if (type == "integer") return value.is_number_integer();
        return type == "number" && value.is_number();
    }

    Json root_;
};

Json with_comments(const std::string& text) { return Json::parse(text, nullptr, true, true); }

std::vector<std::filesystem::path> json_files(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
        if (entry.path().extension() == ".json") files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

TEST(Published, SchemaIsTheTables) { expect_published(source_root() / "assets/scene.schema.json", scene_schema_text()); }

TEST(Published, ReferencePageIsTheTables) { expect_published(source_root() / "docs/scene.md", scene_reference_markdown()); }

TEST(Published, EveryShippedSceneIsAcceptedByReaderAndSchema) {
    const Validator validator(scene_schema());
    const auto files = json_files(source_root() / "assets/scenes");
    EXPECT_GE(files.size(), 3U);
    for (const auto& file : files) {
        const auto scene = read_scene(file);
        EXPECT_TRUE(scene.ok()) << scene.error().to_string();
        EXPECT_EQ(validator.first_violation(with_comments(file_text(file))), "") << file;
    }
}

TEST(Published, EveryShippedRecipeIsAccepted) {
    for (const auto& file : json_files(source_root() / "assets/recipes")) {
        const auto recipe = read_recipe(file);
        EXPECT_TRUE(recipe.ok()) << recipe.error().to_string();
    }
}

TEST(Published, TheRealAnatomySceneIsAccepted) {
    const auto file = source_root() / "tests/scenes/real_anatomy.json";
    EXPECT_EQ(Validator(scene_schema()).first_violation(with_comments(file_text(file))), "");
    if (std::getenv("TROCAR_TEST_DATA") == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    const auto scene = read_scene(file);
    EXPECT_TRUE(scene.ok()) << scene.error().to_string();
}

TEST(Schema, RefusesWhatTheTableRefuses) {
    const Validator validator(scene_schema());
    EXPECT_EQ(validator.first_violation(with_comments(kSoundScene)), "");
    const std::pair<const char*, const char*> spoilt[] = {
        {"\"density\"", "\"densty\""},
        {"\"hollow\": true", "\"material\": {}"},
        {"\"radius\": 0.4", "\"radius\": 0.4, \"tip\": {\"shape\": \"straight\", \"angle\": 1}"},
        {"\"shape\": \"tube\"", "\"shape\": \"tube\", \"radius\": 3"},
        {"\"kind\": \"deformable\",", "\"kind\": \"deformable\", \"coarse\": {\"max_volume\": 1},"},
        {"\"radius\": 0.4", "\"radius\": 0.4, \"tip\": {\"shape\": \"J\", \"arcs\": [[10, 1, 0]]}"},
        {"\"kind\": \"static\",", ""},
        {"\"length\": \"mm\", ", ""},
        {"1060", "\"1060\""},
        {"1060", "-1060"},
        {"[0, 0, 10]", "[0, 10]"},
        {"[[0, 20, 0], [1, 50, 1]]", "[]"},
        {"\"static\"", "\"statik\""},
        {"\"mm\"", "\"furlong\""},
        {"\"damping\"", "\"dampening\""},
        {"\"step\": 0.01", "\"step\": 0"},
        {"\"fraction\": 0.2", "\"fraction\": 15"},
        {"\"sphere\", \"radius\": 50", "\"sphere\""},
    };
    for (const auto& [piece, other] : spoilt) EXPECT_NE(validator.first_violation(with_comments(spoil(piece, other))), "") << other;
}

TEST(Schema, AcceptsKeysOfATipWhoseShapeIsTheDevices) {
    const Validator validator(scene_schema());
    EXPECT_EQ(validator.first_violation(with_comments(spoil("\"radius\": 0.4", "\"device\": \"cobra_2\", \"tip\": {\"arcs\": [[10, 1, 0]]}"))), "");
}

TEST(Schema, NamesTheEffectsThatAreOnWhereNoneIsNamed) {
    const std::string named = ",\n    \"effects\": [\"elasticity\", \"damping\", \"coarse_contact\", \"exact_contact\"]";
    const auto scene = parse_scene(spoil(named, ""), "scenes/test.json");
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    const std::string doc = scene_schema().at("$defs").at("scene").at("properties").at("effects").at("description").get<std::string>();
    EXPECT_EQ(scene->effects.names().size(), 5U);
    for (const std::string& name : scene->effects.names()) EXPECT_NE(doc.find(name), std::string::npos) << name;
}

TEST(Schema, EveryKeyIsExplained) {
    const Json schema = scene_schema();
    for (const auto& [name, object] : schema.at("$defs").items()) {
        EXPECT_FALSE(object.at("description").get<std::string>().empty()) << name;
        for (const auto& [key, field] : object.at("properties").items())
            EXPECT_GT(field.at("description").get<std::string>().size(), 6U) << name << "." << key;
    }
}

} // namespace
} // namespace trocar::engine
