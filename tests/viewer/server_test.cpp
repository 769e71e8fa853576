// The server with unauthorised clients, viewers and a driver.
#include "live.hpp"

#include "../temp_folder.hpp"

#include "engine/report/picture_scene.hpp"
#include "engine/step/checkpoint.hpp"
#include "engine/time/clock.hpp"
#include "engine/viewer/gate.hpp"
#include "engine/viewer/hub.hpp"

#include <gmock/gmock.h>

#include <random>

namespace trocar::engine::viewer::test {
namespace {

using ::testing::HasSubstr;

TEST(ViewerGate, TokensAreLongAndNeverTheSame) {
    const std::string first = *make_token(), second = *make_token();
    EXPECT_GE(first.size(), 16u);
    EXPECT_NE(first, second);
    EXPECT_EQ(split_target("/ws?a=1&token=" + first + "&b").token, first);
    EXPECT_EQ(split_target("/ws?a=1&token=" + first).path, "/ws");
    for (const char* odd : {"", "?", "/?token", "/?&&&=", "/?token=", "/x?y?token=1"}) (void)split_target(odd);
}

TEST(ViewerServer, ShowsItsPageToHoldersOfTheToken) {
    const Live live;
    const std::string token = live.server->token();
    EXPECT_THAT(live.server->url(), HasSubstr("http://127.0.0.1:"));
    EXPECT_THAT(live.server->url(), HasSubstr("token=" + token));
    const Answer page = get(live, "/?token=" + token);
    EXPECT_EQ(page.status, 200u);
    EXPECT_THAT(page.body, HasSubstr("<title>page</title>"));
    EXPECT_EQ(page.response["Referrer-Policy"], "no-referrer"); // the token does not travel on
    EXPECT_EQ(get(live, "/?token=" + token, {}, http::verb::head).status, 200u);
    EXPECT_EQ(get(live, "/nothing?token=" + token).status, 404u);
    EXPECT_EQ(get(live, "/../../etc/passwd?token=" + token).status, 404u);
    EXPECT_EQ(get(live, "/?token=" + token, {}, http::verb::delete_).status, 405u);
    EXPECT_EQ(get(live, "/ws?token=" + token).status, 426u);
}

TEST(ViewerServer, KeepsStrangersOut) {
    const Live live;
    const std::string token = live.server->token(), host = fmt::format("127.0.0.1:{}", live.server->port());
    for (const std::string& wrong :
         std::vector<std::string>{"", "0", token.substr(1), token + "0", std::string(token.size(), 'f'), "%00"}) {
        EXPECT_EQ(get(live, "/?token=" + wrong).status, 403u) << wrong;
        EXPECT_EQ(get(live, "/recording.csv?token=" + wrong).status, 403u) << wrong;
    }
    EXPECT_EQ(get(live, "/").status, 403u);
    EXPECT_EQ(get(live, "/?token=" + token, {{"Host", "evil.example"}}).status, 403u); // a name rebound to this address
    EXPECT_EQ(get(live, "/?token=" + token, {{"Origin", "http://evil.example"}}).status, 403u);
    EXPECT_EQ(get(live, "/?token=" + token, {{"Origin", "https://" + host}}).status, 403u);
    EXPECT_EQ(get(live, "/?token=" + token, {{"Origin", "http://" + host}}).status, 200u);
    EXPECT_NO_THROW(Viewer(live, "http://" + host));
    EXPECT_THROW(Viewer(live, "http://evil.example"), boost::system::system_error);
    EXPECT_THROW(Viewer(live, "null"), boost::system::system_error);
}

TEST(ViewerServer, RefusesRequestsThatAreTooLongOrNone) {
    const Live live;
    EXPECT_GE(get(live, "/?token=" + live.server->token(), {{"Cookie", std::string(20'000, 'x')}}).status, 400u);
    const std::string long_target = "/" + std::string(20'000, 'a');
    EXPECT_GE(get(live, long_target).status, 400u);
    boost::asio::io_context io;
    Tcp::socket socket(io);
    for (const std::string& bytes : {std::string("\x16\x03\x01\x02garbage\r\n\r\n"), std::string(300, '\0'), std::string("GET\r\n\r\n")}) {
        socket = Tcp::socket(io);
        socket.connect(Tcp::endpoint(boost::asio::ip::make_address("127.0.0.1"), live.server->port()));
        beast::error_code failed;
        boost::asio::write(socket, boost::asio::buffer(bytes), failed);
        std::array<char, 256> answer{};
        (void)socket.read_some(boost::asio::buffer(answer), failed); // an answer or the end: it does not hang
    }
    EXPECT_EQ(get(live, "/?token=" + live.server->token()).status, 200u); // and others are served as before
}

TEST(ViewerServer, SendsSceneModelFramesAndStatus) {
    const Live live;
    Viewer viewer(live);
    const Json scene = viewer.await_type("scene");
    EXPECT_EQ(scene["name"], "bent-tube");
    EXPECT_EQ(scene["parts"].size(), 2u);
    EXPECT_EQ(scene["parts"][1]["kind"], "instrument");
    const Json first = viewer.await_type("status");
    for (const Json& point : first["steps"]) EXPECT_EQ(point.size(), 8u); // with force and insertion
    EXPECT_GE(viewer.binary_messages, 3u); // two models and a frame
    EXPECT_EQ(first["driver"], first["you"]);
    const Json later = viewer.await_status([&](const Json& status) { return status["step"] > first["step"]; });
    EXPECT_GT(later["step"], first["step"]);
    EXPECT_EQ(later["budget"]["mode"], "work");
}

TEST(ViewerServer, TellsThePageTheViewOfTheReportsPictures) {
    const Live live;
    const Json scene = Viewer(live).await_type("scene");
    const State state = make_initial_state(live.prepared.model);
    const Moment moment{.prepared = live.prepared, .state = state, .contacts = {}};
    for (const auto& [picture, name] :
         {std::pair{PictureView::Anatomy, "front"}, std::pair{PictureView::Fluoroscopy, "antero_posterior"}}) {
        const Camera camera = make_view(picture, moment, 640, 480).camera;
        const Vec3 into = (camera.look_at - camera.eye).normalized();
        for (int axis = 0; axis < 3; ++axis) {
            EXPECT_NEAR(scene["view"][name][static_cast<std::size_t>(axis)].get<double>(), into[axis], 1e-9) << name;
            EXPECT_EQ(scene["view"]["up"][static_cast<std::size_t>(axis)].get<double>(), Vec3::UnitZ()[axis]);
        }
    }
}

/// Drives as a page does, again and again (a drive command that is not repeated ends), to a status that `good` accepts.
Json drive_until(Viewer& driver, const std::string& wish, const std::function<bool(const Json&)>& good) {
    for (const auto end = std::chrono::steady_clock::now() + kPatience; std::chrono::steady_clock::now() < end;) {
        driver.send(wish);
        Json status = driver.await_type("status");
        if (status.is_null() || good(status)) return status;
    }
    return {};
}

TEST(ViewerServer, ADriverMovesTheCatheterAndALostOneLetsGo) {
    const Live live;
    double moving = 0.0;
    {
        Viewer driver(live);
        const double start = driver.await_type("status")["insertion_m"];
        const Json moved = drive_until(driver, R"({"type":"drive","insertion":1,"rotation":0.5})", [&](const Json& status) {
            return status["insertion_m"] > start + 1e-3 && status["rotation_rad"] > 0.0 && status["drive"][0] == 1.0;
        });
        ASSERT_FALSE(moved.is_null());
        moving = moved["drive"][0];
    } // the connection is lost during a drive command
    EXPECT_EQ(moving, 1.0);
    Viewer watcher(live);
    const Json still = watcher.await_status([](const Json& status) { return status["drive"][0] == 0.0; });
    EXPECT_FALSE(still.is_null());
    EXPECT_EQ(still["driver"], still["you"]); // the seat was free
}

/// A page that hangs sends nothing more: the drive command ends although the connection is open.
TEST(ViewerServer, ADriveCommandThatIsNotRepeatedEnds) {
    const Live live;
    Viewer driver(live);
    EXPECT_FALSE(drive_until(driver, R"({"type":"drive","insertion":1,"rotation":0})", [](const Json& status) {
                     return status["drive"][0] == 1.0;
                 }).is_null());
    EXPECT_FALSE(driver.await_status([](const Json& status) { return status["drive"][0] == 0.0; }).is_null());
}

TEST(ViewerServer, TellsThePageTheVesselsPlaces) {
    const Live live;
    const Json vessel = Viewer(live).await_type("scene")["vessel"];
    EXPECT_EQ(vessel["part"], 0);
    EXPECT_EQ(vessel["entry"]["name"], "entry of wire");
    EXPECT_EQ(vessel["entry"]["direction"], Json({0.0, 0.0, 1.0}));
    const std::size_t points = vessel["centreline"]["parents"].size();
    EXPECT_GT(points, 100u); // of about 150 mm
    EXPECT_EQ(vessel["centreline"]["points"].size(), 3 * points);
    EXPECT_EQ(vessel["centreline"]["parents"][0], -1);
    EXPECT_TRUE(vessel["centreline"]["vertices"].is_null()) << "the tube stands still";
}

TEST(ViewerServer, PicksAreTheDriversAndAllSeeThem) {
    const Live live;
    Viewer driver(live);
    EXPECT_TRUE(driver.await_type("picks")["target"].is_null());
    (void)driver.await_type("status");
    Viewer watcher(live);
    (void)watcher.await_type("status");
    const std::string pick = R"({"type":"pick","what":"target","body":0,"triangle":40,"weights":[1,0,0]})";
    for (const std::string& message : {pick, std::string(R"({"type":"unpick"})"), std::string(R"({"type":"save_scene","target":"picked"})")}) {
        watcher.send(message);
        EXPECT_THAT(watcher.await_type("error")["text"].get<std::string>(), HasSubstr("you watch")) << message;
    }
    driver.send(pick);
    for (Viewer* each : {&driver, &watcher}) {
        const Json picked = each->await_type("picks");
        EXPECT_NEAR(picked["target"]["radius"].get<double>(), 3e-3, 5e-4);
        EXPECT_TRUE(picked["entry"].is_null());
    }
    Viewer late(live);
    EXPECT_FALSE(late.await_type("picks")["target"].is_null());
    driver.send(R"({"type":"unpick"})");
    EXPECT_TRUE(driver.await_type("picks")["target"].is_null());
}

TEST(ViewerServer, SavesTheSceneWithItsPicks) {
    const TempFolder folder;
    const std::string text = engine::test::bent_tube_scene({35, "work:20000"});
    const std::filesystem::path file = folder.write("bent tube.json", text);
    const Scene scene = *read_scene(file);
    Live live(scene, *make_prepared_scene(scene));
    Viewer driver(live);
    (void)driver.await_type("status");
    driver.send(R"({"type":"save_scene","target":"picked"})");
    EXPECT_THAT(driver.await_type("error")["text"].get<std::string>(), HasSubstr("nothing is picked"));
    driver.send(R"({"type":"pick","what":"entry","body":0,"triangle":40,"weights":[1,0,0]})");
    (void)driver.await_type("picks");
    driver.send(R"({"type":"save_scene_as","target":"picked","name":"bent-2"})");
    const Json saved = driver.await_type("saved_scene");
    EXPECT_EQ(saved["file"], (folder.path() / "bent-2.json").string());
    EXPECT_EQ(saved["command"], "trocar view " + (folder.path() / "bent-2.json").string());
    EXPECT_TRUE(read_scene(folder.path() / "bent-2.json").ok());
    driver.send(R"({"type":"save_scene_as","target":"picked","name":"bent-2"})");
    EXPECT_THAT(driver.await_type("error")["text"].get<std::string>(), HasSubstr("already"));
    std::ifstream original(file);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(original), {}), text);
}

TEST(ViewerServer, SaysThatASceneOfNoFileHasNoFolder) {
    const Live live;
    Viewer driver(live);
    (void)driver.await_type("status");
    driver.send(R"({"type":"pick","what":"target","body":0,"triangle":40,"weights":[1,0,0]})");
    (void)driver.await_type("picks");
    driver.send(R"({"type":"save_scene","target":"picked"})");
    EXPECT_THAT(driver.await_type("error")["text"].get<std::string>(), HasSubstr("came from no file"));
}

TEST(ViewerServer, OneDrivesAndTheOthersWatch) {
    const Live live;
    Viewer driver(live);
    const Json seat = driver.await_type("status");
    Viewer watcher(live);
    (void)watcher.await_type("status");
    watcher.send(R"({"type":"pause","on":true})");
    EXPECT_THAT(watcher.await_type("error")["text"].get<std::string>(), HasSubstr("you watch"));
    watcher.send(R"({"type":"take"})");
    EXPECT_THAT(watcher.await_type("notice")["text"].get<std::string>(), HasSubstr("drives"));
    driver.send(R"({"type":"leave"})");
    EXPECT_FALSE(watcher.await_status([](const Json& status) { return status["driver"] == 0; }).is_null());
    watcher.send(R"({"type":"take"})");
    EXPECT_FALSE(watcher.await_status([](const Json& status) { return status["driver"] == status["you"]; }).is_null());
    watcher.send(R"({"type":"pause","on":true})");
    EXPECT_FALSE(watcher.await_status([](const Json& status) { return status["paused"] == true; }).is_null());
}

TEST(ViewerServer, AnswersGarbageWithErrorsAndGoesOn) {
    const Live live;
    Viewer viewer(live);
    for (const char* text : {"", "garbage", "{}", R"({"type":"nothing"})", R"({"type":"drive","insertion":7,"rotation":0})"}) {
        viewer.send(text);
        EXPECT_FALSE(viewer.await_type("error").is_null()) << text;
    }
    viewer.send(std::string(10'000, 'x'));
    EXPECT_THAT(viewer.await_type("error")["text"].get<std::string>(), HasSubstr("at most 2048"));
    viewer.send_bytes("\x01\x02\x03");
    EXPECT_THAT(viewer.await_type("error")["text"].get<std::string>(), HasSubstr("binary"));
    viewer.send(R"({"type":"ping","number":42})");
    EXPECT_EQ(viewer.await_type("pong")["number"], 42);
}

TEST(ViewerServer, ClosesOnAMessageBeyondAllMeasure) {
    const Live live;
    Viewer viewer(live);
    (void)viewer.await_type("status");
    viewer.send(std::string(70'000, 'x')); // one that the system takes whole: the reason comes back
    while (viewer.read()) {
    }
    EXPECT_EQ(viewer.reason().code, websocket::close_code::too_big);
    Viewer flood(live);
    EXPECT_THROW( // cut off while it sends, or when it has
        {
            flood.send(std::string(50'000'000, 'x'));
            while (flood.read()) {
            }
            throw boost::system::system_error(flood.ended());
        },
        boost::system::system_error);
    Viewer next(live);
    EXPECT_FALSE(next.await_type("status").is_null());
}

TEST(ViewerServer, FuzzedMessagesNeverStopIt) {
    const Live live;
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE(fmt::format("seed {}", seed));
    std::mt19937 random(seed);
    for (int round = 0; round < 20; ++round) {
        Viewer viewer(live);
        try {
            for (int k = 0; k < 50; ++k) {
                std::string text(random() % 200, ' ');
                for (char& c : text) c = static_cast<char>(round % 2 == 0 ? 32 + random() % 95 : random());
                if (random() % 3 == 0)
                    viewer.send_bytes(text);
                else
                    viewer.send(text); // bytes that are no UTF-8 end the connection, as they should
                if (k % 10 == 0) (void)viewer.read();
            }
        } catch (const boost::system::system_error&) {
        }
    }
    Viewer viewer(live);
    EXPECT_FALSE(viewer.await_type("status").is_null());
}

/// One that never reads: the others get their frames, and the simulation its steps.
TEST(ViewerServer, ASlowViewerDelaysNoOther) {
    const Live live;
    Viewer slow(live, {}, 4096);
    Viewer quick(live);
    // As many frames as the system's buffers do not hold for the slow one, by far: each has 3 KB or more.
    const Json later = quick.await_status([&](const Json&) { return quick.binary_messages > 250; });
    ASSERT_FALSE(later.is_null());
    const std::uint64_t goal = later["step"];
    const Json caught_up = slow.await_status([&](const Json& status) { return status["step"] > goal; });
    EXPECT_FALSE(caught_up.is_null()); // it goes on where the run is now
    EXPECT_EQ(slow.await_type("status")["not_shown"], 0);
}

TEST(ViewerServer, ServesTwentyViewers) {
    const Live live;
    std::vector<std::unique_ptr<Viewer>> viewers;
    for (int k = 0; k < 20; ++k) viewers.push_back(std::make_unique<Viewer>(live));
    unsigned drivers = 0;
    std::uint64_t step = 0;
    for (auto& viewer : viewers) {
        const Json status = viewer->await_status([&](const Json& json) { return json["viewers"] == 20 && json["step"] > step; });
        ASSERT_FALSE(status.is_null());
        step = status["step"];
        drivers += status["driver"] == status["you"];
    }
    EXPECT_EQ(drivers, 1u);
    viewers.resize(1);
    EXPECT_FALSE(viewers[0]->await_status([](const Json& json) { return json["viewers"] == 1; }).is_null());
}

TEST(ViewerServer, GivesTheRecordingAway) {
    const Live live;
    Viewer driver(live);
    driver.send(R"({"type":"drive","insertion":1,"rotation":0})");
    (void)driver.await_status([](const Json& status) { return status["insertion_m"] > 0.025; });
    driver.send(R"({"type":"pause","on":true})");
    const Json paused = driver.await_status([](const Json& status) { return status["paused"] == true; });
    const Answer answer = get(live, "/recording.csv?token=" + live.server->token());
    EXPECT_EQ(answer.status, 200u);
    EXPECT_THAT(std::string(answer.response[http::field::content_disposition]), HasSubstr("bent-tube.csv"));
    const auto rows = parse_path_csv(answer.body, "recording");
    ASSERT_TRUE(rows.ok()) << rows.error().to_string();
    EXPECT_EQ(rows->size(), paused["step"].get<std::size_t>() + 1);
    EXPECT_NEAR(rows->back().insertion, 1e3 * paused["insertion_m"].get<double>(), 1e-6);
}

TEST(ViewerServer, AStateIsSavedGoneBackToAndTakenAwayAsACheckpoint) {
    const Live live;
    const std::string token = live.server->token();
    Viewer driver(live);
    EXPECT_EQ(driver.await_type("scene")["most_saved"], kMostSaved);
    driver.send(R"({"type":"drive","insertion":1,"rotation":0})");
    (void)driver.await_status([](const Json& status) { return status["insertion_m"] > 0.022; });
    driver.send(R"({"type":"save","name":"here"})");
    const Json kept = driver.await_status([](const Json& status) { return status["saved"].size() == 1; })["saved"][0];
    EXPECT_EQ(kept["name"], "here");
    driver.send(R"({"type":"pause","on":true})");
    (void)driver.await_status([&](const Json& status) { return status["paused"] == true && status["step"] >= kept["step"]; });
    driver.send(R"({"type":"restore","saved":1})");
    const Json back = driver.await_status([](const Json& status) { return status["stepped"] == false; });
    EXPECT_EQ(back["step"], kept["step"]);
    EXPECT_EQ(back["time_s"], kept["time_s"]);
    const Answer file = get(live, "/state.bin?token=" + token + "&saved=1");
    ASSERT_EQ(file.status, 200u);
    EXPECT_THAT(std::string(file.response[http::field::content_disposition]), HasSubstr("bent-tube-here.bin"));
    const auto checkpoint = parse_checkpoint(file.body, "state.bin");
    ASSERT_TRUE(checkpoint.ok()) << checkpoint.error().to_string();
    EXPECT_EQ(checkpoint->step, kept["step"].get<std::uint64_t>());
    Simulator simulator(live.prepared.model);
    ASSERT_TRUE(resume(simulator, *checkpoint, "state.bin").ok());
    EXPECT_NEAR(simulator.report().insertion_m, back["insertion_m"].get<double>(), 1e-12);
    for (const char* none : {"", "&saved=2", "&saved=0", "&saved=one", "&saved=-1", "&saved=99999999999"})
        EXPECT_EQ(get(live, "/state.bin?token=" + token + none).status, 404u) << none;
    EXPECT_EQ(get(live, "/state.bin?saved=1").status, 403u);
    driver.send(R"({"type":"forget","saved":1})");
    EXPECT_FALSE(driver.await_status([](const Json& status) { return status["saved"].empty(); }).is_null());
}

TEST(ViewerHub, GivesEachOfThoseThatAskAtOnceTheStateThatItAskedFor) {
    const Scene scene = *parse_scene(engine::test::bent_tube_scene({35, "work:20000"}), "scenes/live.json");
    const PreparedScene prepared = *make_prepared_scene(scene);
    Session session(scene, prepared);
    Exchange exchange;
    open_exchange(session, exchange);
    for (const std::string_view name : {"first", "second"}) {
        SaveState save;
        std::copy(name.begin(), name.end(), save.name.begin());
        session.apply(save);
        session.step();
    }
    Hub hub(scene, prepared, session, exchange, {});
    std::vector<std::string> given;
    const auto ask = [&](std::uint32_t saved) {
        return hub.ask_for(Seal{saved}, [&](const Sealed& sealed) { given.emplace_back(sealed.saved ? sealed.saved->mark.name.data() : "none"); });
    };
    const SavedMarks saved = session.status().saved;
    ASSERT_EQ(saved.count, 2u);
    EXPECT_TRUE(ask(saved.marks[0].id) && ask(saved.marks[1].id) && ask(0));
    for (std::size_t k = 3; k < kMostSeals; ++k) EXPECT_TRUE(ask(saved.marks[0].id));
    EXPECT_FALSE(ask(saved.marks[0].id)) << "there is no room for its answer";
    RunStatistics tally;
    run_loop(session, exchange, {.steps = 1, .paced = false}, tally); // reads all of it before its step
    hub.start_ticking();
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (given.size() < kMostSeals && std::chrono::steady_clock::now() < end) hub.io().run_for(std::chrono::milliseconds(5));
    ASSERT_EQ(given.size(), kMostSeals);
    EXPECT_EQ(given[0], "first");
    EXPECT_EQ(given[1], "second");
    EXPECT_EQ(given[2], "none");
    EXPECT_EQ(given[3], "first");
    EXPECT_TRUE(ask(saved.marks[1].id));
}

/// The same run, command by command, with any number of viewers that come and go.
TEST(ViewerServer, WatchingChangesNothing) {
    const auto hash_after = [](bool watched) {
        const std::string text = engine::test::bent_tube_scene({35, "work:20000"});
        Scene scene = *parse_scene(text, "scenes/live.json");
        const PreparedScene prepared = *make_prepared_scene(scene);
        Session session(scene, prepared);
        Exchange exchange;
        open_exchange(session, exchange);
        exchange.viewers = watched ? 1 : 0;
        exchange.spheres = watched;
        session.apply(Drive{1.0, 0.3});
        RunStatistics tally;
        std::atomic<bool> done{false};
        std::thread looker([&] {
            while (!done) (void)exchange.snapshot.take();
        });
        run_loop(session, exchange, {300, false}, tally);
        done = true;
        looker.join();
        EXPECT_EQ(tally.steps, 300u);
        return hash_state(session.simulator().state());
    };
    EXPECT_EQ(hash_after(true), hash_after(false));
}

/// At the slowest pace, s that `steps` steps take; with commands throughout, or none.
double seconds_of(std::uint64_t steps, bool commanded) {
    Scene scene = *parse_scene(engine::test::bent_tube_scene({35, "work:20000"}), "scenes/live.json");
    const PreparedScene prepared = *make_prepared_scene(scene);
    Session session(scene, prepared);
    Exchange exchange;
    open_exchange(session, exchange);
    session.apply(Pace{kSlowestPace});
    std::atomic<bool> done{false};
    std::thread hand([&] {
        while (commanded && !done) {
            (void)exchange.commands.push(Drive{1.0, 0.0});
            std::this_thread::yield();
        }
    });
    RunStatistics tally;
    const StopWatch watch;
    run_loop(session, exchange, {steps, true}, tally);
    const double seconds = 1e-3 * watch.elapsed_ms();
    done = true;
    hand.join();
    return seconds;
}

TEST(ViewerServer, StepsOfACommandComeAtOnceButNeverMoreThanOneAheadOfTheClock) {
    constexpr double kInterval = 0.01 / kSlowestPace; // s
    EXPECT_GE(seconds_of(4, false), 2.999 * kInterval);
    EXPECT_GE(seconds_of(6, true), 3.999 * kInterval); // the first at once, the second ahead
    bool ahead = false;
    for (int tries = 0; tries < 20 && !ahead; ++tries) ahead = seconds_of(2, true) < kInterval; // one that nothing held up shows it
    EXPECT_TRUE(ahead);
}

/// A restart takes as long as dozens of steps: a person who presses R again and again waits for one.
TEST(ViewerServer, NoStepIsTakenBeforeTheFirstViewerWhereTheLoopWaitsForOne) {
    const Live live(engine::test::bent_tube_scene({35, "work:20000"}), {.wait_for_viewer = true});
    for (int k = 0; k < 20; ++k) {
        const Answer answer = get(live, "/recording.csv?token=" + live.server->token()); // no viewer: it takes a file away
        ASSERT_EQ(answer.status, 200u);
        ASSERT_THAT(answer.body, HasSubstr(", 0 steps.\n"));
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    {
        Viewer viewer(live);
        const Json first = viewer.await_type("status");
        EXPECT_GT(first["insertion_m"].get<double>(), 1e-3) << "where it begins";
        EXPECT_FALSE(viewer.await_status([](const Json& json) { return json["step"].get<int>() > 3; }).is_null());
    }
    Viewer second(live); // the first one has gone, and the run went on
    EXPECT_FALSE(second.await_status([](const Json& json) { return json["step"].get<int>() > 20; }).is_null());
}

TEST(ViewerServer, OfManyRestartsOneIsMadeAndWhatElseWasSaidHolds) {
    Scene scene = *parse_scene(engine::test::bent_tube_scene({35, "work:20000"}), "scenes/live.json");
    const PreparedScene prepared = *make_prepared_scene(scene);
    Session session(scene, prepared);
    Exchange exchange;
    open_exchange(session, exchange);
    RunStatistics tally;
    run_loop(session, exchange, {20, false}, tally);
    const std::uint64_t run = session.run();
    ASSERT_TRUE(exchange.commands.push(Pace{0.5}));
    ASSERT_TRUE(exchange.commands.push(Drive{-1.0, 0.0}));
    for (int k = 0; k < 200; ++k) ASSERT_TRUE(exchange.commands.push(Restart{}));
    ASSERT_TRUE(exchange.commands.push(Drive{1.0, 0.0}));
    run_loop(session, exchange, {5, false}, tally);
    EXPECT_EQ(session.run(), run + 1);
    EXPECT_EQ(session.simulator().state().step, 5u);
    EXPECT_EQ(session.status().pace, 0.5);
    EXPECT_EQ(session.status().drive.insertion, 1.0);
}

/// However full the way to the simulation is when its driver goes.
TEST(ViewerServer, TissueIsLetGoWhenItsDriverGoesInAFlood) {
    const Live live(engine::test::bent_tube_scene(
        {35, "work:20000", R"("elasticity", "damping", "coarse_contact", "exact_contact")", engine::test::kOrgan}));
    Viewer watcher(live);
    for (int round = 0; round < 3; ++round) {
        watcher.send(R"({"type":"leave"})");
        ASSERT_FALSE(watcher.await_status([](const Json& status) { return status["driver"] == 0; }).is_null());
        {
            Viewer driver(live);
            driver.send(R"({"type":"take"})");
            for (int k = 0; k < 600; ++k) driver.send(R"({"type":"grab","body":0,"vertex":3,"target":[0.05,0,0.05]})");
            ASSERT_FALSE(watcher.await_status([](const Json& status) { return status["grabbed"] == true; }).is_null());
        }
        EXPECT_FALSE(
            watcher.await_status([](const Json& status) { return status["driver"] == 0 && status["grabbed"] == false; }).is_null());
    }
}

TEST(ViewerServer, OpenConnectionsLockNoOtherOut) {
    const Live live;
    boost::asio::io_context io;
    std::vector<Tcp::socket> idle;
    for (std::size_t k = 0; k < 3 * kMostConnections; ++k) {
        idle.emplace_back(io);
        idle.back().connect(Tcp::endpoint(boost::asio::ip::make_address("127.0.0.1"), live.server->port()));
    }
    EXPECT_EQ(get(live, "/?token=" + live.server->token()).status, 200u);
    Viewer viewer(live);
    EXPECT_FALSE(viewer.await_type("status").is_null());
}

TEST(ViewerServer, ARecordingsFileNameIsPlainWhateverTheSceneIsCalled) {
    const std::string text = engine::test::bent_tube_scene({35, "work:20000"});
    const std::size_t name = text.find("bent-tube");
    const Live live(text.substr(0, name) + R"(../a\"; b=c)" + text.substr(name + 9));
    EXPECT_EQ(std::string(get(live, "/recording.csv?token=" + live.server->token()).response[http::field::content_disposition]),
              "attachment; filename=\"___a___b_c.csv\"");
}

TEST(ViewerServer, SaysThatAPortIsTaken) {
    const Live live;
    const Session session(live.scene, live.prepared); // the first one's belongs to its loop
    Exchange exchange;
    const auto second = Server::open(live.scene, live.prepared, session, exchange, {"127.0.0.1", live.server->port(), ""});
    ASSERT_FALSE(second.ok());
    EXPECT_THAT(second.error().to_string(), HasSubstr(std::to_string(live.server->port())));
    EXPECT_FALSE(Server::open(live.scene, live.prepared, session, exchange, {"nowhere", 0, ""}).ok());
}

} // namespace
} // namespace trocar::engine::viewer::test
