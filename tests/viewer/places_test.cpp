// Places in the middle of a vessel from clicks on its wall, and the scenes that are saved with them.
#include "../temp_folder.hpp"

#include "base/inside.hpp"
#include "engine/experiments/plan_scene.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/step/simulator.hpp"
#include "engine/viewer/picked_scene.hpp"
#include "spheretree/lumen/lumen_path.hpp"

#include <fmt/format.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <sstream>

namespace trocar::engine::viewer {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

std::string read_text(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file, std::ios::binary).rdbuf();
    return text.str();
}

/// The sentence that refuses it; empty: it was taken.
template <class T>
std::string why(const Result<T>& result) {
    return result.ok() ? std::string() : result.error().message;
}

/// A shipped scene, prepared once.
struct Shipped {
    std::string text;
    Scene scene;
    PreparedScene prepared;

    [[nodiscard]] const InstrumentModel& instrument() const { return prepared.model.instruments[kLeadInstrument]; }
    [[nodiscard]] const BodyModel& vessel() const { return prepared.model.bodies[instrument().lumen]; }
};
const Shipped& shipped(const std::string& name) {
    static std::map<std::string, Shipped> known;
    if (const auto found = known.find(name); found != known.end()) return found->second;
    const fs::path file = fs::path(TROCAR_SOURCE_DIR) / "assets/scenes" / (name + ".json");
    Shipped& made = known[name];
    made.text = read_text(file);
    made.scene = *read_scene(file);
    made.prepared = *make_prepared_scene(made.scene);
    return made;
}

/// Points of a wall, as likely in every place of it.
class RandomClicks {
public:
    explicit RandomClicks(const TriMesh& wall) : wall_(wall) {
        std::vector<double> areas;
        for (const auto& [a, b, c] : wall.triangles)
            areas.push_back((wall.vertices[b] - wall.vertices[a]).cross(wall.vertices[c] - wall.vertices[a]).norm());
        triangles_ = std::discrete_distribution<Index>(areas.begin(), areas.end());
    }
    PickPlace next(PickPlace::What what, std::size_t body) {
        std::array<double, 3> weights{};
        for (double& weight : weights) weight = std::exponential_distribution<double>()(random_);
        const double sum = weights[0] + weights[1] + weights[2];
        for (double& weight : weights) weight /= sum;
        return {what, static_cast<std::uint32_t>(body), triangles_(random_), weights};
    }
    [[nodiscard]] Vec3 point(const PickPlace& click) const {
        Vec3 p = Vec3::Zero();
        for (std::size_t k = 0; k < 3; ++k) p += click.weights[k] * wall_.vertices[wall_.triangles[click.triangle][k]];
        return p;
    }
    [[nodiscard]] unsigned seed() const { return seed_; }

private:
    const TriMesh& wall_;
    const unsigned seed_ = std::random_device{}();
    std::mt19937 random_{seed_};
    std::discrete_distribution<Index> triangles_;
};

/// The triangle of a wall that is nearest to a point.
PickPlace click_near(const Shipped& scene, PickPlace::What what, const Vec3& p) {
    const SurfacePoint near = *TriangleTree(scene.vessel().surface).closest(p);
    return {what, static_cast<std::uint32_t>(scene.instrument().lumen), near.triangle, near.bary};
}

/// Of the widest inscribed sphere that holds p.
double local_radius(const spheretree::LumenTree& lumen, const Vec3& p) {
    double radius = 0.0;
    for (Index ball = 0; ball < lumen.ball_count(); ++ball)
        if ((lumen.ball(ball).centre - p).norm() <= lumen.ball(ball).radius) radius = std::max(radius, lumen.ball(ball).radius);
    return radius;
}

class PickedIn : public ::testing::TestWithParam<std::string> {
protected:
    const Shipped& scene_ = shipped(GetParam());
    const TriMesh& wall_ = scene_.vessel().surface;
    const InsideTest inside_{wall_};
};

