#include "fem/tissue/material.hpp"

#include <cmath>
#include <string>

namespace trocar::fem {

namespace {

Result<void> check_range(const char* name, double value, bool fine, const char* wanted) {
    if (std::isfinite(value) && fine) return {};
    return Error{.code = ErrorCode::BadValue, .message = std::string(name) + " is " + std::to_string(value) + "; it must be " + wanted};
}

} // namespace

Result<void> check_material(const Material& m) {
    const Result<void> checks[] = {
        check_range("young_modulus", m.young_modulus, m.young_modulus > 0.0, "above 0 Pa"),
        check_range("poisson_ratio", m.poisson_ratio, m.poisson_ratio >= 0.0 && m.poisson_ratio < 0.5, "in [0, 0.5)"),
        check_range("density", m.density, m.density > 0.0, "above 0 kg/m^3"),
        check_range("viscosity", m.viscosity, m.viscosity >= 0.0, "0 Pa s or more"),
        check_range("mass_damping", m.mass_damping, m.mass_damping >= 0.0, "0 per second or more")};
    for (const Result<void>& check : checks)
        if (!check) return check;
    return {};
}

LawConstants make_law_constants(const Material& m) noexcept {
    const double mu = m.young_modulus / (2.0 * (1.0 + m.poisson_ratio));
    const double lambda = m.young_modulus * m.poisson_ratio / ((1.0 + m.poisson_ratio) * (1.0 - 2.0 * m.poisson_ratio));
    if (m.law != MaterialLaw::NeoHookean) return {.mu = mu, .lambda = lambda, .rest_volume = 1.0};
    LawConstants law{.mu = 4.0 / 3.0 * mu, .lambda = lambda + 5.0 / 6.0 * mu};
    law.rest_volume = 1.0 + 0.75 * law.mu / law.lambda; // |I|^2 / (|I|^2 + 1) = 3/4 balances lambda (1 - alpha)
    return law;
}

} // namespace trocar::fem
