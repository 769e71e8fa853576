#include "engine/igtl/read_wish.hpp"

#include "engine/effects/contrast/contrast.hpp"
#include "engine/io/printable.hpp"
#include "engine/state/state.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <map>
#include <numbers>

namespace trocar::engine::igtl {

namespace {

/// What the z axis of a drive command may lean by, as the sine of its angle: rounding of a matrix of single precision, and no more.
constexpr double kMostTilt = 1e-3;
constexpr double kRadPerDegree = std::numbers::pi / 180.0;

/// A stranger's text as a message repeats it.
std::string shown(std::string_view text) {
    const std::string clean = printable(text.substr(0, 40));
    return text.size() > 40 ? clean + "..." : clean;
}

std::string_view trimmed(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(" \t\r\n");
    return begin == std::string_view::npos ? std::string_view() : text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
}

std::optional<double> read_number(std::string_view text) {
    double value = 0.0;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failed != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
    return value;
}

/// Commands of one word or two, which need nothing.
const std::map<std::string_view, Wish>& plain_commands() {
    using namespace viewer;
    static const std::map<std::string_view, Wish> kCommands = {
        {"pause", Command{Pause{true}}},      {"go on", Command{Pause{false}}},
        {"step", Command{SingleStep{}}},      {"restart", Command{Restart{}}},
        {"stop", Command{Drive{}}},           {"script on", Command{FollowScript{true}}},
        {"script off", Command{FollowScript{false}}}, {"inject", Command{Inject{}}},
        {"surfaces", SendSurfaces{}},         {"take", TakeSeat{}},
        {"leave", LeaveSeat{}},
    };
    return kCommands;
}

/// The name between a command's first and last word: of the instrument that user input drives.
Result<void> check_name(std::string_view name, const SceneModel& model, const Devices& devices) {
    const auto is_of = [&](std::size_t i) { return name == model.instruments[i].name || name == devices.instruments[i].skin; };
    if (!model.instruments.empty() && is_of(kLeadInstrument)) return {};
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        if (is_of(i)) return Error{ErrorCode::BadUsage, fmt::format("\"{}\" follows its script; \"{}\" is driven", shown(name), devices.instruments[kLeadInstrument].skin)};
    if (model.instruments.empty()) return Error{ErrorCode::BadUsage, "the scene has no instrument"};
    return Error{ErrorCode::BadUsage, fmt::format("no instrument is called \"{}\"; expected \"{}\"", shown(name), devices.instruments[kLeadInstrument].skin)};
}

/// limit  m/s or rad/s;   scale  of the number into that;   unit  of the number
Result<double> read_share(std::string_view number, double limit, double scale, const char* unit) {
    const auto value = read_number(number);
    const double most = limit / scale;
    if (!value || std::abs(*value) > most * (1.0 + 1e-9))
        return Error{ErrorCode::BadValue, fmt::format("\"{}\" is no speed; expected -{:.4g} to {:.4g} {}", shown(number), most, most, unit)};
    return std::clamp(*value / most, -1.0, 1.0);
}

} // namespace

Result<Wish> read_command(std::string_view text, const SceneModel& model, const Devices& devices) {
    if (text.size() > kLongestCommand)
        return Error{ErrorCode::BadValue, fmt::format("the command has {} bytes; expected at most {}", text.size(), kLongestCommand)};
    text = trimmed(text);
    if (const auto found = plain_commands().find(text); found != plain_commands().end()) {
        const auto* command = std::get_if<viewer::Command>(&found->second);
        if (command != nullptr && std::holds_alternative<viewer::Inject>(*command) && !effects::find_injection(model))
            return Error{ErrorCode::BadUsage, "the scene has no contrast; expected the effect \"contrast\" in it"};
        return found->second;
    }
    const std::string_view verb = text.substr(0, text.find(' '));
    const std::size_t last = text.rfind(' ');
    if ((verb != "insert" && verb != "rotate") || last == std::string_view::npos || last <= verb.size())
        return Error{ErrorCode::BadValue, fmt::format("\"{}\" is no command; expected pause, go on, step, restart, stop, script on, script off, inject, "
                                                      "surfaces, take, leave, insert NAME MM_PER_S or rotate NAME DEG_PER_S",
                                                      shown(text))};
    if (const auto known = check_name(trimmed(text.substr(verb.size(), last - verb.size())), model, devices); !known.ok()) return known.error();
    const DriveLimits& limits = model.instruments[kLeadInstrument].limits;
    const bool inserts = verb == "insert";
    const auto share = inserts ? read_share(text.substr(last + 1), limits.speed, 1e-3, "mm/s")
                               : read_share(text.substr(last + 1), limits.rotation, kRadPerDegree, "degrees/s");
    if (!share.ok()) return share.error();
    return inserts ? Wish{InsertAt{*share}} : Wish{RotateAt{*share}};
}

Result<Wish> read_drive(std::string_view device, const Transform& transform, const SceneModel& model, const Devices& devices) {
    if (model.instruments.empty() || device != devices.instruments[kLeadInstrument].drive)
        return Error{ErrorCode::BadUsage, fmt::format("nothing takes a TRANSFORM \"{}\"{}", shown(device),
                                                      model.instruments.empty() ? std::string("; the scene has no instrument")
                                                                                : "; expected \"" + devices.instruments[kLeadInstrument].drive + '"')};
    if (!transform.finite() || std::abs(transform.origin.z()) > kMostInsertion)
        return Error{ErrorCode::BadValue, fmt::format("a drive command has numbers that are not finite, or goes farther than {} mm", 1e3 * kMostInsertion)};
    const double cosine = transform.x.x(), sine = transform.x.y(), length = std::sqrt(cosine * cosine + sine * sine);
    if (std::abs(length - 1.0) > kMostTilt || std::abs(transform.x.z()) > kMostTilt || (transform.z - Vec3::UnitZ()).squaredNorm() > kMostTilt * kMostTilt)
        return Error{ErrorCode::BadValue, "a drive command turns about another axis than z, or scales; expected a translation along z and a rotation about z"};
    return Wish{MoveTo{transform.origin.z(), std::atan2(sine, cosine)}};
}

} // namespace trocar::engine::igtl
