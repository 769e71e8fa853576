#include "collision/culling/cull_view.hpp"

#include <algorithm>

namespace trocar::collision {

void CullView::reserve(std::size_t prism_count, std::size_t question_count, std::size_t set_count) {
    prisms.reserve(prism_count);
    corners.reserve(prism_count);
    set_members.reserve(prism_count);
    footprints.reserve(prism_count);
    questions.reserve(question_count);
    hits.reserve(question_count);
    set_begin.reserve(set_count + 1);
    question_begin.reserve(set_count + 1);
}

void CullView::make_footprints(const ViewDirection& direction, double reach, int resolution) {
    if (hulls.hull_of.empty()) {
        const CullFrame frame = make_cull_frame(direction, prisms, reach, resolution, resolution);
        for (std::size_t p = 0; p < prisms.size(); ++p) footprints[p] = make_footprint(frame, prisms[p]);
        return;
    }
    const CullFrame frame = make_cull_frame(direction, hulls.points, reach, resolution, resolution);
    const std::span<const Vec3> points(hulls.points);
    for (std::size_t h = 0; h < hulls.normals.size(); ++h)
        footprints[h] = make_footprint(frame, points.subspan(hulls.begin[h], hulls.begin[h + 1] - hulls.begin[h]), hulls.normals[h]);
    for (std::size_t p = hulls.normals.size(); p < footprints.size(); ++p) footprints[p] = footprints[hulls.hull_of[p]];
}

Result<CullView::Outcome> CullView::look(const ViewDirection& direction, const Settings& settings, CullBackend& backend) {
    const auto fitting = [&](int wanted) { return std::clamp(std::min(wanted, backend.largest_resolution()), 1, kLargestPicture); };
    Outcome outcome{.resolution = fitting(settings.resolution > 0 ? settings.resolution : backend.preferred_resolution())};
    footprints.resize(corners.size());
    hits.resize(questions.size());
    for (;;) {
        for (;; outcome.resolution /= 2) {
            make_footprints(direction, settings.reach, outcome.resolution);
            if (outcome.resolution < 2 || !settings.adapt || are_small_enough(footprints, questions, settings.pixels_per_footprint)) break;
        }
        std::fill(hits.begin(), hits.end(), std::uint8_t{1});
        const auto done = backend.find_hits({.width = outcome.resolution,
                                             .height = outcome.resolution,
                                             .footprints = footprints,
                                             .corners = corners,
                                             .set_begin = set_begin,
                                             .set_members = set_members,
                                             .questions = questions,
                                             .question_begin = question_begin,
                                             .memory = settings.memory},
                                            hits);
        if (done.ok()) return outcome;
        if (backend.largest_resolution() >= outcome.resolution) return done.error();
        outcome.resolution = fitting(outcome.resolution);
        ++outcome.lowered_for_memory;
    }
}

} // namespace trocar::collision
