// How many steps a session lasts: longer ones share a traversal among more steps and pay with larger volumes, so more pairs that wait
// beside each other. Found by trying, from counted work: the same steps give the same lengths on every machine.
// source   Wong (2009), "number of skipping frames = d / (v t)". Deviates: the free distance d, the inflation, is what a session is
//          given for its length; which length pays is measured.
#pragma once

#include <algorithm>
#include <cstdint>

namespace trocar::collision {

class SessionLength {
public:
    static constexpr unsigned kLongest = 64; // steps

    /// fixed   steps of every session; 0: adapts
    explicit SessionLength(unsigned fixed = 0) noexcept : fixed_(fixed), length_(fixed > 0 ? fixed : kFirst) {}

    /// Work of a step for the session's sake: traversal, and pairs that were kept in vain.
    void note_step(std::uint64_t work) noexcept {
        work_ += work;
        ++steps_;
    }
    /// Length of the session that begins now.
    [[nodiscard]] unsigned start_session() noexcept;
    /// It turned out too long: half of it. A fixed length stays.
    unsigned halve() noexcept {
        length_ = fixed_ > 0 ? fixed_ : std::max(1u, length_ / 2);
        longer_ = false;
        return length_;
    }

private:
    static constexpr unsigned kFirst = 4;

    unsigned fixed_, length_;
    bool longer_ = true;
    std::uint64_t work_ = 0, steps_ = 0;
    double last_ = 0.0; // work of a step in the session before
};

} // namespace trocar::collision