TEST_P(PickedIn, TargetsLieInTheMiddleOfTheVesselThatWasClicked) {
    Picker picker(scene_.prepared.model);
    ASSERT_NE(picker.places(), nullptr);
    const std::vector<Vec3>& points = picker.places()->centreline().points;
    RandomClicks clicks(wall_);
    SCOPED_TRACE(fmt::format("seed {}", clicks.seed()));
    for (int k = 0; k < 500; ++k) {
        const PickPlace click = clicks.next(PickPlace::What::Target, scene_.instrument().lumen);
        ASSERT_TRUE(picker.pick(click).ok());
        const MiddlePlace& place = *picker.picks().target;
        const Vec3 wall = clicks.point(click);
        SCOPED_TRACE(fmt::format("click {} at {:.4f} {:.4f} {:.4f}", k, wall.x(), wall.y(), wall.z()));
        const double clearance = -inside_.signed_distance(place.position);
        ASSERT_TRUE(inside_.inside(place.position));
        EXPECT_NEAR(clearance, place.radius, 1e-9);
        const bool on_centreline = std::find(points.begin(), points.end(), place.position) != points.end();
        // At a fork, or at the neck of a sac, the wider part's sphere holds places of the narrower one's centreline.
        EXPECT_GE(clearance, (on_centreline ? 0.3 : 0.5) * local_radius(*scene_.vessel().lumen, place.position));
        EXPECT_GE(clearance, scene_.instrument().rod.design.radius);
        EXPECT_LT((wall - place.position).norm(), 3.0 * clearance) << "of this vessel, not of its neighbour";
        EXPECT_GT(spheretree::free_radius_at(*scene_.vessel().lumen, 0.5 * (wall + place.position)), 0.0) << "and nothing stands between";
    }
}

TEST_P(PickedIn, EntriesLieOnTheCentrelineAndLeadIntoTheVessel) {
    Picker picker(scene_.prepared.model);
    RandomClicks clicks(wall_);
    SCOPED_TRACE(fmt::format("seed {}", clicks.seed()));
    const double radius = scene_.instrument().rod.design.radius;
    for (int k = 0; k < 200; ++k) {
        const PickPlace click = clicks.next(PickPlace::What::Entry, scene_.instrument().lumen);
        ASSERT_TRUE(picker.pick(click).ok());
        const PickedEntry& entry = *picker.picks().entry;
        const std::vector<Vec3>& points = picker.places()->centreline().points;
        EXPECT_NE(std::find(points.begin(), points.end(), entry.place.position), points.end());
        EXPECT_NEAR(entry.place.direction.norm(), 1.0, 1e-12);
        EXPECT_GE(entry.free_ahead, radius) << "there is room ahead";
        EXPECT_TRUE(inside_.inside(entry.place.position + entry.free_ahead * entry.place.direction));
    }
}

/// At an end a click anywhere near it takes the end, and the direction is away from the end's cap.
TEST_P(PickedIn, EntriesAtEndsAreTheEnds) {
    Picker picker(scene_.prepared.model);
    const LumenPlaces& places = *picker.places();
    const spheretree::CentrelineTree& centreline = places.centreline();
    EXPECT_GE(places.ends().size(), 2u);
    for (const Index end : places.ends()) {
        const Vec3 at = centreline.points[end];
        ASSERT_TRUE(picker.pick(click_near(scene_, PickPlace::What::Entry, at)).ok());
        EXPECT_EQ(picker.picks().entry->place.position, at);
        const Index inner = end == 0 ? 1 : centreline.parents[end];
        EXPECT_GT(picker.picks().entry->place.direction.dot(centreline.points[inner] - at), 0.0);
    }
}

INSTANTIATE_TEST_SUITE_P(, PickedIn, ::testing::Values("u_bend", "bifurcation", "aortic_arch", "aneurysm", "hepatic"), [](const auto& tested) { return tested.param; });

/// A shipped scene in a folder of its own.
class SavedFrom : public ::testing::TestWithParam<std::string> {
protected:
    SavedFrom() {
        scene_.file = folder_.write("original.json", shipped_.text);
    }
    ~SavedFrom() override { EXPECT_EQ(read_text(scene_.file), shipped_.text) << "the original stays as it is"; }
    [[nodiscard]] Result<SavedScene> save(const Picks& picks, const SaveScene& asked) const {
        return save_picked_scene(shipped_.text, scene_, picks, asked);
    }

    const Shipped& shipped_ = shipped(GetParam());
    TempFolder folder_;
    Scene scene_ = shipped_.scene;
};

