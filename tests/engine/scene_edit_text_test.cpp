// A value is set in the text of a scene, and everything else of it stays to the byte.
#include "engine/scene/edit_text.hpp"
#include "engine/scene/json_tree.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace trocar::engine {
namespace {

std::string set(std::string_view text, const std::vector<std::string>& keys, std::string_view value) {
    const Result<std::string> changed = set_json_value(text, keys, value);
    EXPECT_TRUE(changed.ok()) << text;
    if (!changed.ok()) return {};
    EXPECT_TRUE(parse_json_tree(*changed, "changed.json").ok()) << *changed;
    return *changed;
}

TEST(EditText, ReplacesAValueAndNothingElse) {
    EXPECT_EQ(set(R"({"a": 1, "b" : [ {"c": "}"} ], "d": null})", {"b"}, "2"), R"({"a": 1, "b" : 2, "d": null})");
    EXPECT_EQ(set("// {\n{ \"a\": /* 3 */ 1 // }\n , \"b\": {\"a\": true}}", {"b", "a"}, "0"), "// {\n{ \"a\": /* 3 */ 1 // }\n , \"b\": {\"a\": 0}}");
    EXPECT_EQ(set("\xEF\xBB\xBF{\"a\":-1.5e3}", {"a"}, "4"), "\xEF\xBB\xBF{\"a\":4}");
    EXPECT_EQ(set(R"({"a\"\u0062": 1, "a": {"\\": "\\\""}})", {"a\"b"}, "2"), R"({"a\"\u0062": 2, "a": {"\\": "\\\""}})");
}

TEST(EditText, AddsAMemberAtTheEndAsTheOthersAreLaidOut) {
    EXPECT_EQ(set("{}", {"a"}, "1"), R"({"a": 1})");
    EXPECT_EQ(set(R"({"a": 1})", {"b"}, "2"), R"({"a": 1, "b": 2})");
    EXPECT_EQ(set(R"({"a": 1})", {"b", "c", "d"}, "2"), R"({"a": 1, "b": {"c": {"d": 2}}})");
    EXPECT_EQ(set("{\n  \"a\": 1\n}\n", {"b"}, "2"), "{\n  \"a\": 1,\n  \"b\": 2\n}\n");
    EXPECT_EQ(set("{\n  \"a\": 1 // one\n}\n", {"b"}, "2"), "{\n  \"a\": 1, // one\n  \"b\": 2\n}\n");
    EXPECT_EQ(set("{\n\t\"a\": {\"x\": 1}}", {"a", "y"}, "2"), "{\n\t\"a\": {\"x\": 1, \"y\": 2}}");
}

TEST(EditText, RefusesAWayThroughWhatIsNoObject) {
    for (const char* text : {R"({"a": 1})", R"({"a": [1]})", R"({"a": null})"})
        EXPECT_FALSE(set_json_value(text, std::vector<std::string>{"a", "b"}, "2").ok()) << text;
    EXPECT_FALSE(set_json_value("[1]", std::vector<std::string>{"a"}, "2").ok());
}

} // namespace
} // namespace trocar::engine
