#include "fem/tissue/material.hpp"

#include "base/trig.hpp"
#include "fem/tissue/patches.hpp"

#include <cmath>
#include <string>

namespace trocar::fem {

namespace {

Result<void> check_range(const char* name, double value, bool fine, const char* wanted) {
    if (std::isfinite(value) && fine) return {};
    return Error{.code = ErrorCode::BadValue, .message = std::string(name) + " is " + std::to_string(value) + "; it must be " + wanted};
}

Error bad_law(std::string message) { return {.code = ErrorCode::BadValue, .message = std::move(message)}; }

Result<void> check_ogden(const Material& m) {
    const double mu[] = {m.mu1, m.mu2, m.mu3}, alpha[] = {m.alpha1, m.alpha2, m.alpha3};
    int terms = 0;
    for (int k = 0; k < 3; ++k) {
        const std::string number = std::to_string(k + 1);
        if (const auto fine = check_range(("alpha" + number).c_str(), alpha[k], std::abs(alpha[k]) <= 30.0, "from -30 to 30"); !fine)
            return fine;
        const bool both = (mu[k] == 0.0) == (alpha[k] == 0.0) && mu[k] * alpha[k] >= 0.0;
        if (const auto fine = check_range(("mu" + number).c_str(), mu[k], both, ("of the sign of alpha" + number).c_str()); !fine)
            return fine;
        terms += alpha[k] != 0.0;
    }
    if (terms == 0) return bad_law("ogden has no term: it needs mu1 and alpha1");
    return {};
}

Result<void> check_hgo(const Material& m) {
    const Result<void> checks[] = {check_range("k1", m.k1, m.k1 >= 0.0, "0 Pa or more"), check_range("k2", m.k2, m.k2 > 0.0, "above 0"),
                                   check_range("kappa", m.kappa, m.kappa >= 0.0 && m.kappa <= 1.0 / 3.0 + 1e-12, "from 0 to 1/3"),
                                   check_range("fibre_angle", m.fibre_angle, true, "a finite number")};
    for (const Result<void>& check : checks)
        if (!check) return check;
    for (const Vec3* direction : {&m.fibre1, &m.fibre2, &m.fibre_axis, &m.fibre_point})
        if (!is_finite(*direction)) return bad_law("a fibre direction is not finite");
    if (m.fibre_axis.norm() == 0.0 && !(m.fibre1.norm() > 0.0 && m.fibre2.norm() > 0.0))
        return bad_law("fibre1 or fibre2 has no length; each must point somewhere");
    return {};
}

Result<void> check_branches(const Material& m) {
    const double g[] = {m.g1, m.g2, m.g3}, tau[] = {m.tau1, m.tau2, m.tau3};
    for (int k = 0; k < 3; ++k) {
        const std::string number = std::to_string(k + 1);
        if (const auto fine = check_range(("g" + number).c_str(), g[k], g[k] >= 0.0, "0 or more"); !fine) return fine;
        const bool timed = g[k] > 0.0 ? tau[k] > 0.0 : tau[k] >= 0.0;
        if (const auto fine = check_range(("tau" + number).c_str(), tau[k], timed, ("above 0 s where g" + number + " is").c_str()); !fine)
            return fine;
    }
    return {};
}

Result<void> check_law(const Material& m) {
    switch (m.law) {
    case MaterialLaw::MooneyRivlin:
        if (!(std::isfinite(m.c10) && std::isfinite(m.c01) && m.c10 + m.c01 > 0.0 && m.c10 >= 0.0 && m.c01 >= 0.0))
            return bad_law("mooney_rivlin's c10 is " + std::to_string(m.c10) + " and c01 " + std::to_string(m.c01) +
                           "; both must be 0 Pa or more, and one above");
        if (make_law_constants(m).lambda > 0.0) return {};
        return bad_law("mooney_rivlin without c10 leaves no resistance to volume where poisson_ratio is 0; one of them must be above 0");
    case MaterialLaw::Ogden:
        if (const auto fine = check_ogden(m); !fine) return fine;
        if (make_law_constants(m).lambda > 0.0) return {};
        return bad_law("ogden's terms leave no resistance to volume; poisson_ratio must be larger");
    case MaterialLaw::Hgo:
        return check_hgo(m);
    default:
        return {};
    }
}

} // namespace

Result<void> check_material(const Material& m) {
    const Result<void> checks[] = {
        check_range("young_modulus", m.young_modulus, m.young_modulus > 0.0, "above 0 Pa"),
        check_range("poisson_ratio", m.poisson_ratio, m.poisson_ratio >= 0.0 && m.poisson_ratio < 0.5, "in [0, 0.5)"),
        check_range("density", m.density, m.density > 0.0, "above 0 kg/m^3"),
        check_range("viscosity", m.viscosity, m.viscosity >= 0.0, "0 Pa s or more"),
        check_range("mass_damping", m.mass_damping, m.mass_damping >= 0.0, "0 per second or more"),
        check_branches(m),
        check_law(m)};
    for (const Result<void>& check : checks)
        if (!check) return check;
    return {};
}

SmallStrain find_small_strain(const Material& m) noexcept {
    double mu = m.young_modulus / (2.0 * (1.0 + m.poisson_ratio));
    if (m.law == MaterialLaw::MooneyRivlin) mu = 2.0 * (m.c10 + m.c01);
    if (m.law == MaterialLaw::Ogden) mu = 0.5 * (m.mu1 * m.alpha1 + m.mu2 * m.alpha2 + m.mu3 * m.alpha3);
    if (m.law == MaterialLaw::MooneyRivlin || m.law == MaterialLaw::Ogden) // the same lambda below, in other words
        return {mu, 2.0 * mu * m.poisson_ratio / (1.0 - 2.0 * m.poisson_ratio)};
    return {mu, m.young_modulus * m.poisson_ratio / ((1.0 + m.poisson_ratio) * (1.0 - 2.0 * m.poisson_ratio))};
}

FibreAxes find_fibres(const Material& m, const Vec3& place) noexcept {
    const double length = m.fibre_axis.norm();
    Vec3 first = m.fibre1, second = m.fibre2;
    if (length > 0.0) {
        const Vec3 axis = m.fibre_axis / length, out = place - m.fibre_point;
        Vec3 around = axis.cross(out);
        if (!(around.norm() > 1e-12 * (1.0 + out.norm()))) around = axis.unitOrthogonal(); // on the axis itself
        around.normalize();
        const SinCos turn = sin_cos(m.fibre_angle);
        first = turn.cos * around + turn.sin * axis;
        second = turn.cos * around - turn.sin * axis;
    }
    first.normalize();
    second.normalize();
    return {{first[0], first[1], first[2], second[0], second[1], second[2]}};
}

bool uses_patches(const Material& m) noexcept {
    if (m.elements != TetElements::Automatic) return m.elements != TetElements::Linear;
    return m.law != MaterialLaw::StVK && m.poisson_ratio > kPatchedPoissonRatio; // StVK's collapse comes sooner with them
}

namespace {

/// What the rest state pulls with is what the volume pushes with: `pull` Pa per unit of J, so that lambda (1 - a) + pull = 0.
void balance(LawConstants& law, double pull) noexcept { law.rest_volume = 1.0 + pull / law.lambda; }

LawConstants make_ogden(const Material& m, double lambda) noexcept {
    LawConstants law;
    const double mu[] = {m.mu1, m.mu2, m.mu3}, alpha[] = {m.alpha1, m.alpha2, m.alpha3};
    double pull = 0.0;
    for (int k = 0; k < 3; ++k) {
        if (alpha[k] == 0.0) continue;
        const auto term = static_cast<std::size_t>(law.ogden_terms++);
        law.ogden_mu[term] = mu[k];
        law.ogden_alpha[term] = alpha[k];
        pull += mu[k];
    }
    law.lambda = lambda + pull; // of J's second derivative the pull takes its share
    balance(law, pull);
    return law;
}

} // namespace

LawConstants make_law_constants(const Material& m) noexcept {
    const auto [mu, lambda] = find_small_strain(m);
    LawConstants law{.mu = mu, .lambda = lambda};
    if (m.law == MaterialLaw::NeoHookean || m.law == MaterialLaw::Hgo) {
        law.mu = 4.0 / 3.0 * mu;
        law.lambda = lambda + 5.0 / 6.0 * mu;
        balance(law, 0.75 * law.mu); // |I|^2 / (|I|^2 + 1) = 3/4
    } else if (m.law == MaterialLaw::MooneyRivlin) {
        law.lambda = lambda + 2.0 * m.c10; // bulk modulus + 2/3 c10 - 4/3 c01
        balance(law, 2.0 * m.c10 + 4.0 * m.c01);
    } else if (m.law == MaterialLaw::Ogden) {
        law = make_ogden(m, lambda);
    }
    law.c10 = m.c10;
    law.c01 = m.c01;
    law.k1 = m.k1;
    law.k2 = m.k2;
    law.kappa = m.kappa;
    law.fibre_limit = std::sqrt(kMostFibreExponent / m.k2);
    law.patch = kPatchShare * mu;
    law.bend = 4.0 / 3.0 * mu * (lambda + mu) / (lambda + 2.0 * mu);
    return law;
}

} // namespace trocar::fem
