// How the C-arm stands in `view`, and what its monitor shows. Plain data.
#pragma once

#include "engine/scene/scene.hpp"

#include <numbers>

namespace trocar::engine::viewer {

struct XraySettings {
    double primary = 0.0, secondary = 0.0; // rad; + LAO, + CRA
    double zoom = 1.0;                     // [1, kMostZoom] the detector's sides are divided by it
    bool at_tip = false;                   // the table stands so that the tip was in the middle when this was set
    unsigned edge = 512;                   // pixels of the picture's longer side
    XrayDisplay display = XrayDisplay::Log;

    friend bool operator==(const XraySettings&, const XraySettings&) = default;
};

/// rad; as a scene's views.
inline constexpr double kMostPrimary = std::numbers::pi, kMostSecondary = 0.5 * std::numbers::pi;
inline constexpr double kMostZoom = 8.0;
inline constexpr unsigned kLeastXrayEdge = 64, kMostXrayEdgeShown = 1024;

} // namespace trocar::engine::viewer
