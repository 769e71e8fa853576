// Laws of materials against their closed forms, by the engine's own kernels: one function for each, which the tests and the tables share. None
// is part of a step.
#pragma once

#include "fem/tissue/material.hpp"

#include <string>
#include <vector>

namespace trocar::fem {

/// A material of each law, hgo with and without dispersion, ogden with one to three terms.
struct NamedMaterial {
    std::string name;
    Material material;
};
[[nodiscard]] std::vector<NamedMaterial> biaxial_materials();

/// Pa, dpsi/dl_i of principal stretches, from the formulas of the textbooks. hgo: fibres in the plane of the first two, mirrored; fibre1 of length 1.
[[nodiscard]] double principal_stress(const Material& material, const double stretch[3], int i);

/// Plates pulled in two directions, free across: largest difference of the kernels' stress from the closed form, over the sum of both pulls.
[[nodiscard]] double biaxial_error(const Material& material, TetElements elements);

/// Shear that is held: largest difference of its stress over ten seconds from the series, over that, with two branches and steps of `step` s.
[[nodiscard]] double relaxation_error(MaterialLaw law, TetElements elements, double step);
/// A shear stress that is held: largest difference of the shear from the closed form over it, with one branch.
[[nodiscard]] double creep_error(TetElements elements, double step);

} // namespace trocar::fem
