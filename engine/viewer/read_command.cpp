#include "engine/viewer/read_command.hpp"

#include "engine/io/printable.hpp"
#include "engine/io/shown.hpp"
#include "engine/viewer/session.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>

namespace trocar::engine::viewer {

namespace {

using Parsed = nlohmann::json;

/// m; nothing that can be pulled is larger.
constexpr double kFurthestTarget = 10.0;
/// Of weights that a page computed.
constexpr double kRounding = 1e-3;

/// One message's members, each read once; the first error is kept, and an unread member is one.
class Members {
public:
    explicit Members(const Parsed& object) : object_(object) { asked_.insert("type"); }

    double number(const char* key, double least, double most) {
        const Parsed* value = find(key);
        if (value == nullptr) return least;
        const double number = value->is_number() ? value->get<double>() : std::nan("");
        if (number >= least && number <= most) return number;
        complain(fmt::format("\"{}\" is {}; expected a number from {:g} to {:g}", key, text_of(*value), least, most));
        return least;
    }
    std::uint64_t whole(const char* key, std::uint64_t least, std::uint64_t most) {
        const Parsed* value = find(key);
        if (value == nullptr) return least;
        if (value->is_number_unsigned())
            if (const auto number = value->get<std::uint64_t>(); number >= least && number <= most) return number;
        complain(fmt::format("\"{}\" is {}; expected an integer from {} to {}", key, text_of(*value), least, most));
        return least;
    }
    bool flag(const char* key) {
        const Parsed* value = find(key);
        if (value == nullptr) return false;
        if (!value->is_boolean()) complain(fmt::format("\"{}\" is {}; expected true or false", key, text_of(*value)));
        return value->is_boolean() && value->get<bool>();
    }
    std::string word(const char* key) {
        const Parsed* value = find(key);
        if (value == nullptr) return {};
        if (!value->is_string()) complain(fmt::format("\"{}\" is {}; expected a text", key, text_of(*value)));
        return value->is_string() ? value->get<std::string>() : std::string();
    }
    Vec3 point(const char* key) {
        const Parsed* value = find(key);
        Vec3 point = Vec3::Zero();
        if (value == nullptr) return point;
        bool good = value->is_array() && value->size() == 3;
        for (std::size_t axis = 0; good && axis < 3; ++axis) {
            good = (*value)[axis].is_number() && std::abs((*value)[axis].get<double>()) <= kFurthestTarget;
            if (good) point[static_cast<int>(axis)] = (*value)[axis].get<double>();
        }
        if (!good) complain(fmt::format("\"{}\" is {}; expected three numbers in metres", key, text_of(*value)));
        return point;
    }
    /// Three, of which each is at least 0, and their sum 1 but for rounding: the sum of what is returned is 1.
    std::array<double, 3> weights(const char* key) {
        const Parsed* value = find(key);
        std::array<double, 3> weights{1.0, 0.0, 0.0};
        if (value == nullptr) return weights;
        bool good = value->is_array() && value->size() == 3;
        double sum = 0.0;
        for (std::size_t k = 0; good && k < 3; ++k) {
            good = (*value)[k].is_number() && (*value)[k].get<double>() >= -kRounding && (*value)[k].get<double>() <= 1.0 + kRounding;
            if (good) sum += weights[k] = std::max(0.0, (*value)[k].get<double>());
        }
        good = good && std::abs(sum - 1.0) <= kRounding;
        if (!good) complain(fmt::format("\"{}\" is {}; expected three numbers from 0 to 1, with the sum 1", key, text_of(*value)));
        for (double& weight : weights) weight = good ? weight / sum : 0.0;
        return weights;
    }
    /// Of something that is kept under it.
    std::string name(const char* key) {
        const std::string name = word(key);
        if (name.empty() || name.size() > kLongestStateName || has_control_characters(name))
            complain(fmt::format("\"{}\" is \"{}\"; expected 1 to {} bytes, and no control characters", key, shown(name), kLongestStateName));
        return name;
    }
    void complain(std::string what) {
        if (!error_) error_ = Error{ErrorCode::BadValue, std::move(what)};
    }
    /// The error, also for members that were not read.
    [[nodiscard]] std::optional<Error> finish() {
        for (const auto& member : object_.items())
            if (!asked_.contains(member.key())) complain(fmt::format("\"{}\" means nothing here", shown(member.key())));
        return error_;
    }

private:
    const Parsed* find(const char* key) {
        asked_.insert(key);
        const auto found = object_.find(key);
        if (found != object_.end()) return &*found;
        complain(fmt::format("\"{}\" is missing", key));
        return nullptr;
    }
    static std::string text_of(const Parsed& value) { return shown(value.dump(-1, ' ', true, Parsed::error_handler_t::replace)); }

