// Messages from the page: what is understood, what is refused, and that nothing ever breaks the reader.
#include "engine/effects/registry.hpp"
#include "engine/viewer/read_command.hpp"

#include <fmt/format.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace trocar::engine::viewer {
namespace {

using ::testing::HasSubstr;

const CommandRange kRange{{100, 50}, {true, false}, {&effects::gravity}, false, {200, 90}};

/// The command in a message that must be one.
template <class T>
T read(const std::string& text) {
    const Result<Request> request = read_request(text, kRange);
    EXPECT_TRUE(request.ok()) << text << ": " << (request.ok() ? "" : request.error().message);
    if (!request.ok() || !std::holds_alternative<Command>(*request)) return {};
    const Command& command = std::get<Command>(*request);
    EXPECT_TRUE(std::holds_alternative<T>(command)) << text;
    return std::holds_alternative<T>(command) ? std::get<T>(command) : T{};
}

std::string complaint(const std::string& text) {
    const Result<Request> request = read_request(text, kRange);
    EXPECT_FALSE(request.ok()) << text;
    return request.ok() ? "" : request.error().message;
}

TEST(ViewerMessages, AreUnderstood) {
    EXPECT_EQ(read<Drive>(R"({"type":"drive","insertion":0.5,"rotation":-1})").insertion, 0.5);
    EXPECT_EQ(read<SetBudget>(R"({"type":"budget","mode":"wall","ms":0.1})").limits.wall_s, 0.1e-3);
    EXPECT_EQ(read<SetBudget>(R"({"type":"budget","mode":"wall","ms":33})").limits.wall_s, 33e-3);
    EXPECT_EQ(read<SetBudget>(R"({"type":"budget","mode":"work","units":20000})").limits.work_units, 20000u);
    EXPECT_EQ(read<SetBudget>(R"({"type":"budget","mode":"exact"})").limits.mode, BudgetMode::Exact);
    EXPECT_TRUE(read<Pause>(R"({"type":"pause","on":true})").on);
    EXPECT_EQ(read<Pace>(R"({"type":"pace","factor":0.25})").factor, 0.25);
    EXPECT_EQ(read<SwitchEffect>(R"({"type":"effect","name":"breathing","on":false})").effect, &effects::breathing);
    EXPECT_EQ(read<Grab>(R"({"type":"grab","body":0,"vertex":99,"target":[0.1,-0.2,0.3]})").target, Vec3(0.1, -0.2, 0.3));
    EXPECT_STREQ(read<SaveState>(R"({"type":"save","name":"before the branch"})").name.data(), "before the branch");
    EXPECT_STREQ(read<SaveState>(fmt::format(R"({{"type":"save","name":"{}"}})", std::string(kLongestStateName, 'x'))).name.data(),
                 std::string(kLongestStateName, 'x').c_str());
    EXPECT_EQ(read<RestoreState>(R"({"type":"restore","saved":3})").saved, 3u);
    EXPECT_EQ(read<ForgetState>(R"({"type":"forget","saved":3})").saved, 3u);
    for (const char* plain : {"step", "let_go", "restart"})
        EXPECT_TRUE(read_request(fmt::format(R"({{"type":"{}"}})", plain), kRange).ok()) << plain;
}

TEST(ViewerMessages, OfPicksAreUnderstood) {
    const auto read_as = [](const std::string& text) { return *read_request(text, kRange); };
    const auto pick = std::get<PickPlace>(read_as(R"({"type":"pick","what":"entry","body":1,"triangle":89,"weights":[0.5,0.5003,0]})"));
    EXPECT_EQ(pick.what, PickPlace::What::Entry);
    EXPECT_EQ(pick.body, 1u);
    EXPECT_EQ(pick.triangle, 89u);
    EXPECT_NEAR(pick.weights[0] + pick.weights[1] + pick.weights[2], 1.0, 1e-12);
    EXPECT_TRUE(std::holds_alternative<ForgetPicks>(read_as(R"({"type":"unpick"})")));
    EXPECT_EQ(std::get<SaveScene>(read_as(R"({"type":"save_scene","target":"picked"})")).file_name, "");
    EXPECT_EQ(std::get<SaveScene>(read_as(R"({"type":"save_scene_as","target":"picked","name":"my-scene.json"})")).file_name, "my-scene.json");
}

struct Refused {
    const char* text;
    const char* because;
};
void PrintTo(const Refused& refused, std::ostream* os) { *os << refused.text; }

class ViewerMessage : public ::testing::TestWithParam<Refused> {};
TEST_P(ViewerMessage, IsRefusedWithWhatWouldBeRight) { EXPECT_THAT(complaint(GetParam().text), HasSubstr(GetParam().because)); }

INSTANTIATE_TEST_SUITE_P(
    , ViewerMessage,
    ::testing::Values(Refused{"", "no JSON object"}, Refused{"hello", "no JSON object"}, Refused{"[1,2]", "no JSON object"},
                      Refused{"{", "no JSON object"}, Refused{"{}", "\"type\" is missing"}, Refused{R"({"type":3})", "\"type\" is missing"},
                      Refused{R"({"type":"shutdown"})", "unknown"}, Refused{R"({"type":"drive"})", "\"insertion\" is missing"},
                      Refused{R"({"type":"drive","insertion":1.5,"rotation":0})", "from -1 to 1"},
                      Refused{R"({"type":"drive","insertion":1e999,"rotation":0})", "no JSON object"},
                      Refused{R"({"type":"drive","insertion":null,"rotation":0})", "from -1 to 1"},
                      Refused{R"({"type":"drive","insertion":"1","rotation":0})", "from -1 to 1"},
                      Refused{R"({"type":"drive","insertion":0,"rotation":0,"speed":9})", "\"speed\" means nothing here"},
                      Refused{R"({"type":"budget","mode":"wall","ms":0.09})", "from 0.1 to 33"},
                      Refused{R"({"type":"budget","mode":"wall","ms":34})", "from 0.1 to 33"},
                      Refused{R"({"type":"budget","mode":"work","units":-1})", "integer"},
                      Refused{R"({"type":"budget","mode":"work","units":100.5})", "integer"},
                      Refused{R"({"type":"budget","mode":"lots"})", "wall, work or exact"},
                      Refused{R"({"type":"budget","mode":"exact","ms":3})", "means nothing here"},
                      Refused{R"({"type":"pause","on":1})", "true or false"}, Refused{R"({"type":"pace","factor":0})", "from 0.05 to 1"},
                      Refused{R"({"type":"effect","name":"magic","on":true})", "elasticity, gravity"},
                      Refused{R"({"type":"effect","name":"gravity","on":true})", "the scene has no gravity"},
                      Refused{R"({"type":"inject"})", "the scene has no contrast"}, Refused{R"({"type":"xray","on":"yes"})", "true or false"},
                      Refused{R"({"type":"carm","primary":3.2,"secondary":0,"zoom":1,"at_tip":false,"pixels":512,"display":"log"})", "from -3.14159 to 3.14159"},
                      Refused{R"({"type":"carm","primary":0,"secondary":1.6,"zoom":1,"at_tip":false,"pixels":512,"display":"log"})", "from -1.5708 to 1.5708"},
                      Refused{R"({"type":"carm","primary":0,"secondary":0,"zoom":0,"at_tip":false,"pixels":512,"display":"log"})", "from 1 to 8"},
                      Refused{R"({"type":"carm","primary":0,"secondary":0,"zoom":1,"at_tip":false,"pixels":0,"display":"log"})", "from 64 to 1024"},
                      Refused{R"({"type":"carm","primary":0,"secondary":0,"zoom":1,"at_tip":false,"pixels":1000000000,"display":"log"})", "from 64 to 1024"},
                      Refused{R"({"type":"carm","primary":0,"secondary":0,"zoom":1,"at_tip":false,"pixels":512,"display":"linear"})", "log, subtraction or roadmap"},
                      Refused{R"({"type":"carm","primary":0,"secondary":0})", "\"zoom\" is missing"},
                      Refused{R"({"type":"save"})", "\"name\" is missing"}, Refused{R"({"type":"save","name":""})", "1 to 48 bytes"},
                      Refused{R"({"type":"save","name":"1234567890123456789012345678901234567890123456789"})", "1 to 48 bytes"},
                      Refused{R"({"type":"save","name":"two\nlines"})", "no control characters"},
                      Refused{R"({"type":"save","name":3})", "expected a text"}, Refused{R"({"type":"restore"})", "\"saved\" is missing"},
                      Refused{R"({"type":"restore","saved":0})", "from 1 to"}, Refused{R"({"type":"forget","saved":-1})", "from 1 to"},
                      Refused{R"({"type":"grab","body":2,"vertex":0,"target":[0,0,0]})", "from 0 to 1"},
                      Refused{R"({"type":"grab","body":0,"vertex":100,"target":[0,0,0]})", "from 0 to 99"},
                      Refused{R"({"type":"grab","body":1,"vertex":0,"target":[0,0,0]})", "no tissue carries it"},
                      Refused{R"({"type":"grab","body":0,"vertex":0,"target":[0,0]})", "three numbers"},
                      Refused{R"({"type":"grab","body":0,"vertex":0,"target":[0,0,1e9]})", "three numbers"},
                      Refused{R"({"type":"pick","what":"exit","body":0,"triangle":0,"weights":[1,0,0]})", "target or entry"},
                      Refused{R"({"type":"pick","what":"target","body":2,"triangle":0,"weights":[1,0,0]})", "from 0 to 1"},
                      Refused{R"({"type":"pick","what":"target","body":-1,"triangle":0,"weights":[1,0,0]})", "from 0 to 1"},
                      Refused{R"({"type":"pick","what":"target","body":0,"triangle":200,"weights":[1,0,0]})", "from 0 to 199"},
                      Refused{R"({"type":"pick","what":"target","body":0,"triangle":99999999999999999999,"weights":[1,0,0]})", "from 0 to 199"},
                      Refused{R"({"type":"pick","what":"target","body":0,"triangle":0,"weights":[NaN,0,0]})", "no JSON object"},
                      Refused{R"({"type":"pick","what":"target","body":0,"triangle":0,"weights":[null,0,1]})", "with the sum 1"},
                      Refused{R"({"type":"pick","what":"target","body":0,"triangle":0,"weights":[2,-1,0]})", "with the sum 1"},
                      Refused{R"({"type":"pick","what":"target","body":0,"triangle":0,"weights":[0,0,0]})", "with the sum 1"},
                      Refused{R"({"type":"pick","what":"target","body":0,"triangle":0,"weights":[1,0]})", "with the sum 1"},
                      Refused{R"({"type":"save_scene"})", "\"target\" is missing"}, Refused{R"({"type":"save_scene","target":""})", "1 to 48 bytes"},
                      Refused{R"({"type":"save_scene","target":"a\u0000b"})", "no control characters"},
                      Refused{R"({"type":"save_scene_as","target":"picked"})", "\"name\" is missing"},
                      Refused{R"({"type":"save_scene_as","target":"picked","name":""})", "1 to 64 letters"},
                      Refused{R"({"type":"save_scene_as","target":"picked","name":"../scene"})", "1 to 64 letters"},
                      Refused{R"({"type":"save_scene_as","target":"picked","name":"/etc/passwd"})", "1 to 64 letters"},
                      Refused{R"({"type":"save_scene_as","target":"picked","name":".bashrc"})", "1 to 64 letters"},
                      Refused{R"({"type":"save_scene_as","target":"picked","name":7})", "expected a text"}),
    [](const auto& tested) { return "Number" + std::to_string(tested.index); });

TEST(ViewerMessages, ThatAreTooLongAreRefusedByTheirLength) {
    EXPECT_THAT(complaint(R"({"type":"pause","on":)" + std::string(kLongestMessage, ' ') + "true}"), HasSubstr("at most 2048"));
    EXPECT_THAT(complaint(R"({"type":"save_scene_as","target":"picked","name":")" + std::string(10'240, 'x') + "\"}"), HasSubstr("at most 2048"));
}

