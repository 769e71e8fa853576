// Structs of a scene and their descriptions: that a description names every member is checked when it is compiled (describes_all); here,
// that it names each once, reads what it says, and refuses in memory what it refuses in a file.
#include "engine/scene/check_keys.hpp"
#include "engine/scene/describe_body.hpp"
#include "engine/scene/describe_contact.hpp"
#include "engine/scene/describe_effects.hpp"
#include "engine/scene/describe_instrument.hpp"
#include "engine/scene/describe_run.hpp"
#include "engine/scene/read_keys.hpp"
#include "scene_fixture.hpp"

#include <set>
#include <typeindex>
#include <type_traits>

namespace trocar::engine {

/// More members than tie_members has lines for.
inline bool operator==(const ArmRow& a, const ArmRow& b) { return tie_members(a) == tie_members(b); }
inline bool operator==(const XrayView& left, const XrayView& right) {
    const auto tied = [](const XrayView& view) {
        const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w] = view;
        return std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w);
    };
    return tied(left) == tied(right);
}

/// Of every kind of member.
namespace sample {
struct Pair {
    int a = 1;
    double b = 2.0;
};
struct Many {
    Pair nested;
    std::optional<double> number;
    std::optional<Pair> pair;
    std::string text;
    std::vector<Pair> list;
    Vec3 vector = Vec3::Zero();
    std::filesystem::path path;
    bool flag = false;
    Culling choice = Culling::Auto;
    std::map<std::string, Pair> map;
    std::string_view view;
};
} // namespace sample

