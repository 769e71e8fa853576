#include "collision/contact_track.hpp"

#include <utility>

namespace trocar::collision {

void ContactTrack::follow(std::span<const SearchContact> contacts) {
    std::swap(now_, before_);
    now_.clear();
    began_ = 0;
    std::size_t at = 0;
    for (const SearchContact& found : contacts) {
        while (at < before_.size() && comes_before(before_[at].found, found)) ++at;
        const bool known = at < before_.size() && !comes_before(found, before_[at].found);
        now_.push_back({found, known ? before_[at].steps + 1 : 1});
        began_ += !known;
    }
    ended_ = before_.size() - (now_.size() - began_);
}

} // namespace trocar::collision
