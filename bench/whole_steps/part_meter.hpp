// What each part of a step took: time and hardware counters, kept by step.
#pragma once

#include "bench/whole_steps/perf_counters.hpp"
#include "engine/time/clock.hpp"
#include "engine/time/step_probe.hpp"

#include <cassert>
#include <vector>

namespace trocar::engine {

struct PartSamples {
    std::vector<double> ms;  // [steps]
    CounterValues counted{}; // all steps together
    std::uint64_t times = 0; // that it was entered
};

/// Parts may nest in other parts, not in themselves. It allocates in its constructor alone.
class PartMeter final : public StepProbe {
public:
    using Now = std::int64_t (*)() noexcept;
    /// steps   at most so many are kept
    /// now     ns; the thread's own time, which other programs do not disturb, takes a system call at either end of a part
    PartMeter(const PerfCounters& counters, std::size_t steps, Now now = &thread_cpu_ns) : counters_(counters), now_ns_(now) {
        for (PartSamples& part : parts_) part.ms.reserve(steps);
    }
    void begin(ProbedPart part) noexcept override {
        const auto k = static_cast<std::size_t>(part);
        if (counters_.counts()) began_[k].counters = counters_.read();
        began_[k].ns = now_ns_();
    }
    void end(ProbedPart part) noexcept override {
        const auto k = static_cast<std::size_t>(part);
        now_[k] += 1e-6 * static_cast<double>(now_ns_() - began_[k].ns);
        ++parts_[k].times;
        if (!counters_.counts()) return;
        const CounterValues ended = counters_.read();
        for (std::size_t i = 0; i < ended.size(); ++i) parts_[k].counted[i] += ended[i] - began_[k].counters[i];
    }
    /// Between steps.
    void end_step() noexcept {
        for (std::size_t k = 0; k < kProbedParts; ++k) {
            assert(parts_[k].ms.size() < parts_[k].ms.capacity());
            parts_[k].ms.push_back(now_[k]);
        }
        now_ = {};
    }
    /// What was measured so far is forgotten: a warm-up.
    void forget() noexcept {
        for (PartSamples& part : parts_) part.ms.clear(), part.counted = {}, part.times = 0;
        now_ = {};
    }
    /// ms of each step: the sum of the parts that follow one another.
    [[nodiscard]] std::vector<double> whole_steps() const {
        std::vector<double> whole(parts_.front().ms.size(), 0.0);
        for (std::size_t part = 0; part < kFirstInnerPart; ++part)
            for (std::size_t k = 0; k < whole.size(); ++k) whole[k] += parts_[part].ms[k];
        return whole;
    }
    [[nodiscard]] const PartSamples& of(ProbedPart part) const noexcept { return parts_[static_cast<std::size_t>(part)]; }

private:
    struct Began {
        std::int64_t ns = 0;
        CounterValues counters{};
    };
    const PerfCounters& counters_;
    Now now_ns_;
    std::array<PartSamples, kProbedParts> parts_;
    std::array<Began, kProbedParts> began_{};
    std::array<double, kProbedParts> now_{}; // ms, of the step that goes on
};

} // namespace trocar::engine
