// Laws of contact: what each demands, and what runs made of it.
#include "bench/law_row.hpp"
#include "bench/tables.hpp"

#include <cmath>

namespace trocar::engine {

Result<BenchTable> bench_laws(const BenchOptions& options) {
    BenchTable table;
    table.quick = options.quick;
    options.progress("solids");
    std::vector<LawRow> laws = measure_solid_laws(options.quick);
    options.progress("rods");
    for (LawRow& row : measure_rod_laws(options.quick)) laws.push_back(std::move(row));
    options.progress("rods in tissue");
    for (LawRow& row : measure_wall_laws(options.quick)) laws.push_back(std::move(row));
    std::size_t beyond = 0;
    for (const LawRow& row : laws) {
        const double off = std::abs(row.measured - row.reference);
        const bool holds = off <= row.bound;
        beyond += !holds;
        table.rows.push_back({{"law", row.law},
                              {"setting", row.setting},
                              {"quantity", row.quantity},
                              {"reference", row.reference},
                              {"measured", row.measured},
                              {"off_by", off},
                              {"bound", row.bound},
                              {"holds", holds}});
    }
    table.notes.push_back(std::to_string(laws.size()) + " figures, " + std::to_string(beyond) + " beyond their bound");
    return table;
}

} // namespace trocar::engine
