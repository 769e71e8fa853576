#include "engine/viewer/read_command.hpp"

#include "engine/io/shown.hpp"
#include "engine/viewer/message_members.hpp"
#include "engine/viewer/session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <map>

namespace trocar::engine::viewer {

namespace {

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
