#include "collision/search/session_length.hpp"

#include <algorithm>

namespace trocar::collision {

/// Goes on in its direction while a step's work falls, and turns round where it grew: by half the length at a time.
unsigned SessionLength::start_session() noexcept {
    if (fixed_ > 0) return fixed_;
    if (steps_ > 0) {
        const double mean = static_cast<double>(work_) / static_cast<double>(steps_);
        if (last_ > 0.0 && mean > last_) longer_ = !longer_;
        last_ = mean;
        length_ = std::clamp(longer_ ? length_ + (length_ + 1) / 2 : length_ - length_ / 3, 1u, kLongest);
    }
    work_ = steps_ = 0;
    return length_;
}

} // namespace trocar::collision
