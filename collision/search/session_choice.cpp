#include "collision/search/session_choice.hpp"

#include <algorithm>

namespace trocar::collision {

void SessionChoice::note_session(double work, double least_plain) noexcept {
    age_ += age_ < std::numeric_limits<unsigned>::max();
    if (plain_ == 0.0) {
        measures_ = unsettled_ = work > least_plain;
        owed_ += unsettled_ ? work : 0.0;
        return;
    }
    const double plain = std::max(least_plain, plain_); // an old measurement is better than none
    owed_ = std::max(0.0, owed_ + work - plain);
    const bool doubtful = owed_ > kDoubt * plain && age_ > kRecent;
    measures_ = work > least_plain && (age_ > kFresh || doubtful);
    rests_ = owed_ > kMostOwed * plain && !measures_;
}

void SessionChoice::note_plain(double work) noexcept {
    if (unsettled_) owed_ -= work;
    else if (measures_ && work > plain_) owed_ -= 0.5 * (work - plain_) * age_; // as if it had grown evenly since the last measure
    unsettled_ = false;
    plain_ = work;
    age_ = 0;
    measures_ = false;
    owed_ = std::max(0.0, owed_ - kPaidOff * work);
    rests_ = owed_ > (rests_ ? 0.0 : kMostOwed * work);
}

} // namespace trocar::collision