TEST(ViewerMessages, NestedDeeplyAreRefused) {
    EXPECT_THAT(complaint(std::string(1000, '[') + std::string(1000, ']')), HasSubstr("no JSON object"));
    EXPECT_THAT(complaint(R"({"type":"pause","on":)" + std::string(900, '[') + std::string(900, ']') + "}"), HasSubstr("true or false"));
}

/// Random bytes, and good messages with a few bytes changed, cut or doubled.
TEST(ViewerMessages, GarbageNeverBreaksTheReader) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE(fmt::format("seed {}", seed));
    std::mt19937 random(seed);
    const std::vector<std::string> good = {
        R"({"type":"drive","insertion":0.5,"rotation":-1})", R"({"type":"budget","mode":"wall","ms":0.5})",
        R"({"type":"pick","what":"target","body":0,"triangle":7,"weights":[0.25,0.25,0.5]})", R"({"type":"save_scene_as","target":"picked","name":"scene-2"})",
        R"({"type":"carm","primary":0.5,"secondary":-0.2,"zoom":2,"at_tip":true,"pixels":256,"display":"roadmap"})", R"({"type":"xray","on":true})",
        R"({"type":"grab","body":0,"vertex":7,"target":[0.1,0.2,0.3]})", R"({"type":"effect","name":"gravity","on":true})"};
    const auto pick = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
    unsigned understood = 0, refused = 0;
    for (int k = 0; k < 20'000; ++k) {
        std::string text = k % 4 == 0 ? std::string(pick(80), '\0') : good[pick(good.size())];
        if (k % 4 == 0)
            for (char& c : text) c = static_cast<char>(random());
        for (std::size_t change = pick(4); change > 0 && !text.empty(); --change) {
            const std::size_t at = pick(text.size());
            switch (pick(4)) {
            case 0:
                text[at] = static_cast<char>(random());
                break;
            case 1:
                text.erase(at, 1 + pick(5));
                break;
            case 2:
                text.insert(at, text.substr(pick(text.size()), pick(12)));
                break;
            default:
                text[at] = "{}[]\",:0123456789-eE"[pick(20)];
                break;
            }
        }
        const Result<Request> request = read_request(text, kRange);
        understood += request.ok();
        refused += !request.ok();
        if (!request.ok()) {
            EXPECT_FALSE(request.error().message.empty()) << text;
        } else if (const auto* command = std::get_if<Command>(&*request)) {
            if (const auto* drive = std::get_if<Drive>(command)) {
                EXPECT_LE(std::abs(drive->insertion), 1.0) << text;
            }
            if (const auto* grab = std::get_if<Grab>(command)) {
                EXPECT_LT(grab->vertex, 100u) << text;
            }
        } else if (const auto* picked = std::get_if<PickPlace>(&*request)) {
            EXPECT_LT(picked->triangle, 200u) << text;
            EXPECT_NEAR(picked->weights[0] + picked->weights[1] + picked->weights[2], 1.0, 1e-12) << text;
        } else if (const auto* save = std::get_if<SaveScene>(&*request)) {
            EXPECT_EQ(save->file_name.find('/'), std::string::npos) << text;
        }
    }
    EXPECT_GT(understood, 100u);
    EXPECT_GT(refused, 1000u);
}

} // namespace
} // namespace trocar::engine::viewer
