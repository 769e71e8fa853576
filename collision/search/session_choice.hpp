// Whether a step is done with what is kept, or plainly, as if there were nothing: sessions cost more than they save where everything
// leaves its place in every step. Decided from counted work alone, so that the same steps are done the same way on every machine.
//
// A session's first step is dearer than a plain one; those after it are to make up for that. What is owed so far is summed up step by
// step against what a plain step costs: at least its refit, its neighbours and this step's candidates, which are counted anyway; where
// that does not settle it, a plain step now and then is the measure. Where too much is owed, plain steps follow until it is a small
// share of them. So a sequence of plain steps, whatever moves how, is worse by that share at most, and by one failed attempt.
#pragma once

#include <cstdint>
#include <limits>

namespace trocar::collision {

class SessionChoice {
public:
    /// A session that owes more than so many plain steps is given up.
    static constexpr double kMostOwed = 1.75;
    /// Share of a plain step by which it pays off what is owed.
    static constexpr double kPaidOff = 0.03;
    /// Steps after which a measured plain step no longer counts; where so many plain steps are owed, after fewer of them.
    static constexpr unsigned kFresh = 16, kRecent = 8;
    static constexpr double kDoubt = 0.25;

    /// falls_back   false: always with what is kept
    explicit SessionChoice(bool falls_back = true) noexcept : falls_back_(falls_back) {}

    /// Does the next step go without what is kept, whatever moves how?
    [[nodiscard]] bool wants_plain() const noexcept { return falls_back_ && (rests_ || measures_); }
    [[nodiscard]] bool falls_back() const noexcept { return falls_back_; }

    /// A step that was done with what is kept.
    /// work          of it
    /// least_plain   that a plain step would have taken, surely
    void note_session(double work, double least_plain) noexcept;
    /// Work for a step that a plain one must do after all.
    void note_lost(double work) noexcept { owed_ += work; }
    void note_plain(double work) noexcept;

    /// Work of the sessions beyond that of plain steps, not paid off yet.
    [[nodiscard]] double owed() const noexcept { return owed_; }
    /// What a plain step takes, as far as is known.
    [[nodiscard]] double plain_work() const noexcept { return plain_; }

private:
    bool falls_back_;
    bool rests_ = false, measures_ = false;
    bool unsettled_ = false; // a step was owed as a whole, since nothing had been measured
    double owed_ = 0.0, plain_ = 0.0;
    unsigned age_ = std::numeric_limits<unsigned>::max(); // steps since plain_ was measured
};

} // namespace trocar::collision
