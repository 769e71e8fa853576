#include "engine/render/hand_over.hpp"

#include <algorithm>
#include <numeric>

namespace trocar::engine {

HandOver::HandOver(std::span<const Triangle> triangles, std::span<const Vec3> positions) {
    constexpr std::size_t kSample = 2000; // triangles: some milliseconds
    const std::size_t count = std::min(kSample, triangles.size());
    std::vector<Triangle> part(triangles.begin(), triangles.begin() + static_cast<std::ptrdiff_t>(count));
    std::vector<Index> place(positions.size(), kNoIndex), ids(count);
    std::vector<Vec3> used; // a part of the mesh by itself, as small as what is handed over
    for (Triangle& t : part)
        for (Index& v : t) {
            if (place[v] == kNoIndex) {
                place[v] = static_cast<Index>(used.size());
                used.push_back(positions[v]);
            }
            v = place[v];
        }
    std::iota(ids.begin(), ids.end(), Index{0});
    const StopWatch watch;
    (void)collision::find_crossings(part, used, ids);
    if (count > 0) test_ms_per_triangle_ = watch.elapsed_ms() / static_cast<double>(count);
    watch_ = StopWatch();
}

void HandOver::see(const collision::ImageSpacePass& pass) noexcept {
    if (pass.patches == 0)
        ++passes_;
    else
        watch_ = StopWatch();
}

bool HandOver::go_on(const collision::ImageSpacePass& last) {
    const double pass_ms = watch_.lap_ms() / static_cast<double>(std::max<std::size_t>(passes_, 1)); // the first answer comes after three
    passes_ = 0;
    const double saved_ms = static_cast<double>(last.triangles - last.triangles_left) * test_ms_per_triangle_;
    return saved_ms > pass_ms;
}

} // namespace trocar::engine
