// Does image-space culling of the candidate triangles pay before their pairs of features are tested? Predicted from rates: declared until
// one was measured, and always declared where no clock may decide.
#pragma once

#include <algorithm>
#include <cstddef>

namespace trocar::engine {

/// A straight line through what was measured, old measurements fading: a start-up cost and a cost per item.
class LineFit {
public:
    void add(double x, double y) noexcept {
        for (double* sum : {&n_, &x_, &xx_, &y_, &xy_}) *sum *= kFade;
        n_ += 1.0;
        x_ += x;
        xx_ += x * x;
        y_ += y;
        xy_ += x * y;
    }
    [[nodiscard]] bool known() const noexcept { return n_ > 0.0; }
    [[nodiscard]] double at(double x) const noexcept {
        const double spread = n_ * xx_ - x_ * x_;
        if (spread <= kLeastSpread * n_ * xx_) return x_ > 0.0 ? x * y_ / x_ : y_ / n_; // all of one size: in proportion
        const double slope = std::max(0.0, (n_ * xy_ - x_ * y_) / spread);
        return std::max(0.0, (y_ - slope * x_) / n_) + slope * x;
    }

private:
    static constexpr double kFade = 0.9, kLeastSpread = 1e-3;
    double n_ = 0.0, x_ = 0.0, xx_ = 0.0, y_ = 0.0, xy_ = 0.0;
};

class CullCostModel {
public:
    /// What holds before anything was measured.
    struct Rates {
        double culling_s = 0.0, culling_s_per_item = 0.0; // s
        double test_s_per_item = 0.0;               // s
        double dropped = 1.0;                       // share of the items that a culling pass removes from the tests
    };
    explicit CullCostModel(const Rates& declared) noexcept : declared_(declared), dropped_(declared.dropped) {}

    [[nodiscard]] double culling_s(std::size_t items) const noexcept {
        const auto n = static_cast<double>(items);
        return look_.known() ? look_.at(n) : declared_.culling_s + declared_.culling_s_per_item * n;
    }
    [[nodiscard]] double saved_s(std::size_t items) const noexcept {
        return dropped_ * static_cast<double>(items) * (test_s_ > 0.0 ? test_s_ : declared_.test_s_per_item);
    }
    [[nodiscard]] bool pays(std::size_t items) const noexcept { return items > 0 && culling_s(items) < saved_s(items); }

    /// A culling pass whose answer came too late and was dropped.
    void note_late_culling(std::size_t items, double seconds) noexcept { look_.add(static_cast<double>(items), seconds); }
    void note_culling(std::size_t items, std::size_t left, double seconds) noexcept {
        if (items == 0) return;
        look_.add(static_cast<double>(items), seconds);
        dropped_ = 1.0 - static_cast<double>(left) / static_cast<double>(items);
    }
    void note_tests(std::size_t items, double seconds) noexcept {
        if (items == 0) return;
        const double rate = seconds / static_cast<double>(items);
        test_s_ = test_s_ > 0.0 ? test_s_ + kNewest * (rate - test_s_) : rate;
    }
    /// A step without a culling pass: the motion has changed since, so the share it is expected to cull is slowly raised again.
    void pass_over() noexcept { dropped_ += kHope * (declared_.dropped - dropped_); }

private:
    static constexpr double kNewest = 0.25, kHope = 0.02;
    Rates declared_;
    LineFit look_;
    double test_s_ = 0.0; // 0: not measured
    double dropped_;
};

} // namespace trocar::engine
