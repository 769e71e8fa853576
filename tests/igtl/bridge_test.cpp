// The bridge against the library's own client: surfaces, tips, state, drive commands, and bytes that are none of these.
#include "live.hpp"

#include <gmock/gmock.h>

#ifndef TROCAR_OPENIGTLINK

TEST(IgtlBridge, IsTestedWhereTheLibraryIs) { GTEST_SKIP() << "OpenIGTLink was not found when this was configured: libopenigtlink-dev"; }

#else

#include "engine/igtl/bytes.hpp"
#include "engine/scene/scene.hpp"

#include <igtl_util.h>

#include <bit>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>

#include <unistd.h>

/// What its client unpacks, and a CAPABILITY that is packed, the library does not free.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libOpenIGTLink\n"; }

namespace trocar::engine::igtl::test {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

/// Header and body as a stranger writes them.
std::string raw(const std::string& type, const std::string& name, const std::string& body, std::optional<std::uint64_t> size = {}, std::uint16_t version = 1,
                std::uint64_t crc_change = 0) {
    std::string bytes(kHeaderSize, '\0');
    put_number<std::uint16_t>(bytes, 0, version);
    std::copy_n(type.data(), std::min<std::size_t>(type.size(), 12), bytes.data() + 2);
    std::copy_n(name.data(), std::min<std::size_t>(name.size(), 20), bytes.data() + 14);
    put_number<std::uint64_t>(bytes, 42, size.value_or(body.size()));
    std::string copy = body;
    put_number<std::uint64_t>(bytes, 50, crc64(reinterpret_cast<unsigned char*>(copy.data()), copy.size(), 0) ^ crc_change);
    return bytes + body;
}

std::string string_body(const std::string& text) {
    std::string body(4, '\0');
    put_number<std::uint16_t>(body, 0, 3);
    put_number<std::uint16_t>(body, 2, static_cast<std::uint16_t>(text.size()));
    return body + text;
}

std::string transform_body(const std::array<float, 12>& numbers) {
    std::string body(48, '\0');
    for (std::size_t k = 0; k < 12; ++k) put_number(body, 4 * k, std::bit_cast<std::uint32_t>(numbers[k]));
    return body;
}

/// Others are served, and the simulation goes on: a new client is shown the session as it is then, however short the visits are. A run that
/// was left paused goes on as soon as one of them has the seat, which a client that has gone may still have.
void expect_alive(Live& live) {
    std::optional<std::int64_t> first;
    std::size_t visits = 0;
    for (const std::int64_t end = monotonic_ns() + kPatienceNs; monotonic_ns() < end; ++visits) {
        Client client(live);
        client.say("go on");
        const auto state = client.await_state([](const auto&) { return true; });
        if (state.is_null()) continue; // the places of those who have gone were not free yet
        if (!first) first = state["step"];
        if (state["step"] > *first) return;
    }
    FAIL() << "no step after step " << first.value_or(-1) << " in " << visits << " visits";
}

TEST(IgtlBridge, SendsEverySurfaceAndWhoIsWhoToANewClient) {
    Live live;
    Client client(live);
    const auto scene = client.await("STRING", "trocar_scene");
    ASSERT_TRUE(scene);
    const auto described = nlohmann::json::parse(unpack<::igtl::StringMessage>(*scene)->GetString());
    EXPECT_EQ(described["scene"], "bent-tube");
    EXPECT_EQ(described["units"], "mm, RAS");
    EXPECT_EQ(described["instruments"][0]["drive"], "wire_drive");
    const auto tube = client.await("POLYDATA", "tube"), wire = client.await("POLYDATA", "wire");
    ASSERT_TRUE(tube && wire);
    const auto surface = unpack<::igtl::PolyDataMessage>(*tube);
    ASSERT_TRUE(surface.IsNotNull());
    const TriMesh& expected = live.prepared.model.bodies[0].surface;
    ASSERT_EQ(surface->GetPoints()->GetNumberOfPoints(), static_cast<int>(expected.vertices.size()));
    ASSERT_EQ(surface->GetPolygons()->GetNumberOfCells(), expected.triangles.size());
    for (Index v = 0; v < expected.vertices.size(); ++v) {
        float point[3];
        surface->GetPoints()->GetPoint(v, point);
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(point[axis], 1e3 * expected.vertices[v][axis], 1e-4);
    }
    for (Index t = 0; t < expected.triangles.size(); ++t) {
        igtlUint32 corners[3];
        surface->GetPolygons()->GetCell(t, corners);
        for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(corners[k], expected.triangles[t][k]);
    }
}

/// In the last frame of a run that is paused: what moves is where State says.
TEST(IgtlBridge, TipAndSkinAreWhereTheStateHasThem) {
    Live live;
    Client client(live);
    client.say("insert wire 30");
    ASSERT_FALSE(client.await_state([](const auto& state) { return state["insertion_mm"] > 60.0 && state["step"] > 20; }).is_null()); // in the bend
    client.say("pause");
    std::optional<Message> tip, skin;
    (void)client.await([&](const Message& message) {
        if (message.type == "TRANSFORM" && message.name == "wire_tip") tip = message;
        if (message.type == "POLYDATA" && message.name == "wire") skin = message;
        return message.type == "STATUS" && std::string(unpack<::igtl::StatusMessage>(message)->GetStatusString()) == "paused";
    });
    ASSERT_TRUE(tip && skin);
    live.stop();
    const State& state = live.session->simulator().state();
    const std::vector<Vec3>& rod = state.instruments[0].rod.position;
    ::igtl::Matrix4x4 m;
    unpack<::igtl::TransformMessage>(*tip)->GetMatrix(m);
    EXPECT_NEAR(tip->time_s, state.time, 1e-6);
    const Vec3 direction = (rod.back() - rod[rod.size() - 2]).normalized();
    Eigen::Matrix3d turn;
    for (int row = 0; row < 3; ++row) {
        EXPECT_NEAR(m[row][3], 1e3 * rod.back()[row], 1e-4);
        EXPECT_NEAR(m[row][2], direction[row], 1e-6);
        for (int column = 0; column < 3; ++column) turn(row, column) = m[row][column];
    }
    EXPECT_LT((turn.transpose() * turn - Eigen::Matrix3d::Identity()).norm(), 1e-6);
    EXPECT_NEAR(turn.determinant(), 1.0, 1e-6);
    const auto surface = unpack<::igtl::PolyDataMessage>(*skin);
    ASSERT_TRUE(surface.IsNotNull()); // its checksum holds, too
    ASSERT_EQ(surface->GetPoints()->GetNumberOfPoints(), static_cast<int>(state.instruments[0].skin.size()));
    for (std::size_t v = 0; v < state.instruments[0].skin.size(); ++v) {
        float point[3];
        surface->GetPoints()->GetPoint(static_cast<unsigned>(v), point);
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(point[axis], 1e3 * state.instruments[0].skin[v][axis], 1e-4);
    }
}

TEST(IgtlBridge, DeformingBodiesComeAsTheyMoveAndOthersOnce) {
    engine::test::BentTube scene{35, "work:50000", R"("elasticity", "damping", "coarse_contact", "exact_contact")"};
    scene.host_body = engine::test::kOrgan +
                      R"("stone": {"kind": "static", "surface": {"shape": "box", "centre": [0, 90, 0], "extent": [5, 5, 5], "cells": 2}},)";
    Live live(engine::test::bent_tube_scene(scene));
    Client client(live);
    std::map<std::string, int> counts;
    (void)client.await([&](const Message& message) {
        if (message.type == "POLYDATA") ++counts[message.name];
        return counts["organ"] >= 5;
    });
    EXPECT_GE(counts["organ"], 5);
    EXPECT_GE(counts["wire"], 3);
    EXPECT_EQ(counts["stone"], 1);
    const auto ask = ::igtl::GetPolyDataMessage::New();
    ask->SetDeviceName("");
    ask->Pack();
    EXPECT_TRUE(client.send(ask->GetPackPointer(), static_cast<std::size_t>(ask->GetPackSize())));
    EXPECT_TRUE(client.await("POLYDATA", "stone")) << "all of it again when it is asked for";
}

/// Nothing is copied while nobody watches: what was copied last is as old as the last visit.
TEST(IgtlBridge, ANewClientSeesTheSessionAsItIsThen) {
    Live live(engine::test::bent_tube_scene({35, "work:20000"}), 60.0, false);
    for (const std::uint64_t visit : {1, 2}) {
        live.run(40);
        Client client(live);
        ASSERT_TRUE(await([&] { return live.exchange.joined == visit; }));
        live.run(1);
        const auto tip = client.await("TRANSFORM", "wire_tip");
        ASSERT_TRUE(tip);
        EXPECT_NEAR(tip->time_s, live.session->simulator().state().time, 1e-6) << "its first frame";
        client.close();
        ASSERT_TRUE(await([&] { return live.exchange.viewers == 0; }));
    }
}

/// Of all turns with the same matrix the nearest is meant: to where the handle is, not to where the last one to watch saw it.
TEST(IgtlBridge, ATransformThatComesFirstIsMeasuredFromWhereTheHandleIsThen) {
    Live live(engine::test::bent_tube_scene({35, "work:20000"}), 60.0, false);
    live.session->apply(viewer::Drive{0.0, 1.0});
    for (int k = 0; k < 100 && live.session->simulator().state().instruments[0].rod.rotation < 4.0; ++k) live.run(20);
    live.session->apply(viewer::Drive{});
    live.run(1);
    const fem::RodState& rod = live.session->simulator().state().instruments[0].rod;
    const double rotation = rod.rotation;
    ASSERT_GT(rotation, 3.9);
    Client client(live);
    client.drive_to(1e3 * rod.insertion, rotation);
    ASSERT_TRUE(await([&] { return live.exchange.joined == 1; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(50)); // it is read before there is a frame
    live.run(1);
    ASSERT_TRUE(await([&] { return live.exchange.commands.read_available() > 0; }));
    live.run(150);
    EXPECT_NEAR(rod.rotation, rotation, 1e-3);
}

TEST(IgtlBridge, SendsNoMoreFramesThanAskedFor) {
    Live live(engine::test::bent_tube_scene({35, "work:20000"}), 5.0);
    const std::int64_t start = monotonic_ns(); // the first frame is later
    Client client(live);
    for (int k = 0; k < 6; ++k) ASSERT_TRUE(client.await("TRANSFORM", "wire_tip"));
    EXPECT_GT(monotonic_ns() - start, 999'000'000) << "six frames, 200 ms apart";
}

TEST(IgtlBridge, ATransformDrivesTheInstrumentToItsPlace) {
    Live live;
    Client client(live);
    ASSERT_FALSE(client.await_state([](const auto&) { return true; }).is_null());
    client.drive_to(31.5, 0.75);
    const auto there = client.await_state([](const auto& state) {
        return std::abs(state["insertion_mm"].template get<double>() - 31.5) < 1e-3 && std::abs(state["rotation_rad"].template get<double>() - 0.75) < 1e-3;
    });
    EXPECT_FALSE(there.is_null());
    client.drive_to(25.0, 3.0);
    EXPECT_FALSE(client.await_state([](const auto& state) { return std::abs(state["rotation_rad"].template get<double>() - 3.0) < 1e-3; }).is_null());
    client.drive_to(25.0, 3.5 - 2.0 * M_PI); // a handle that is turned on and on
    EXPECT_FALSE(client.await_state([](const auto& state) { return std::abs(state["rotation_rad"].template get<double>() - 3.5) < 1e-3; }).is_null());
}

TEST(IgtlBridge, CommandsPauseStepGoOnAndRestart) {
    Live live;
    Client client(live);
    client.say("insert wire 20");
    ASSERT_FALSE(client.await_state([](const auto& state) { return state["insertion_mm"] > 24.0; }).is_null());
    client.say("pause");
    std::uint64_t step = 0;
    (void)client.await([&](const Message& message) {
        if (message.name == "trocar_state") step = nlohmann::json::parse(unpack<::igtl::StringMessage>(message)->GetString())["step"];
        return message.type == "STATUS" && std::string(unpack<::igtl::StatusMessage>(message)->GetStatusString()) == "paused";
    });
    client.say("step");
    EXPECT_FALSE(client.await_state([&](const auto& state) { return state["step"] == step + 1; }).is_null());
    client.say("restart");
    EXPECT_FALSE(client.await_state([](const auto& state) { return state["step"] == 0 && state["run"] == 2; }).is_null());
    client.say("go on");
    const auto still = client.await_state([](const auto& state) { return state["step"] > 10; });
    ASSERT_FALSE(still.is_null());
    EXPECT_NEAR(still["insertion_mm"].get<double>(), 20.0, 1e-6) << "a restart ends the drive command";
}

/// A connection that ends lets go of the handle, and its seat is free.
TEST(IgtlBridge, OneClientDrivesAndALostOneLetsGo) {
    Live live;
    Client watcher(live);
    {
        Client driver(live);
        driver.say("insert wire 10");
        EXPECT_THAT(driver.await_status(5), HasSubstr("drives")) << "the first one has the seat";
        watcher.say("leave");
        ASSERT_FALSE(watcher.await_state([](const auto& state) { return state["step"] > 3; }).is_null());
        for (bool moves = false; !moves;) {
            driver.say("insert wire 10");
            const auto state = driver.await_state([](const auto&) { return true; });
            ASSERT_FALSE(state.is_null());
            moves = state["insertion_mm"] > 22.0;
        }
        watcher.say("pause");
        EXPECT_THAT(watcher.await_status(5), HasSubstr("drives"));
    }
    double last = 0.0;
    const auto still = watcher.await_state([&](const auto& state) {
        const double now = state["insertion_mm"], before = std::exchange(last, now);
        return now > 21.9 && now == before;
    });
    EXPECT_FALSE(still.is_null());
    EXPECT_TRUE(watcher.await([&](const Message& message) {
        if (message.name == "trocar_state") watcher.say("pause");
        return message.type == "STATUS" && std::string(unpack<::igtl::StatusMessage>(message)->GetStatusString()) == "paused";
    }));
}

TEST(IgtlBridge, ReadsHeadersOfVersionTwo) {
    Live live;
    Client client(live);
    std::string body(12, '\0');
    put_number<std::uint16_t>(body, 0, 12); // the second header
    put_number<std::uint16_t>(body, 2, 2);  // the metadata's own
    put_number<std::uint32_t>(body, 4, 5);  // and its text
    body += string_body("pause") + std::string("\0\0 meta", 7);
    EXPECT_TRUE(client.send(raw("STRING", "trocar_command", body, {}, 2)));
    EXPECT_TRUE(client.await([](const Message& message) {
        return message.type == "STATUS" && std::string(unpack<::igtl::StatusMessage>(message)->GetStatusString()) == "paused";
    }));
}

TEST(IgtlBridge, AnswersWhatItIsAsked) {
    Live live;
    Client client(live);
    EXPECT_TRUE(client.send(raw("GET_CAPABIL", "", "")));
    EXPECT_TRUE(client.await("CAPABILITY", "trocar"));
    EXPECT_EQ(client.await_status(1), "running");
    EXPECT_TRUE(client.send(raw("GET_STATUS", "", "")));
    EXPECT_EQ(client.await_status(1), "running");
}

TEST(IgtlBridge, RefusesWithASentenceAndGoesOn) {
    Live live;
    Client client(live);
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    const std::array<float, 12> unit{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 30};
    auto nans = unit;
    nans[11] = kNan;
    const auto expect = [&](const std::string& bytes, int code, const std::string& text) {
        EXPECT_TRUE(client.send(bytes));
        EXPECT_THAT(client.await_status(code), HasSubstr(text));
    };
    expect(raw("TRANSFORM", "pump_drive", transform_body(unit)), 4, "expected \"wire_drive\"");
    expect(raw("TRANSFORM", "wire_drive", transform_body(nans)), 12, "not finite");
    expect(raw("TRANSFORM", "wire_drive", transform_body(unit).substr(0, 47)), 12, "expected 48");
    expect(raw("TRANSFORM", "wire_drive", transform_body(unit) + "x"), 12, "expected 48");
    expect(raw("TRANSFORM", "wire_drive", ""), 12, "expected 48");
    expect(raw("TRANSFORM", "wire_drive", transform_body(unit), {}, 1, 1), 9, "checksum");
    expect(raw("STRING", "x", string_body("pause").substr(0, 7)), 12, "length");
    expect(raw("STRING", "x", ""), 12, "length");
    expect(raw("STRING", "x", string_body("insert pump 5")), 4, "no instrument");
    expect(raw("STRING", "x", string_body(std::string("pau\0se", 6))), 12, "no command");
    expect(raw("STRING", "x", std::string(11, '\xff'), {}, 2), 12, "second header");
    expect(raw("IMAGE", "x", std::string(1000, 'i')), 12, "IMAGE means nothing here");
    expect(raw("POLYDATA", "x", std::string(40, '\xff')), 12, "POLYDATA means nothing here");
    expect(raw("STRING", "x", string_body("dance")), 12, "no command");
    EXPECT_TRUE(client.send(raw("IMAGE", "large", std::string(3'000'000, 'i')))); // passed over
    expect(raw("STRING", "x", string_body("dance")), 12, "no command");
    const auto said = live.said();
    EXPECT_EQ(std::set<std::string>(said.begin(), said.end()).size(), said.size()) << "each once";
    EXPECT_LE(said.size(), 7u);
    EXPECT_THAT(said, Contains(HasSubstr("3000000 bytes")));
    expect_alive(live);
}

TEST(IgtlBridge, DisconnectsWhoSendsNoMessages) {
    Live live;
    for (const std::string& bytes : {std::string("POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\n\r\n"), std::string(kHeaderSize, '\xff'),
                                     std::string(kHeaderSize, '\0'), raw("STRING", "x", "", std::uint64_t{1'000'000'000}),
                                     raw("STRING", "x", "", ~std::uint64_t{0}), raw("POLYDATA", "x", "", std::uint64_t{1} << 63)}) {
        Client client(live);
        ASSERT_TRUE(client.send(bytes));
        const std::int64_t end = monotonic_ns() + kPatienceNs;
        while (client.read() && monotonic_ns() < end) {}
        EXPECT_LT(monotonic_ns(), end) << "it is still connected";
    }
    expect_alive(live);
}

/// Whole messages with bytes changed, cut off at any place, and connections that end in the middle.
TEST(IgtlBridge, RandomBytesBreakNothing) {
    Live live;
    std::mt19937 random(11);
    const std::vector<std::string> seeds{raw("TRANSFORM", "wire_drive", transform_body({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 30})), raw("STRING", "x", string_body("pause")),
                                         raw("STRING", "x", string_body("go on")), raw("GET_POLYDATA", "", ""), raw("IMAGE", "x", std::string(200, 'i')),
                                         raw("STRING", "x", std::string("\0\x0c\0\0\0\0\0\0\0\0\0\0\0\x03\0\x05pause", 21), {}, 2)};
    for (int k = 0; k < 150; ++k) {
        Client client(live);
        for (std::size_t messages = random() % 4 + 1; messages > 0; --messages) {
            std::string bytes = seeds[random() % seeds.size()];
            for (std::size_t changes = random() % 4; changes > 0; --changes) bytes[random() % bytes.size()] = static_cast<char>(random());
            if (random() % 3 == 0) bytes.resize(random() % bytes.size());
            if (!client.send(bytes)) break;
        }
        if (random() % 2 == 0) (void)client.read();
    }
    expect_alive(live);
    EXPECT_LE(live.said().size(), 7u);
}

/// They take all places and read nothing: the simulation goes on, memory does not grow, and a place that gets free is served.
TEST(IgtlBridge, ClientsThatNeverReadAndTooManyOfThemHoldUpNothing) {
    Live live;
    const auto resident = [] {
        std::ifstream file("/proc/self/statm");
        std::size_t size = 0, pages = 0;
        file >> size >> pages;
        return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
    };
    std::vector<std::unique_ptr<Client>> silent;
    Client watcher(live);
    ASSERT_FALSE(watcher.await_state([](const auto&) { return true; }).is_null());
    while (silent.size() < 3 * kMostClients) silent.push_back(std::make_unique<Client>(live));
    const auto before = watcher.await_state([](const auto&) { return true; });
    const std::size_t memory = resident();
    for (const auto& client : silent)
        for (int k = 0; k < 100; ++k) (void)client->send(raw("GET_POLYDATA", "", "") + raw("STRING", "x", string_body("dance")));
    const auto after = watcher.await_state([&](const auto& state) { return state["step"] > before["step"].template get<int>() + 100; });
    EXPECT_FALSE(after.is_null());
    EXPECT_LT(resident(), memory + (64u << 20));
    EXPECT_THAT(live.said(), Contains(HasSubstr("more than 16 clients")));
    silent.clear();
    watcher.close();
    for (const std::int64_t end = monotonic_ns() + kPatienceNs; monotonic_ns() < end;) { // until the ends have been seen
        Client client(live);
        if (client.read()) break;
    }
    expect_alive(live);
}

/// What was driven over the bridge is a recording like any other.
TEST(IgtlBridge, ARunThatWasDrivenIsRecordedAndRepeats) {
    Live live;
    Client client(live);
    client.drive_to(45.0, 1.0);
    ASSERT_FALSE(client.await_state([](const auto& state) { return state["insertion_mm"] > 44.0; }).is_null());
    client.say("insert wire -12");
    ASSERT_FALSE(client.await_state([](const auto& state) { return state["insertion_mm"] < 40.0; }).is_null());
    live.stop();
    const auto& recording = live.session->recording();
    ASSERT_TRUE(recording->repeatable());
    const std::uint64_t hash = hash_state(live.session->simulator().state());
    const auto file = std::filesystem::temp_directory_path() / fmt::format("trocar-igtl-{}.csv", getpid());
    std::ofstream(file) << recording->text(live.scene, recording->steps(), hash);
    Scene scene = live.scene;
    const auto path = read_instrument_paths(scene, file);
    std::filesystem::remove(file);
    ASSERT_TRUE(path.ok()) << path.error().to_string();
    const Result<PreparedScene> prepared = make_prepared_scene(scene);
    ASSERT_TRUE(prepared.ok());
    Simulator simulator(prepared->model);
    for (std::size_t k = 0; k < recording->steps(); ++k) simulator.step();
    EXPECT_EQ(hash_state(simulator.state()), hash);
}

TEST(IgtlBridge, SaysWhenThePortIsTaken) {
    Live live;
    viewer::Exchange exchange;
    viewer::open_exchange(*live.session, exchange);
    viewer::ServerOptions options;
    options.serves_page = false;
    BridgeOptions bridge;
    bridge.port = live.port;
    options.beside = [&](viewer::Hub& hub) { return Bridge::open(hub, live.prepared.model, bridge); };
    const auto second = viewer::Server::open(live.scene, live.prepared, *live.session, exchange, options);
    ASSERT_FALSE(second.ok());
    EXPECT_EQ(second.error().key, "--igtl");
    EXPECT_THAT(second.error().message, HasSubstr("cannot listen"));
}

} // namespace
} // namespace trocar::engine::igtl::test

#endif
