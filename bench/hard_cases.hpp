// Hard cases: situations in which simulators are known to break. Each says what "stable" means in it, and measures how far it is
// from its bound. The tests run every one of them, and `trocar bench hard-cases` prints the same figures as one table.
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct HardMargin {
    std::string what;
    double measured = 0.0;
    char relation = '<'; // '<': holds below the bound, '>': above it, '=': equal to it
    double bound = 0.0;
    std::string unit; // empty: a ratio, or a count
    /// A figure that is not a number never holds.
    [[nodiscard]] bool holds() const noexcept {
        return relation == '<' ? measured < bound : relation == '>' ? measured > bound : measured == bound;
    }
};

/// What one case came to.
class HardReport {
public:
    void below(std::string what, double measured, double bound, std::string unit = "") {
        margins_.push_back({std::move(what), measured, '<', bound, std::move(unit)});
    }
    void above(std::string what, double measured, double bound, std::string unit = "") {
        margins_.push_back({std::move(what), measured, '>', bound, std::move(unit)});
    }
    void equal(std::string what, double measured, double wanted, std::string unit = "") {
        margins_.push_back({std::move(what), measured, '=', wanted, std::move(unit)});
    }
    /// A figure without a bound: shown, never wrong.
    void note(std::string sentence) { notes_.push_back(std::move(sentence)); }
    /// What has no figure. Returns it.
    bool require(bool holds, std::string_view sentence) {
        if (!holds) broken_.emplace_back(sentence);
        return holds;
    }

    [[nodiscard]] std::span<const HardMargin> margins() const noexcept { return margins_; }
    [[nodiscard]] std::span<const std::string> broken() const noexcept { return broken_; } // sentences that do not hold
    [[nodiscard]] std::span<const std::string> notes() const noexcept { return notes_; }

private:
    std::vector<HardMargin> margins_;
    std::vector<std::string> broken_, notes_;
};

struct HardCase {
    std::string_view group, name;
    std::string_view stable; // what stable means here: the bound, and why
    void (*run)(HardReport&);
};

[[nodiscard]] std::span<const HardCase> hard_elements() noexcept;
[[nodiscard]] std::span<const HardCase> hard_steps() noexcept;
[[nodiscard]] std::span<const HardCase> hard_sweeps() noexcept;
[[nodiscard]] std::span<const HardCase> hard_contacts() noexcept;
[[nodiscard]] std::span<const HardCase> hard_places() noexcept;
[[nodiscard]] std::span<const HardCase> hard_tunnels() noexcept;
[[nodiscard]] std::span<const HardCase> hard_presses() noexcept;
[[nodiscard]] std::span<const HardCase> hard_slopes() noexcept;
[[nodiscard]] std::span<const HardCase> hard_instruments() noexcept;
[[nodiscard]] std::span<const HardCase> hard_runs() noexcept;

/// All of them, in that order.
[[nodiscard]] std::vector<HardCase> hard_cases();

} // namespace trocar::engine
