// What something will cost, from what it cost before: the mean, and how far the last ones lay from it.
// source   Jacobson, "Congestion avoidance and control" (1988), the round-trip timer. Deviates: what costs less than the mean
//          narrows the forecast more slowly than what costs more widens it, since being late is dearer than being early.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <limits>

namespace trocar::engine {

class CostForecast {
public:
    constexpr CostForecast() noexcept = default;
    explicit constexpr CostForecast(double first_guess_s) noexcept : mean_(first_guess_s) {}
    /// Of what costs nearly the same every time: what takes twice as long was held up by something else.
    [[nodiscard]] static constexpr CostForecast of_steady() noexcept {
        CostForecast steady;
        steady.largest_lesson_ = 1.5;
        return steady;
    }

    void learn(double seconds) noexcept {
        last_[learned_++ % last_.size()] = seconds;
        if (!known_) {
            known_ = true;
            mean_ = seconds;
            deviation_ = kFirstSpread * seconds; // one measurement says little
            return;
        }
        seconds = std::min(seconds, largest_lesson_ * reserve_s());
        const double error = seconds - mean_;
        mean_ += kMeanGain * error;
        const double size = error < 0.0 ? -error : error;
        deviation_ += (size > deviation_ ? kWidenGain : kNarrowGain) * (size - deviation_);
    }
    /// Nothing was measured in this step: the reserve of one slow run decays, halved within 35 steps.
    void fade() noexcept {
        mean_ *= kFade;
        deviation_ *= kFade;
    }
    [[nodiscard]] double mean_s() const noexcept { return mean_; }
    /// What is set aside for several things in turn: that each of them is late at once is as unlikely as its deviations are independent.
    [[nodiscard]] static double reserve_of_all_s(std::initializer_list<CostForecast> parts) noexcept {
        CostForecast all;
        double squares = 0.0;
        for (const CostForecast& part : parts) all.mean_ += part.mean_, squares += part.deviation_ * part.deviation_;
        all.deviation_ = std::sqrt(squares);
        return all.reserve_s();
    }
    /// Few cost more: what is set aside.
    [[nodiscard]] double reserve_s() const noexcept { return mean_ + kSpread * deviation_; }
    /// The largest of the last few measurements, where that is less than the reserve. Rare long ones, such as of a program that shares
    /// its processor, keep the reserve large between them; this forgets each after kLast others.
    [[nodiscard]] double recent_s() const noexcept {
        return learned_ < last_.size() ? reserve_s() : std::min(reserve_s(), *std::max_element(last_.begin(), last_.end()));
    }
    /// Of two in turn, of which only one is held up.
    [[nodiscard]] static double recent_of_both_s(const CostForecast& a, const CostForecast& b) noexcept {
        const double long_a = a.recent_s(), long_b = b.recent_s();
        return std::max(long_a + std::min(b.mean_, long_b), std::min(a.mean_, long_a) + long_b);
    }

private:
    static constexpr double kMeanGain = 0.125, kWidenGain = 0.25, kNarrowGain = 0.05;
    static constexpr double kSpread = 3.0, kFirstSpread = 0.2;
    static constexpr double kFade = 0.98;
    static constexpr std::size_t kLast = 4;
    /// Of the reserve: a measurement beyond it is clamped to it, for it is not this work's cost (the program was suspended).
    double largest_lesson_ = 10.0;
    double mean_ = 0.0, deviation_ = 0.0;
    std::array<double, kLast> last_{}; // s, as they were measured
    std::size_t learned_ = 0;
    bool known_ = false;
};

/// How many times as long something took as what was measured before it in the same step: a forecast that follows what the step itself
/// shows, where the something has not been done for a long time.
class CostRatio {
public:
    void learn(double seconds, double before_s) noexcept {
        if (before_s > 0.0) last_[learned_++ % last_.size()] = seconds / before_s;
    }
    /// The largest of the last few; infinite until there are enough.
    [[nodiscard]] double largest() const noexcept {
        return learned_ < last_.size() ? std::numeric_limits<double>::infinity() : *std::max_element(last_.begin(), last_.end());
    }

private:
    static constexpr std::size_t kLast = 8;
    std::array<double, kLast> last_{};
    std::size_t learned_ = 0;
};

} // namespace trocar::engine