TEST_P(SavedFrom, RandomClicksScenesReadAndAWayLeadsToTheTarget) {
    Picker picker(shipped_.prepared.model);
    RandomClicks clicks(shipped_.vessel().surface);
    SCOPED_TRACE(fmt::format("seed {}", clicks.seed()));
    for (int k = 0; k < 8; ++k) {
        ASSERT_TRUE(picker.pick(clicks.next(PickPlace::What::Target, shipped_.instrument().lumen)).ok());
        const Result<SavedScene> saved = save(picker.picks(), {"picked", ""});
        ASSERT_TRUE(saved.ok()) << why(saved);
        EXPECT_EQ(saved->file.filename(), k == 0 ? "original-picked.json" : fmt::format("original-picked-{}.json", k + 1));
        const Result<Scene> scene = read_scene(saved->file);
        ASSERT_TRUE(scene.ok()) << why(scene);
        EXPECT_EQ(scene->targets.size(), shipped_.scene.targets.size() + 1);
        EXPECT_EQ(scene->targets.back().name, "picked");
        EXPECT_EQ(usual_target(*scene), "picked");
        const Vec3 end = picker.picks().target->position;
        EXPECT_LT((scene->targets.back().place.position - end).norm(), 1e-9);
        EXPECT_LE(scene->instruments[0].follow->settings.tolerance, picker.picks().target->radius);
        const auto prepared = make_prepared_scene(*scene);
        ASSERT_TRUE(prepared.ok()) << why(prepared);
        ASSERT_TRUE(prepared->model.instruments[0].route.has_value());
        EXPECT_LT((prepared->model.instruments[0].route->points.back() - end).norm(), 1e-9);
    }
}

TEST_P(SavedFrom, ScenesWithAnEntryAtEachEndBeginInTheLumen) {
    Picker picker(shipped_.prepared.model);
    const LumenPlaces& places = *picker.places();
    for (const Index end : places.ends()) {
        ASSERT_TRUE(picker.pick(click_near(shipped_, PickPlace::What::Entry, places.centreline().points[end])).ok());
        const Result<SavedScene> saved = save(picker.picks(), {"picked", fmt::format("entry-{}", end)});
        ASSERT_TRUE(saved.ok()) << why(saved);
        EXPECT_EQ(saved->file.filename(), fmt::format("entry-{}.json", end));
        const Result<Scene> scene = read_scene(saved->file);
        ASSERT_TRUE(scene.ok()) << why(scene);
        EXPECT_EQ(usual_target(*scene), usual_target(shipped_.scene)) << "only the entry is another";
        const auto prepared = make_prepared_scene(*scene);
        ASSERT_TRUE(prepared.ok()) << why(prepared);
        EXPECT_LT((prepared->model.instruments[0].port.position - picker.picks().entry->place.position).norm(), 1e-9);
        Simulator simulator(prepared->model);
        for (int step = 0; step < 20; ++step) EXPECT_EQ(simulator.step().lumen_exits, 0u);
    }
}

INSTANTIATE_TEST_SUITE_P(, SavedFrom, ::testing::Values("u_bend", "bifurcation", "aortic_arch"), [](const auto& tested) { return tested.param; });

/// Driven there, not only drawn on the map.
TEST(PickedScene, IsPlannedInAsAnyOther) {
    const Shipped& bend = shipped("u_bend");
    TempFolder folder;
    Scene scene = bend.scene;
    scene.file = folder.write("u_bend.json", bend.text);
    Picker picker(bend.prepared.model);
    ASSERT_TRUE(picker.pick(click_near(bend, PickPlace::What::Target, Vec3(0.065, 0.0, 0.06))).ok());
    const Result<SavedScene> saved = save_picked_scene(bend.text, scene, picker.picks(), {"past_the_bend", "planned.json"});
    ASSERT_TRUE(saved.ok()) << why(saved);
    Scene planned = *read_scene(saved->file);
    ASSERT_TRUE(aim_to_plan(planned, "past_the_bend").ok());
    const PreparedScene prepared = *make_prepared_scene(planned);
    const Plan plan = find_motion(prepared.model, 60.0, [](double) { return false; });
    EXPECT_TRUE(plan.arrived) << plan.closest;
    EXPECT_EQ(plan.lumen_exits, 0u);
}

/// A wire that a path drives through a tube with a narrow place, in centimetres, with comments.
const std::string kNarrow = R"(// first line
{
    "name": "narrow", "units": {"length": "cm"}, "time": {"step": 0.01, "duration": 1},
    "bodies": {"tube": {"kind": "static", "hollow": true, /* the wall */
        "surface": {"shape": "tube", "axis": [[0, 0, 0, 0.4], [0, 0, 5, 0.4], [0, 0, 6, 0.04], [0, 0, 7, 0.4], [0, 0, 12, 0.4]], "sides": 16}}},
    "instruments": {"wire": {"length": 10, "radius": 0.05, "young_modulus": 1e9, "segment": 0.5, "lumen": "tube",
        "entry": {"position": [0, 0, 1], "direction": [0, 0, 1]}, "path": [[0, 2, 0], [1, 3, 0]]}},
    "effects": ["coarse_contact"] // the last one
}
)";

struct Narrow {
    TempFolder folder;
    fs::path file = folder.write("narrow.json", kNarrow);
    Scene scene = *read_scene(file);
    PreparedScene prepared = *make_prepared_scene(scene);
    Picker picker{prepared.model};

