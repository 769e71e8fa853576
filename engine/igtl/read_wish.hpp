// What a client asks for, out of a TRANSFORM or a STRING: checked here, so that the simulation's thread gets what it can do.
#pragma once

#include "base/result.hpp"
#include "engine/igtl/codec.hpp"
#include "engine/igtl/devices.hpp"
#include "engine/viewer/read_command.hpp"

#include <variant>

namespace trocar::engine::igtl {

/// Speeds of the instrument that the client drives, as shares of its limits: one changes, the other stays.
struct InsertAt {
    double share = 0.0; // [-1, 1]
};
struct RotateAt {
    double share = 0.0; // [-1, 1]
};
/// A place to drive to. Of the angle no more is known than a matrix says.
struct MoveTo {
    double insertion = 0.0; // m
    double angle = 0.0;     // rad, in [-pi, pi]
};
/// All surfaces again.
struct SendSurfaces {};

using Wish = std::variant<viewer::Command, InsertAt, RotateAt, MoveTo, SendSurfaces, viewer::TakeSeat, viewer::LeaveSeat>;

/// Bytes of a command that is read; the longest names an instrument.
inline constexpr std::size_t kLongestCommand = 256;
/// m; no instrument is longer.
inline constexpr double kMostInsertion = 10.0;

/// text   as in docs/igtl.md: "pause", "go on", "insert NAME MM_PER_S", ...
/// fails  BadValue: no such command, instrument or number; BadUsage: something the scene does not have
[[nodiscard]] Result<Wish> read_command(std::string_view text, const SceneModel& model, const Devices& devices);
/// device  where the TRANSFORM goes to
/// fails   BadUsage: no instrument that is driven has this name; BadValue: a number that is not finite or out of range, or a tilted z axis
[[nodiscard]] Result<Wish> read_drive(std::string_view device, const Transform& transform, const SceneModel& model, const Devices& devices);

} // namespace trocar::engine::igtl