    const Parsed& object_;
    std::set<std::string, std::less<>> asked_;
    std::optional<Error> error_;
};

Request read_budget(Members& members) {
    SetBudget set;
    const std::string mode = members.word("mode");
    if (mode == "wall") {
        set.limits.mode = BudgetMode::Wall;
        set.limits.wall_s = 1e-3 * members.number("ms", 1e3 * kLeastBudget, 1e3 * kMostBudget);
    } else if (mode == "work") {
        set.limits.mode = BudgetMode::Work;
        set.limits.work_units = members.whole("units", kLeastWork, kMostWork);
    } else if (mode == "exact")
        set.limits.mode = BudgetMode::Exact;
    else
        members.complain(fmt::format("\"mode\" is \"{}\"; expected wall, work or exact", shown(mode)));
    return Command{set};
}

Request read_effect(Members& members, const CommandRange& range) {
    SwitchEffect set;
    const std::string name = members.word("name");
    set.on = members.flag("on");
    set.effect = find_effect(name);
    if (set.effect == nullptr || set.effect->scale == nullptr) {
        std::vector<std::string_view> names;
        for (const EffectDescriptor* effect : registered_effects())
            if (effect->scale != nullptr) names.push_back(effect->name);
        members.complain(fmt::format("\"name\" is \"{}\"; expected {}", shown(name), fmt::join(names, ", ")));
    } else if (std::find(range.missing.begin(), range.missing.end(), set.effect) != range.missing.end()) {
        members.complain(fmt::format("the scene has no {}", name));
    }
    return Command{set};
}

Request read_grab(Members& members, const CommandRange& range) {
    Grab grab;
    if (range.vertices.empty())
        members.complain("the scene has no body");
    else
        grab.body = static_cast<std::uint32_t>(members.whole("body", 0, range.vertices.size() - 1));
    const std::size_t vertices = range.vertices.empty() ? 0 : range.vertices[grab.body];
    if (vertices > 0) grab.vertex = static_cast<std::uint32_t>(members.whole("vertex", 0, vertices - 1));
    grab.target = members.point("target");
    if (!range.vertices.empty() && !range.pullable[grab.body]) members.complain("this body cannot be pulled: no tissue carries it");
    return Command{grab};
}

Request read_carm(Members& members) {
    SetXray set;
    XraySettings& to = set.settings;
    to.primary = members.number("primary", -kMostPrimary, kMostPrimary);
    to.secondary = members.number("secondary", -kMostSecondary, kMostSecondary);
    to.zoom = members.number("zoom", 1.0, kMostZoom);
    to.at_tip = members.flag("at_tip");
    to.edge = static_cast<unsigned>(members.whole("pixels", kLeastXrayEdge, kMostXrayEdgeShown));
    const std::string display = members.word("display");
    if (display == "log")
        to.display = XrayDisplay::Log;
    else if (display == "subtraction")
        to.display = XrayDisplay::Subtraction;
    else if (display == "roadmap")
        to.display = XrayDisplay::Roadmap;
    else
        members.complain(fmt::format("\"display\" is \"{}\"; expected log, subtraction or roadmap", shown(display)));
    return set;
}

Request read_save(Members& members) {
    SaveState save;
    const std::string name = members.name("name");
    std::copy_n(name.begin(), std::min(name.size(), kLongestStateName), save.name.begin());
    return Command{save};
}

Request read_pick(Members& members, const CommandRange& range) {
    PickPlace pick;
    const std::string what = members.word("what");
    if (what == "entry")
        pick.what = PickPlace::What::Entry;
    else if (what != "target")
        members.complain(fmt::format("\"what\" is \"{}\"; expected target or entry", shown(what)));
    if (range.triangles.empty())
        members.complain("the scene has no body");
    else
        pick.body = static_cast<std::uint32_t>(members.whole("body", 0, range.triangles.size() - 1));
    const std::size_t triangles = range.triangles.empty() ? 0 : range.triangles[pick.body];
    if (triangles > 0) pick.triangle = static_cast<Index>(members.whole("triangle", 0, triangles - 1));
    pick.weights = members.weights("weights");
    return pick;
}

Request read_save_scene(Members& members, bool named) {
    SaveScene save{members.name("target"), {}};
    if (!named) return save;
    save.file_name = members.word("name");
    if (const auto good = check_file_name(save.file_name); !good.ok()) members.complain(good.error().message);
    return save;
}

std::uint32_t read_saved(Members& members) {
    return static_cast<std::uint32_t>(members.whole("saved", 1, std::numeric_limits<std::uint32_t>::max()));
}

using Reader = std::function<Request(Members&, const CommandRange&)>;

const std::map<std::string, Reader, std::less<>>& readers() {
    static const std::map<std::string, Reader, std::less<>> kReaders = {
        {"drive",
         [](Members& m, const CommandRange&) -> Request {
             return Command{Drive{m.number("insertion", -1.0, 1.0), m.number("rotation", -1.0, 1.0)}};
         }},
        {"script", [](Members& m, const CommandRange&) -> Request { return Command{FollowScript{m.flag("on")}}; }},
        {"budget", [](Members& m, const CommandRange&) -> Request { return read_budget(m); }},
        {"pause", [](Members& m, const CommandRange&) -> Request { return Command{Pause{m.flag("on")}}; }},
        {"step", [](Members&, const CommandRange&) -> Request { return Command{SingleStep{}}; }},
        {"pace", [](Members& m, const CommandRange&) -> Request { return Command{Pace{m.number("factor", kSlowestPace, 1.0)}}; }},
        {"effect", read_effect},
        {"grab", read_grab},
        {"let_go", [](Members&, const CommandRange&) -> Request { return Command{LetGo{}}; }},
        {"inject",
         [](Members& m, const CommandRange& range) -> Request {
             if (!range.contrast) m.complain("the scene has no contrast; expected the effect \"contrast\" in it");
             return Command{Inject{}};
         }},
        {"restart", [](Members&, const CommandRange&) -> Request { return Command{Restart{}}; }},
        {"save", [](Members& m, const CommandRange&) -> Request { return read_save(m); }},
        {"restore", [](Members& m, const CommandRange&) -> Request { return Command{RestoreState{read_saved(m)}}; }},
        {"forget", [](Members& m, const CommandRange&) -> Request { return Command{ForgetState{read_saved(m)}}; }},
        {"spheres", [](Members& m, const CommandRange&) -> Request { return ShowSpheres{m.flag("on")}; }},
        {"xray", [](Members& m, const CommandRange&) -> Request { return ShowXray{m.flag("on")}; }},
        {"carm", [](Members& m, const CommandRange&) -> Request { return read_carm(m); }},
        {"mask", [](Members&, const CommandRange&) -> Request { return TakeMask{}; }},
        {"pick", read_pick},
        {"unpick", [](Members&, const CommandRange&) -> Request { return ForgetPicks{}; }},
        {"save_scene", [](Members& m, const CommandRange&) -> Request { return read_save_scene(m, false); }},
        {"save_scene_as", [](Members& m, const CommandRange&) -> Request { return read_save_scene(m, true); }},
        {"take", [](Members&, const CommandRange&) -> Request { return TakeSeat{}; }},
        {"leave", [](Members&, const CommandRange&) -> Request { return LeaveSeat{}; }},
        {"ping", [](Members& m, const CommandRange&) -> Request { return Ping{m.number("number", 0.0, 1e15)}; }},
    };
    return kReaders;
}

} // namespace

Result<Request> read_request(std::string_view text, const CommandRange& range) {
    if (text.size() > kLongestMessage)
        return Error{ErrorCode::BadValue, fmt::format("the message has {} bytes; expected at most {}", text.size(), kLongestMessage)};
    const Parsed message = Parsed::parse(text, nullptr, false);
    if (!message.is_object()) return Error{ErrorCode::BadSyntax, "the message is no JSON object"};
    const auto type = message.find("type");
    if (type == message.end() || !type->is_string()) return Error{ErrorCode::BadValue, "\"type\" is missing, or no text"};
    const auto reader = readers().find(type->get_ref<const std::string&>());
    if (reader == readers().end())
        return Error{ErrorCode::BadValue, fmt::format("\"type\" is \"{}\", which is unknown", shown(type->get_ref<const std::string&>()))};
    Members members(message);
    Request request = reader->second(members, range);
    if (auto error = members.finish()) return *error;
    return request;
}

} // namespace trocar::engine::viewer
