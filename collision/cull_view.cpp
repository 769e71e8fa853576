#include "collision/cull_view.hpp"

#include <algorithm>

namespace seldinger::collision {

Result<CullView::Outcome> CullView::look(const ViewDirection& direction, const Settings& settings, CullBackend& backend) {
    const auto fitting = [&](int wanted) { return std::clamp(std::min(wanted, backend.largest_resolution()), 1, kLargestPicture); };
    Outcome outcome{.resolution = fitting(settings.resolution > 0 ? settings.resolution : backend.preferred_resolution())};
    footprints.resize(prisms.size());
    hits.resize(questions.size());
    for (;;) {
        for (;; outcome.resolution /= 2) {
            const CullFrame frame = make_cull_frame(direction, prisms, settings.reach, outcome.resolution, outcome.resolution);
            for (std::size_t p = 0; p < prisms.size(); ++p) footprints[p] = make_footprint(frame, prisms[p]);
            if (outcome.resolution < 2 || !settings.adapt || are_small_enough(footprints, questions)) break;
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

} // namespace seldinger::collision
