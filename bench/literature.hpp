// A case that the literature compares solvers by, and what the engine makes of it at several resolutions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace trocar::engine {

/// Where the number that a case is compared with comes from.
enum class ReferenceKind : std::uint8_t { ClosedForm, Quoted, Beside };

struct LiteratureRow {
    std::string name, quantity;  // of the case; what is compared, with its unit
    std::string source;          // author and year
    ReferenceKind kind = ReferenceKind::ClosedForm;
    double reference = 0.0;      // 0: the error is what was measured itself
    std::string size_name;       // what is refined: segments, cells, ms
    std::vector<double> sizes;   // coarsest first
    std::vector<double> measured; // [sizes]
    double stated = 0.0;         // the size that the target is for, one of them
    double target = 0.0;         // [-] relative error that is wanted there
    double bound = 0.0;          // [-] that a test holds; the target where it is met
    std::string reason;          // why it misses the target, as far as is known

    [[nodiscard]] double error(std::size_t at) const; // [-] relative; absolute where the reference is 0
    [[nodiscard]] double stated_error() const;
    [[nodiscard]] double order() const; // of convergence, by the three finest; 0: not known
};

/// quick   coarser, and fewer sizes: what a test can wait for
[[nodiscard]] std::vector<LiteratureRow> measure_rod_literature(bool quick);
[[nodiscard]] std::vector<LiteratureRow> measure_tissue_literature(bool quick);

} // namespace trocar::engine
