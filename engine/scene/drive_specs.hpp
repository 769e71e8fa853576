// What bounds and moves an instrument's handle.
#pragma once

namespace trocar::engine {

/// Of drive commands: a surgeon's in the literature.
struct DriveLimits {
    double speed = 0.035;   // m/s, of insertion and retraction
    double rotation = 3.14; // rad/s
};

/// How the script drives the tip along a route.
struct FollowSettings {
    double speed = 0.025;      // m/s of insertion where the way is straight, at most the limit
    double look_ahead = 0.012; // m, of the route beyond the tip that the tip is turned to
    double tolerance = 0.003;  // m, to the target: arrived
};

} // namespace trocar::engine
