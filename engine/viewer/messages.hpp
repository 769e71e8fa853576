// Text messages of the server: the scene, once; then with every frame the status of the run. Those about places: place_messages.hpp.
#pragma once

#include "engine/prepare/prepare_scene.hpp"
#include "engine/viewer/loop.hpp"
#include "engine/viewer/lumen_places.hpp"
#include "engine/viewer/read_command.hpp"

#include <deque>
#include <string>

namespace trocar::engine::viewer {

/// The last steps, numbered as they came, for viewers that are at different places in them.
class PlotHistory {
public:
    static constexpr std::size_t kKept = 4096;
    /// Points in one message at most; a viewer that is further behind loses the older ones.
    static constexpr std::size_t kInOneMessage = 400;

    void take(Exchange& exchange);
    [[nodiscard]] std::uint64_t end() const noexcept { return first_ + points_.size(); }
    [[nodiscard]] std::uint64_t first() const noexcept { return first_; }
    [[nodiscard]] const PlotPoint& at(std::uint64_t number) const { return points_[number - first_]; }

private:
    std::deque<PlotPoint> points_;
    std::uint64_t first_ = 0; // number of the oldest that is kept
};

/// Viewer and driver of a connection.
struct SeatView {
    unsigned you = 0;
    unsigned driver = 0; // 0: nobody
    std::size_t viewers = 0;
};

/// places  of the vessel that the first instrument moves in, or nullptr
[[nodiscard]] std::string scene_message(const Scene& scene, const PreparedScene& prepared, const Session& session, const LumenPlaces* places);
/// cursor  first point that this viewer has not seen; moved on
[[nodiscard]] std::string status_message(const Snapshot& snapshot, std::uint32_t frame, const SeatView& seats, const PlotHistory& plot,
                                         std::uint64_t not_shown, std::uint64_t& cursor);
[[nodiscard]] std::string error_message(std::string_view text);
[[nodiscard]] std::string notice_message(std::string_view text);
[[nodiscard]] std::string pong_message(double number);

[[nodiscard]] CommandRange range_of(const SceneModel& model);

} // namespace trocar::engine::viewer