    void pick(PickPlace::What what, const Vec3& near) {
        const SurfacePoint wall = *TriangleTree(prepared.model.bodies[0].surface).closest(near);
        ASSERT_TRUE(picker.pick({what, 0, wall.triangle, wall.bary}).ok());
    }
    [[nodiscard]] Result<SavedScene> save(const SaveScene& asked) const { return save_picked_scene(kNarrow, scene, picker.picks(), asked); }
    [[nodiscard]] std::size_t files() const {
        return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()));
    }
};

TEST(PickedScene, KeepsTheTextAndThePathOfTheOriginal) {
    Narrow narrow;
    narrow.pick(PickPlace::What::Target, Vec3(0.01, 0, 0.04));
    const Result<SavedScene> saved = narrow.save({"near", ""});
    ASSERT_TRUE(saved.ok()) << why(saved);
    ASSERT_FALSE(saved->notices.empty());
    EXPECT_THAT(saved->notices[0], HasSubstr("path"));
    const std::string text = read_text(saved->file);
    const std::size_t comment = text.find(", // the last one\n    \"targets\"");
    ASSERT_NE(comment, std::string::npos) << text;
    EXPECT_EQ(text.substr(0, comment), kNarrow.substr(0, comment));
    const Scene scene = *read_scene(saved->file);
    EXPECT_FALSE(scene.instruments[0].path.empty());
    EXPECT_FALSE(scene.instruments[0].follow.has_value());
    EXPECT_NEAR(scene.targets[0].place.position.z(), 0.04, 2e-3);
}

TEST(PickedScene, IsNotWrittenWhereNoWayLeadsToTheTarget) {
    Narrow narrow;
    narrow.pick(PickPlace::What::Target, Vec3(0.01, 0, 0.1));
    const Result<SavedScene> saved = narrow.save({"picked", ""});
    ASSERT_FALSE(saved.ok());
    EXPECT_THAT(saved.error().message, HasSubstr("no way from the entry to picked"));
    EXPECT_EQ(narrow.files(), 1u);
}

TEST(PickedScene, NeverTakesANameThatIsTakenOrNoPlainName) {
    Narrow narrow;
    EXPECT_THAT(why(narrow.save({"picked", ""})), HasSubstr("nothing is picked"));
    narrow.pick(PickPlace::What::Target, Vec3(0.01, 0, 0.04));
    for (const char* name : {"narrow", "narrow.json"}) EXPECT_THAT(why(narrow.save({"picked", name})), HasSubstr("already")) << name;
    fs::create_symlink(narrow.folder.path() / "nowhere", narrow.folder.path() / "link.json");
    EXPECT_THAT(why(narrow.save({"picked", "link"})), HasSubstr("already"));
    for (const std::string& name : std::vector<std::string>{"..", "../up", "/etc/x", "a/b", ".hidden", "a b", "x\n", std::string(1, '\0'), "\xff", std::string(10'000, 'x')})
        EXPECT_THAT(why(narrow.save({"picked", name})), HasSubstr("expected 1 to 64 letters")) << name;
    for (const std::string& target : std::vector<std::string>{"", "a b", "\"", "../up", std::string(10'000, 'x')})
        EXPECT_THAT(why(narrow.save({target, "name"})), HasSubstr("expected")) << target;
    EXPECT_EQ(narrow.files(), 2u);
    EXPECT_EQ(read_text(narrow.file), kNarrow);
}

TEST(PickedScene, SaysWhereThereIsNoFolderToWriteIn) {
    Narrow narrow;
    narrow.pick(PickPlace::What::Target, Vec3(0.01, 0, 0.04));
    EXPECT_THAT(why(save_picked_scene("", narrow.scene, narrow.picker.picks(), {"picked", ""})), HasSubstr("came from no file"));
    fs::remove_all(narrow.folder.path());
    const Result<SavedScene> saved = narrow.save({"picked", ""});
    ASSERT_FALSE(saved.ok());
    EXPECT_EQ(saved.error().code, ErrorCode::CannotWrite);
}

TEST(Picker, RefusesWhatIsNotTheVessel) {
    const Shipped& hepatic = shipped("hepatic");
    Picker picker(hepatic.prepared.model);
    for (std::uint32_t body = 0; body < hepatic.prepared.model.bodies.size(); ++body)
        EXPECT_EQ(picker.pick({PickPlace::What::Target, body, 0, {1, 0, 0}}).ok(), body == hepatic.instrument().lumen);
    EXPECT_THAT(why(Picker(shipped("falling_sphere").prepared.model).pick({})), HasSubstr("nothing to pick"));
}

} // namespace
} // namespace trocar::engine::viewer
