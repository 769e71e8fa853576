// Contacts followed from step to step: since when each pair of features has been in contact. What a response holds on to (friction, a
// sewn pair, a pair that must not get through unseen) hangs on it.
// source   Wong (2009), "robustness: keep track of colliding pairs"
#pragma once

#include "collision/surface_pair.hpp"

#include <span>
#include <vector>

namespace trocar::collision {

struct TrackedContact {
    SearchContact found;     // of the last step
    std::uint32_t steps = 1; // in a row, the last one included
};

class ContactTrack {
public:
    /// contacts   of the next step, in the order of comes_before
    /// cost       O(contacts of this step and the last)
    void follow(std::span<const SearchContact> contacts);

    [[nodiscard]] std::span<const TrackedContact> contacts() const noexcept { return now_; }
    [[nodiscard]] std::size_t began() const noexcept { return began_; } // pairs that were not in contact the step before
    [[nodiscard]] std::size_t ended() const noexcept { return ended_; } // pairs that are no longer

private:
    std::vector<TrackedContact> now_, before_;
    std::size_t began_ = 0, ended_ = 0;
};

} // namespace trocar::collision
