#include "fem/tissue/tangent.hpp"

#include "fem/tissue/fibred_laws.hpp"
#include "fem/tissue/laws.hpp"

namespace trocar::fem {

namespace {

double find_density(const Material& m, const LawConstants& c, const FibreAxes& fibres, const Block<double>& f) noexcept {
    const double det = determinant(f);
    switch (m.law) {
    case MaterialLaw::StVK:
        return StVKLaw::energy(c, f, det);
    case MaterialLaw::Corotational:
        return CorotationalLaw::energy(c, f, det);
    case MaterialLaw::NeoHookean:
        return NeoHookeanLaw::energy(c, f, det);
    case MaterialLaw::MooneyRivlin:
        return MooneyRivlinLaw::energy(c, f, det, &fibres);
    case MaterialLaw::Ogden:
        return OgdenLaw::energy(c, f, det, &fibres);
    case MaterialLaw::Hgo:
        break;
    }
    return HgoLaw::energy(c, f, det, &fibres);
}

/// The least of a function with one valley: golden section, whose error in the value is that of the place squared.
template <class F>
double find_least(F&& f) noexcept {
    constexpr double kShare = 0.6180339887498949;
    double low = 0.05, high = 3.0, a = high - kShare * (high - low), b = low + kShare * (high - low), fa = f(a), fb = f(b);
    for (int round = 0; round < 45; ++round) {
        if (fa < fb) {
            high = b, b = a, fb = fa;
            a = high - kShare * (high - low), fa = f(a);
        } else {
            low = a, a = b, fa = fb;
            b = low + kShare * (high - low), fb = f(b);
        }
    }
    return fa < fb ? fa : fb;
}

} // namespace

double find_energy(const Material& m, const Mat3& deformation, const Vec3& place) noexcept {
    Block<double> block;
    for (int i = 0; i < 9; ++i) block.m[i] = deformation(i / 3, i % 3);
    return find_density(m, make_law_constants(m), find_fibres(m, place), block);
}

double find_pull_tangent(const Material& m, double stretch) noexcept {
    const LawConstants c = make_law_constants(m);
    const FibreAxes fibres = find_fibres(m, m.fibre_point + Vec3(1.0, 0.5, 0.25));
    const Vec3 along(fibres.axis[0], fibres.axis[1], fibres.axis[2]);
    Vec3 across(fibres.axis[3], fibres.axis[4], fibres.axis[5]);
    across -= across.dot(along) * along;
    across = across.norm() > 1e-6 ? Vec3(across.normalized()) : Vec3(along.unitOrthogonal());
    const Vec3 third = along.cross(across);
    const auto energy = [&](double l) {
        return find_least([&](double t) {
            return find_least([&](double w) {
                const Mat3 f = l * along * along.transpose() + t * across * across.transpose() + w * third * third.transpose();
                Block<double> block;
                for (int i = 0; i < 9; ++i) block.m[i] = f(i / 3, i % 3);
                return find_density(m, c, fibres, block);
            });
        });
    };
    constexpr double kStep = 1e-3;
    return (energy(stretch + kStep) - 2.0 * energy(stretch) + energy(stretch - kStep)) / (kStep * kStep);
}

} // namespace trocar::fem
