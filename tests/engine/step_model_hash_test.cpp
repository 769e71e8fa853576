// A model's hash tells two models apart whatever they differ in: every member of every struct of it, one at a time; and every key of a
// scene that affects a step.
#include "engine/effects/registry.hpp"
#include "engine/step/checkpoint.hpp"
#include "engine/step/model_hash.hpp"
#include "engine/step/model_members.hpp"
#include "step_fixture.hpp"

#include <gmock/gmock.h>

#include <random>
#include <set>
#include <type_traits>

namespace trocar::engine {
namespace {

/// What may differ between a run and the one that goes on from it, see hash_model.
const std::set<std::string> kLeftOut{".file",        ".file, one less", ".file, one more",   ".step_count",
                                     ".budget.mode", ".budget.wall_s",  ".budget.work_units", ".packing, some", ".packing."};

/// Changes every member of a model alone, asks whether the hash does, and puts it back.
class EveryMember {
public:
    explicit EveryMember(SceneModel& model, unsigned seed) : model_(model), before_(hash_model(model)), random_(seed) { visit(model, ""); }
    [[nodiscard]] const std::set<std::string>& unseen() const noexcept { return unseen_; }
    [[nodiscard]] std::size_t changes() const noexcept { return changes_; }

private:
    void look(const std::string& name) {
        ++changes_;
        if (hash_model(model_) == before_) unseen_.insert(name);
    }
    template <class T>
    void try_value(T& value, const T& other, const std::string& name) {
        const T kept = value;
        value = other;
        look(name);
        value = kept;
    }
    template <class T>
    void visit(T& value, const std::string& name) {
        if constexpr (std::is_same_v<T, bool>)
            try_value(value, !value, name);
        else if constexpr (std::is_same_v<T, double>)
            try_value(value, std::nextafter(value, 1e300), name);
        else if constexpr (std::is_same_v<T, float>)
            try_value(value, std::nextafter(value, 1e30F), name);
        else if constexpr (std::is_pointer_v<T>)
            try_value(value, value == &effects::gravity ? &effects::pulse : &effects::gravity, name);
        else if constexpr (std::is_enum_v<T>)
            try_value(value, static_cast<T>(static_cast<int>(value) ^ 1), name);
        else if constexpr (std::is_arithmetic_v<T>)
            try_value(value, static_cast<T>(value ^ (T{1} << random_() % (8 * sizeof(T)))), name);
        else if constexpr (requires { value.coeffRef(0, 0); })
            visit(value.coeffRef(random_() % value.rows(), random_() % value.cols()), name);
        else if constexpr (requires { value.emplace(); })
            visit_maybe(value, name);
        else if constexpr (requires { value.push_back(value[0]); })
            visit_list(value, name);
        else if constexpr (requires { value[0]; })
            visit(value[random_() % std::size(value)], name);
        else if constexpr (requires { value.second; }) {
            visit(value.first, name + ".first");
            visit(value.second, name + ".second");
        } else
            visit_members(value, name);
    }
    template <class T>
    void visit_maybe(T& value, const std::string& name) {
        T kept = value;
        if (value) {
            visit(*value, name);
            value.reset();
            look(name + ", none");
        } else {
            value.emplace();
            look(name + ", some");
            visit(*value, name);
        }
        value = std::move(kept);
    }
    template <class T>
    void visit_list(T& list, const std::string& name) {
        if (!list.empty()) {
            const std::size_t last = list.size() - 1;
            visit(list[random_() % list.size()], name);
            if (last > 0) visit(list[last], name);
            const auto kept = list.back();
            list.pop_back();
            look(name + ", one less");
            list.push_back(kept);
        }
        typename T::value_type fresh{};
        if constexpr (requires { fresh.setZero(); }) fresh.setZero(); // Eigen leaves them as they are
        list.push_back(fresh);
        look(name + ", one more");
        if (list.size() == 1) visit(list.back(), name);
        list.pop_back();
    }
    template <class T>
    void visit_members(T& value, const std::string& name) {
        std::string_view names = member_names(&value);
        const auto visit_next = [&](auto& member) {
            const std::size_t comma = std::min(names.find(','), names.size());
            visit(member, name + "." + std::string(names.substr(0, comma)));
            names.remove_prefix(std::min(comma + 2, names.size()));
        };
        std::apply([&](auto&... member) { (visit_next(member), ...); }, members_of(value));
    }

