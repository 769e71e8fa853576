// Messages from the page: JSON objects with a "type", each with exactly the members it needs. What is not one of these is
// refused with a sentence that says what was expected.
#pragma once

#include "base/result.hpp"
#include "engine/viewer/command.hpp"
#include "engine/viewer/picks.hpp"
#include "engine/viewer/xray_settings.hpp"

#include <string_view>
#include <variant>
#include <vector>

namespace trocar::engine::viewer {

/// What a message may refer to.
struct CommandRange {
    std::vector<std::size_t> vertices; // [body] of its surface
    std::vector<bool> pullable;        // [body]
    std::vector<const EffectDescriptor*> missing{}; // effects that can be switched, but not in this scene
    bool contrast = false;                          // can be injected
    std::vector<std::size_t> triangles{};           // [body] of its surface
};

/// About this viewer alone.
struct ShowSpheres {
    bool on = false;
};
struct ShowXray {
    bool on = false;
};
/// Of the X-ray monitor, which all viewers share: the driver's.
struct SetXray {
    XraySettings settings;
};
/// The next frame is the mask that subtraction and roadmap begin from.
struct TakeMask {};
/// The driver's seat: taken where it is free, given up.
struct TakeSeat {};
struct LeaveSeat {};
/// Answered with the same number: how long a message takes.
struct Ping {
    double number = 0.0;
};

using Request = std::variant<Command, ShowSpheres, ShowXray, SetXray, TakeMask, PickPlace, ForgetPicks, SaveScene, TakeSeat, LeaveSeat, Ping>;

/// Bytes of a message at most; a pull, the longest, takes about 150.
inline constexpr std::size_t kLongestMessage = 2048;

/// fails  BadSyntax: no JSON object; BadValue: unknown type or member, a member that is missing, of another kind or out of
///        range; BadUsage: something the scene does not have
[[nodiscard]] Result<Request> read_request(std::string_view text, const CommandRange& range);

} // namespace trocar::engine::viewer