namespace {

using sample::Many, sample::Pair;

template <class K>
class Described : public testing::Test {};
using AllKeys =
    testing::Types<ContactKeys, CostKeys, PaceKeys, TimeKeys, BudgetKeys, PictureKeys, OutputKeys, FluoroscopyKeys, XrayViewKeys, BreathingKeys, PulseKeys,
                   BloodPropertyKeys, BloodKeys, EffectsKeys, LandmarkKeys, EntryPositionKeys, TargetPositionKeys, MaterialKeys, TissueKeys,
                   FileSurfaceKeys, RecipeSurfaceKeys, ShapeKeys, MeshedCoarseKeys, FileCoarseKeys, DirectionRegionKeys, BoxRegionKeys,
                   BallKeys, SphereRegionKeys, BodyKeys, TipKeys, LimitKeys, FollowSettingKeys, FollowKeys, InstrumentKeys>;
TYPED_TEST_SUITE(Described, AllKeys);

/// Member by member, whatever the struct.
template <class T>
bool same(const T& a, const T& b) {
    if constexpr (requires { a.has_value(); })
        return a.has_value() == b.has_value() && (!a || same(*a, *b));
    else if constexpr (requires {
                           a.size();
                           a[0];
                       }) {
        if (a.size() != b.size()) return false;
        for (decltype(a.size()) i = 0; i < a.size(); ++i)
            if (!same(a[i], b[i])) return false;
        return true;
    } else if constexpr (requires {
                             { a == b } -> std::convertible_to<bool>;
                         })
        return a == b;
    else
        return [&]<std::size_t... i>(std::index_sequence<i...>) {
            const auto left = tie_members(a), right = tie_members(b);
            return (same(std::get<i>(left), std::get<i>(right)) && ...);
        }
    (std::make_index_sequence<member_count<T>>());
}

/// Calls `use` with the key and the member of every entry that is one number, flag, choice or direction.
template <class Keys>
void for_each_plain(typename Keys::Struct& s, auto&& use) {
    const auto visit = [&](const auto& one) {
        if constexpr (requires {
                          one.field;
                          *one.member;
                      })
            if constexpr (!requires { one.read; }) use(one.field, *one.member);
    };
    auto description = Keys::of(s);
    std::apply([&](const auto&... one) { (visit(one), ...); }, description.entries);
}

TYPED_TEST(Described, NamesEveryKeyAndEveryMemberOnce) {
    typename TypeParam::Struct s{};
    std::set<std::string_view> keys;
    std::set<std::pair<const void*, std::type_index>> members; // a struct and its first member have one address
    for_each_plain<TypeParam>(s, [&](const FieldSpec& field, const auto& member) {
        EXPECT_TRUE(keys.insert(field.key).second) << field.key;
        if (&member != static_cast<const void*>(&s)) { // the struct itself: another object of the file holds some of its keys
            EXPECT_TRUE(members.emplace(&member, typeid(member)).second) << field.key;
        }
        EXPECT_FALSE(field.doc.empty()) << field.key;
    });
    EXPECT_EQ(table_of<TypeParam>().name, TypeParam::of(s).about.name);
}

TYPED_TEST(Described, ReadsAnEmptyObjectAsTheDefaultStruct) {
    const CheckContext context{};
    const Scene scene{};
    const Values nothing(nullptr, table_of<TypeParam>(), context.units, "");
    typename TypeParam::Struct read{};
    const auto error = read_keys<TypeParam>({context, nothing, scene}, read);
    EXPECT_FALSE(error.has_value()) << error->to_string();
    EXPECT_TRUE(same(read, typename TypeParam::Struct{}));
}

/// Its number, changed alone, is refused by its name; the default is not.
TYPED_TEST(Described, RefusesInMemoryWhatIsOutOfAKeysRange) {
    const ObjectSpec& table = table_of<TypeParam>();
    typename TypeParam::Struct s{};
    for_each_plain<TypeParam>(s, [&](const FieldSpec& field, auto& member) {
        if constexpr (std::is_same_v<std::remove_reference_t<decltype(member)>, double>) {
            if (!field.used_when.empty() || !table.find(field.key)) return;
            const auto complaint = [&](double value) { return refuse_number(*table.find(field.key), value).has_value(); };
            if (!field.is_required) {
                EXPECT_FALSE(complaint(member)) << field.key;
            }
            const double kept = std::exchange(member, std::nan(""));
            const auto misfit = find_misfit<TypeParam>(s);
            member = kept;
            ASSERT_TRUE(misfit.has_value()) << field.key;
            if (!field.is_required) {
                EXPECT_EQ(misfit->key, field.key);
            }
            EXPECT_NE(misfit->message.find("found nan, expected "), std::string::npos) << misfit->message;
        }
    });
}

TEST(Descriptions, MembersAreCounted) {
    EXPECT_EQ(member_count<Pair>, 2u);
    EXPECT_EQ(member_count<Many>, 11u);
    Many many;
    EXPECT_EQ(&std::get<8>(tie_members(many)), &many.choice);
}

TEST(Descriptions, ContactIsReadByItsDescription) {
    const Scene scene = *parse_scene(spoil("\"effects\":", R"("contact": {"solid_damping": 3, "sphere_trees": "heuristic",
        "solid_response": "spheres", "culling": "cpu", "margin": 0.4}, "effects":)"),
                                     "scenes/test.json");
    EXPECT_EQ(scene.contact.solid_damping, 3.0);
    EXPECT_EQ(scene.contact.sphere_trees, SphereTrees::Heuristic);
    EXPECT_EQ(scene.contact.solid_response, SolidResponse::Spheres);
    EXPECT_EQ(scene.contact.culling, Culling::Cpu);
    EXPECT_DOUBLE_EQ(scene.contact.margin, 4e-4);
    EXPECT_EQ(scene.contact.clearance, ContactSpec{}.clearance);
    ContactSpec contact;
    contact.culling = static_cast<Culling>(9);
    EXPECT_EQ(find_misfit<ContactKeys>(contact)->message, "found 9, expected one of auto, never, cpu, opengl");
    contact = {.margin = 1.0};
    EXPECT_EQ(find_misfit<ContactKeys>(contact)->message, "found 1, expected 0 to 0.05 m");
}

} // namespace
} // namespace trocar::engine
