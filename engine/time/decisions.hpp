// What the clock decided in a step, in the order in which it was asked. Everything else in a step follows from the state:
// with these decisions a wall run can be repeated bit for bit.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace trocar::engine {

enum class DecisionKind : std::uint8_t {
    Descent, // units of a grant for sphere-pair tests
    Fits,    // 1: the exact stage is started
    Round,   // 1: the exact stage solves the instrument once more
    Tests,   // units of a grant for continuous tests
    Drop,    // effects that this step leaves out, a bit per Droppable
    Cull,    // 1: image-space culling filters the candidates of the continuous tests first
    Surfaces, // units of a grant for the surfaces of solids
    Rows,     // places times iterations that solves of contact may take in the step
    Response, // 1: instruments are solved between planes of where their walls are now
    Places,   // of instruments, whose planes are made anew where that does not fit
};

struct Decision {
    DecisionKind kind = DecisionKind::Descent;
    std::uint64_t value = 0;
    friend bool operator==(const Decision&, const Decision&) = default;
};

/// Asks the clock, or a record of an earlier run in its place.
class DecisionTape {
public:
    /// From now on every decision is appended here; nullptr: no more.
    void record_into(std::vector<Decision>* log) noexcept { log_ = log; }
    /// The next decisions are these. They must outlive their use.
    void replay(std::span<const Decision> decisions) noexcept {
        script_ = decisions;
        next_ = 0;
        replaying_ = true;
        left_script_ = false;
    }
    [[nodiscard]] bool replaying() const noexcept { return replaying_; }
    /// Something was asked that the record does not hold, or not all of it was asked for: this is not the same run.
    [[nodiscard]] bool left_script() const noexcept { return left_script_ || (replaying_ && next_ != script_.size()); }

    template <class AskClock>
    [[nodiscard]] std::uint64_t decide(DecisionKind kind, AskClock&& ask_clock) {
        std::uint64_t value = 0;
        if (!replaying_)
            value = ask_clock();
        else if (next_ < script_.size() && script_[next_].kind == kind)
            value = script_[next_++].value;
        else
            left_script_ = true; // nothing is granted any more
        if (log_ != nullptr) log_->push_back({kind, value});
        return value;
    }

private:
    std::vector<Decision>* log_ = nullptr;
    std::span<const Decision> script_;
    std::size_t next_ = 0;
    bool replaying_ = false, left_script_ = false;
};

} // namespace trocar::engine