    SceneModel& model_;
    std::uint64_t before_;
    std::mt19937 random_;
    std::set<std::string> unseen_;
    std::size_t changes_ = 0;
};

/// A wire on a path, a breathing organ on wrapped spheres, a tube with a pulse and blood that it carries, a ball that moves as told.
std::string everything() {
    return R"({"name": "everything", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 1},
    "budget": {"limit": "work:5000", "scope": "collision"}, "gravity": [0, 0, -9810],
    "contact": {"solid_stiffness": 1, "solid_friction": 0.3, "sphere_trees": "wrapped"},
    "bodies": {)" +
           test::kOrgan + R"(
        "tube": {"kind": "static", "hollow": true, "embedded_in": "organ", "blend": 5,
                 "surface": {"shape": "tube", "axis": [)" +
           test::bent_axis(25.0, 3.0) + R"(], "sides": 12}},
        "ball": {"kind": "kinematic", "surface": {"shape": "sphere", "centre": [90, 90, 90], "radius": 9, "subdivisions": 2},
                 "motion": [[0, 0, 0, 0], [1, 0, 0, 5]]}},
    "instruments": {"wire": {"length": 220, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 600,
        "stiffness": [[0, 0.3], [40, 1]], "lumen": "tube", "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]},
        "path": [[0, 20, 0], [1, 40, 2]]}},
    "effects": ["elasticity", "damping", "gravity", "breathing", "pulse", "coarse_contact", "self_contact", "exact_contact", "friction",
                "twist", "blood_drag"]})";
}

TEST(ModelHash, ChangesWithEveryMemberOfAModelOneAtATime) {
    for (const unsigned seed : {1u, 2u}) {
        PreparedScene prepared = test::prepare(everything());
        ASSERT_EQ(prepared.model.bodies.size(), 3u);
        const std::uint64_t before = hash_model(prepared.model);
        const EveryMember every(prepared.model, seed);
        EXPECT_EQ(every.unseen(), kLeftOut) << "seed " << seed;
        EXPECT_GT(every.changes(), 700u) << "every struct of the model was met";
        EXPECT_EQ(hash_model(prepared.model), before) << "everything was put back";
    }
}

/// Numbers that swap places, or change sign two at a time, are another model as well.
TEST(ModelHash, ChangesWithTheOrderAndTheSignsOfNumbers) {
    PreparedScene prepared = test::prepare(everything());
    std::vector<Vec3>& vertices = prepared.model.bodies[0].surface.vertices;
    const std::uint64_t before = hash_model(prepared.model);
    std::mt19937 random(5);
    std::set<std::uint64_t> met{before};
    for (int k = 0; k < 50; ++k) {
        const std::vector<Vec3> kept = vertices;
        const std::size_t a = random() % vertices.size(), b = random() % vertices.size();
        if (kept[a] == kept[b]) continue;
        std::swap(vertices[a], vertices[b]);
        const std::uint64_t swapped = hash_model(prepared.model);
        EXPECT_NE(swapped, before) << a << " and " << b;
        vertices = kept;
        vertices[a] = -vertices[a], vertices[b] = -vertices[b];
        EXPECT_NE(hash_model(prepared.model), before) << "signs of " << a << " and " << b;
        vertices = kept;
        met.insert(swapped);
    }
    EXPECT_GT(met.size(), 30u);
    EXPECT_EQ(hash_model(prepared.model), before);
}

struct Edit {
    std::string what, by;
};

/// Keys of every part of a scene, each changed alone.
const std::vector<Edit> kModelEdits{
    {R"("step": 0.01)", R"("step": 0.011)"},
    {R"("blend": 5)", R"("blend": 6)"},
    {R"("embedded_in": "organ", "blend": 5,)", ""},
    {R"("organ": {)", R"("organ": {"self_contact": false, )"},
    {R"("viscosity": 0.001)", R"("viscosity": 0.0011)"},
    {R"("mass_damping": 5)", R"("mass_damping": 4)"},
    {R"("density": 1000)", R"("density": 1001)"},
    {R"("surface_triangles": 120)", R"("surface_triangles": 140)"},
    {R"("fraction": 0.1)", R"("fraction": 0.6)"},
    {R"("sides": 12)", R"("sides": 13)"},
    {R"("scope": "collision")", R"("scope": "step")"},
    {R"("sphere_trees": "wrapped")", R"("sphere_trees": "heuristic")"},
    {R"("solid_friction": 0.3)", R"("solid_friction": 0.4)"},
    {R"([1, 0, 0, 5])", R"([1, 0, 0, 6])"},
    {R"([40, 1]])", R"([41, 1]])"},
    {R"("skin_triangles": 600)", R"("skin_triangles": 2400)"},
    {R"([1, 40, 2])", R"([1, 40, 1])"},
    {R"("twist", "blood_drag")", R"("blood_drag")"},
    {R"("breathing", "pulse",)", R"("breathing",)"},
    {R"("friction",)", ""},
};

TEST(ModelHash, ACheckpointIsRefusedByASceneOfWhichAnyOneKeyWasChanged) {
    const std::string text = everything();
    const PreparedScene prepared = test::prepare(text);
    Simulator simulator(prepared.model);
    simulator.step();
    const Checkpoint checkpoint = make_checkpoint(simulator);
    for (const Edit& edit : kModelEdits) {
        const std::size_t at = text.find(edit.what);
        ASSERT_NE(at, std::string::npos) << edit.what;
        const PreparedScene other = test::prepare(std::string(text).replace(at, edit.what.size(), edit.by));
        Simulator wrong(other.model);
        const auto resumed = resume(wrong, checkpoint, "some.bin");
        ASSERT_FALSE(resumed.ok()) << edit.what << " -> " << edit.by;
        EXPECT_THAT(resumed.error().to_string(), ::testing::HasSubstr("another scene")) << edit.what;
    }
    const PreparedScene again = test::prepare(text);
    Simulator same(again.model);
    EXPECT_TRUE(resume(same, checkpoint, "some.bin").ok());
}

} // namespace
} // namespace trocar::engine
