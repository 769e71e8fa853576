// The C-arm of `view` and its monitor, one for all viewers: a thread of its own projects the latest state that the simulation has left for it
// (engine/fluoroscopy: Beer-Lambert along each ray). Neither the simulation nor the network waits for it.
//
// Message, little endian: u8 kind (3), u8 version (kWireVersion), u16 flags, u32 number, u16 columns, u16 rows, u32 display, f64 time [s], f32 primary,
// f32 secondary [rad], f32 tip u, v [pixels; NaN: there is none], f32 zoom, f32 ms that it took; then u8 grey [rows][columns], dark where X-rays are attenuated.
#pragma once

#include "engine/viewer/latest.hpp"
#include "engine/viewer/xray_settings.hpp"

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

namespace trocar::engine {
struct SceneModel;
}

namespace trocar::engine::viewer {

struct Exchange;

inline constexpr std::uint8_t kXrayMessage = 3;
/// Bits of a picture's flags.
inline constexpr unsigned kXrayHasContrast = 1, kXraySourceInside = 2, kXrayNewMask = 4;

class XrayMonitor {
public:
    /// The first view of the scene's outputs.fluoroscopy gives distances, detector and physics; without one the whole patient is in the picture.
    /// all outlive it
    XrayMonitor(const Scene& scene, const SceneModel& model, Exchange& exchange);
    ~XrayMonitor();
    XrayMonitor(const XrayMonitor&) = delete;
    XrayMonitor& operator=(const XrayMonitor&) = delete;

    /// Nobody looks: nothing is projected.
    void show(bool on);
    void set(const XraySettings& settings);
    /// The next picture is the mask.
    void take_mask();
    /// The latest picture's message; nullptr: none since the last call. One thread.
    [[nodiscard]] std::shared_ptr<const std::string> take();

private:
    class Screen; // the thread's own
    /// What the network asks for, under the mutex.
    struct Wishes {
        XraySettings settings;
        unsigned set = 0, masks = 0; // how often they were
        bool shown = false, stop = false;
    };
    void run();

    const Scene& scene_;
    const SceneModel& model_;
    Exchange& exchange_;
    std::mutex mutex_;
    std::condition_variable changed_;
    Wishes wishes_;
    Latest<std::shared_ptr<const std::string>> pictures_;
    std::thread thread_;
};

} // namespace trocar::engine::viewer
