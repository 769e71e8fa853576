// A law of mechanics that a scene must obey, and what a run made of it.
#pragma once

#include <string>
#include <vector>

namespace trocar::engine {

struct LawRow {
    std::string law, quantity;                            // a sentence; what is compared, with its unit
    double reference = 0.0, measured = 0.0, bound = 0.0;  // bound: of |measured - reference|
    std::string setting;                                  // step, mesher, budget
};

/// Contact between solids: impact, momentum, energy, invariance, planes, weight, friction.
/// quick   fewer steps, one mesher
[[nodiscard]] std::vector<LawRow> measure_solid_laws(bool quick);

/// A rod alone with planes: weight, stick, capstan, hysteresis, blocked tip, buckling in a tube, clamp, ringing, balance, inner forces.
[[nodiscard]] std::vector<LawRow> measure_rod_laws(bool quick);

/// A rod in the closed end of a channel in tissue: numerical stiffness, step, mesh.
/// quick   one stiffness
[[nodiscard]] std::vector<LawRow> measure_wall_laws(bool quick);

} // namespace trocar::engine
