// Hostile texts: they end in an error with a place, quickly and in little memory.
#include "engine/scene/json_tree.hpp"
#include "engine/scene/recipe.hpp"
#include "scene_fixture.hpp"

#include <random>

namespace trocar::engine {
namespace {

TEST(HostileScenes, AnEmptyFileIsNamedSo) {
    const Error error = refusal("");
    EXPECT_EQ(error.code, ErrorCode::BadSyntax);
    EXPECT_TRUE(says(error, "the file is empty"));
}

TEST(HostileScenes, BlanksCommentsAndABomAloneAreNoScene) {
    for (const char* text : {" \n\n", "// nothing\n", "\xEF\xBB\xBF", "/* open"})
        EXPECT_EQ(refusal(text).code, ErrorCode::BadSyntax) << text;
}

TEST(HostileScenes, AByteOrderMarkIsPassedOver) {
    EXPECT_TRUE(parse_scene("\xEF\xBB\xBF" + kSoundScene, "scenes/test.json").ok());
    const Error error = refusal("\xEF\xBB\xBF{\"tiem\": 1}");
    EXPECT_EQ(error.column, 2U);
}

TEST(HostileScenes, Utf16IsNamedSo) { EXPECT_TRUE(says(refusal(std::string("\xFF\xFE{\0", 4)), "UTF-16")); }

TEST(HostileScenes, OtherJsonThanAnObjectIsRefused) {
    for (const char* text : {"[]", "3", "\"scene\"", "null", "true"})
        EXPECT_TRUE(says(refusal(text), "an object with keys such as")) << text;
}

TEST(HostileScenes, NotANumberAndInfinityAreNamed) {
    for (const char* word : {"NaN", "Infinity", "-Infinity", "nan", "inf"}) {
        const Error error = refusal(spoil("1060", word));
        EXPECT_EQ(error.code, ErrorCode::BadSyntax);
        EXPECT_EQ(error.line, 8U);
        EXPECT_TRUE(says(error, "NaN and Infinity are no numbers in JSON"));
    }
}

TEST(HostileScenes, NumbersBeyondDoubleAreRefused) {
    for (const char* word : {"1e400", "-1e400", "123456789e999"}) {
        const Error error = refusal(spoil("1060", word));
        EXPECT_TRUE(says(error, word));
        EXPECT_TRUE(says(error, "1.8e308"));
        EXPECT_EQ(error.line, 8U);
    }
    EXPECT_TRUE(says(refusal(spoil("1060", "1e308")), "found 1e308 kg/m^3"));
    EXPECT_TRUE(says(refusal(spoil("1060", std::string(400, '9'))), "overflow"));
    EXPECT_TRUE(says(refusal(spoil("\"young_modulus\": 5,", "\"young_modulus\": 1e307,")), "expected "));
}

TEST(HostileScenes, ATrailingCommaIsPointedAt) {
    const Error error = refusal(spoil("\"hollow\": true,", "\"hollow\": true,").replace(0, 1, "{") + ",");
    EXPECT_EQ(error.code, ErrorCode::BadSyntax);
    const Error inner = refusal("{\"units\": {\"length\": \"mm\",}}");
    EXPECT_TRUE(says(inner, "the comma before it is one too many"));
    EXPECT_EQ(inner.column, 27U);
}

TEST(HostileScenes, DeepNestingEndsEarly) {
    for (const char* open : {"[", "{\"a\":"}) {
        std::string text = "{\"bodies\": ";
        for (int i = 0; i < 100000; ++i) text += open;
        EXPECT_TRUE(says(refusal(text), "nested more than 32 levels deep"));
    }
}

TEST(HostileScenes, ManyValuesEndEarly) {
    std::string text = "{\"bodies\": [0";
    for (int i = 0; i < 2000000; ++i) text += ",0";
    EXPECT_TRUE(says(refusal(text + "]}"), "more than 500000 values"));
}

TEST(HostileScenes, ManyDuplicateKeysAreFoundInTime) {
    std::string text = "{";
    for (int i = 0; i < 200000; ++i) text += "\"k" + std::to_string(i) + "\": 0, ";
    const Error error = refusal(text + "\"k7\": 1}");
    EXPECT_TRUE(says(error, "\"k7\" was already given in line 1"));
}

TEST(HostileScenes, AHundredMegabytesOfGarbageAreNotRead) {
    const SceneFolder folder;
    const auto file = folder.write("big.json", "");
    std::filesystem::resize_file(file, 100'000'000); // zero bytes
    const auto scene = read_scene(file);
    ASSERT_FALSE(scene.ok());
    EXPECT_TRUE(says(scene.error(), "found 100000000 bytes"));
    const Error error = refusal(std::string(100'000'000, 'x'));
    EXPECT_EQ(error.line, 1U);
    EXPECT_LT(error.message.size(), 500U);
}

TEST(HostileScenes, AnEndlessStringIsNotRepeated) {
    const Error error = refusal("{\"name\": \"" + std::string(10'000'000, 'y'));
    EXPECT_LT(error.message.size(), 500U);
}

TEST(HostileScenes, AFolderOrNoFileIsNamed) {
    const SceneFolder folder;
    for (const auto& path : {folder.path(), folder.path() / "none.json"}) {
        const auto scene = read_scene(path);
        ASSERT_FALSE(scene.ok());
        EXPECT_EQ(scene.error().code, ErrorCode::FileNotFound) << scene.error().to_string();
        EXPECT_EQ(scene.error().file, path.string());
    }
}

TEST(HostileScenes, EveryPrefixOfASoundSceneIsAnErrorOrAScene) {
    for (std::size_t length = 0; length < kSoundScene.size(); ++length)
        EXPECT_FALSE(parse_scene(kSoundScene.substr(0, length), "scenes/test.json").ok()) << length;
}

TEST(HostileScenes, RandomDamageNeverCrashes) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    for (int round = 0; round < 3000; ++round) {
        std::string text = kSoundScene;
        for (int i = 0; i < 3; ++i) {
            const std::size_t at = random() % text.size();
            switch (random() % 4) {
            case 0:
                text[at] = static_cast<char>(random() % 256);
                break;
            case 1:
                text.erase(at, 1 + random() % 20);
                break;
            case 2:
                text.insert(at, text.substr(random() % text.size(), random() % 30));
                break;
            default:
                text[at] = "{}[],:\"0-.e"[random() % 11];
                break;
            }
            if (text.empty()) text = " ";
        }
        const auto scene = parse_scene(text, "scenes/test.json");
        EXPECT_TRUE(scene.ok() || !scene.error().message.empty());
    }
}

TEST(HostileScenes, PositionsOfAllKindsOfValuesAreExact) {
    const auto tree =
        parse_json_tree("{\n \"a\\\"\\\\\" : \"x\\\\\",\n  \"b\": -1.5e3 , \"c\":[true,\nfalse, null,12], // ,\n\"d\": {}}", "t");
    ASSERT_TRUE(tree.ok()) << tree.error().to_string();
    const auto expect = [](const JsonNode& node, std::size_t line, std::size_t column) {
        EXPECT_EQ(node.at.line, line) << describe(node);
        EXPECT_EQ(node.at.column, column) << describe(node);
    };
    ASSERT_EQ(tree->children.size(), 4U);
    EXPECT_EQ(tree->children[0].key, "a\"\\");
    EXPECT_EQ(tree->children[0].key_at.column, 2U);
    expect(tree->children[0], 2, 12);
    expect(tree->children[1], 3, 8);
    EXPECT_EQ(tree->children[1].text, "-1.5e3");
    const JsonNode& list = tree->children[2];
    expect(list, 3, 21);
    expect(list.children[0], 3, 22);
    expect(list.children[1], 4, 1);
    expect(list.children[2], 4, 8);
    expect(list.children[3], 4, 13);
    expect(tree->children[3], 5, 6);
}

} // namespace
} // namespace trocar::engine
