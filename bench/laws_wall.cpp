// Laws of contact between a rod and the tissue that it presses into: one force and one place, whatever the numbers that only the solver knows.
#include "bench/closed_end.hpp"
#include "bench/law_row.hpp"

#include <fmt/format.h>

namespace trocar::engine {

std::vector<LawRow> measure_wall_laws(bool quick) {
    std::vector<LawRow> rows;
    const auto add = [&](const char* law, const std::string& setting, const Held& held, const Held& reference, double bound) {
        rows.push_back({law, "held force over the reference's", 1.0, held.mean / reference.mean, bound, setting});
        rows.push_back({law, "um, the tip off the reference's place", 0.0, 1e6 * (held.tip - reference.tip), 1e6 * bound * 3e-3, setting});
    };
    const Held reference = hold({});
    for (const double stiffness : quick ? std::vector<double>{2.0} : std::vector<double>{0.2, 2.0, 200.0})
        add("a closed end: wall_stiffness changes nothing", fmt::format("{:g} N/mm against 20", stiffness), hold({.wall_stiffness = stiffness}), reference, 0.05);
    if (quick) return rows;
    for (const double step : {5e-3, 2e-3}) {
        const Held held = hold({.step = step});
        add("a closed end: the step's length changes nothing", fmt::format("{:g} ms against 10", 1e3 * step), held, reference, 0.05);
        rows.push_back({"a closed end: no spike on the way there", "highest over what is held", 1.0, held.highest / held.mean, 0.5, fmt::format("{:g} ms", 1e3 * step)});
    }
    const Held fine = hold({.surface_triangles = 4000});
    add("a closed end: finer meshes agree", "2,000 triangles against 4,000", hold({.surface_triangles = 2000}), fine, 0.05);
    return rows;
}

} // namespace trocar::engine
