// The guarantees that a run kept and those it gave up, in plain sentences.
#pragma once

#include "engine/report/summary.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

enum class Mark : std::uint8_t { Good, Note, Bad };

/// The run's first sentence, and one that gives its basis.
struct Verdict {
    Mark mark = Mark::Good;
    std::string headline;
    std::string detail;
};
[[nodiscard]] Verdict make_verdict(const RunRecord& record);

/// One thing that may be given up: how much of it was, what that means, which setting would help.
struct Loss {
    Mark mark = Mark::Good;
    std::string name;   // "Exact contacts"
    std::string amount; // "skipped in 12 of 2400 steps", "none"
    std::string advice; // empty when nothing was lost
    bool loud = false;  // the run is not what the scene asks for: told on the terminal and in summary.json as well
};
[[nodiscard]] std::vector<Loss> list_losses(const RunRecord& record);
/// "Crushed elements: up to 3 tetrahedra in ...", of those losses that are loud.
[[nodiscard]] std::vector<std::string> list_warnings(const RunRecord& record);

/// What is charged to a budget: "collision detection", "the whole step".
[[nodiscard]] std::string scope_text(const BudgetSpec& budget);

/// Three significant digits, all those before the point: "0.0123", "45.6", "1234".
[[nodiscard]] std::string number_text(double value);

/// "1 step", "2400 steps"; thin spaces between thousands.
[[nodiscard]] std::string count_text(std::uint64_t count, const char* singular, const char* plural);

} // namespace trocar::engine
