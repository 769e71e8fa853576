#include "fem/rod/closed_forms.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

namespace trocar::fem {

namespace {

using Shape = std::array<double, 4>; // theta, theta', along, across

Shape ahead(const Shape& s, const Shape& rate, double h) {
    Shape out = s;
    for (std::size_t k = 0; k < out.size(); ++k) out[k] += h * rate[k];
    return out;
}

/// From the clamp to the end; it stops where the moment changes its sign: solutions with more waves are not wanted.
/// load(s)   across, beyond s
template <class Load>
Shape shoot(const Load& load, double slope) {
    constexpr int kSteps = 400;
    constexpr double h = 1.0 / kSteps;
    const auto rate = [&](const Shape& y, double s) { return Shape{y[1], -load(s) * std::cos(y[0]), std::cos(y[0]), std::sin(y[0])}; };
    Shape y{0.0, slope, 0.0, 0.0};
    for (int i = 0; i < kSteps; ++i) {
        const double s = i * h;
        const Shape k1 = rate(y, s), k2 = rate(ahead(y, k1, 0.5 * h), s + 0.5 * h), k3 = rate(ahead(y, k2, 0.5 * h), s + 0.5 * h),
                    k4 = rate(ahead(y, k3, h), s + h);
        for (std::size_t k = 0; k < y.size(); ++k) y[k] += h / 6.0 * (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k]);
        if (y[1] < -1e-9) break;
    }
    return y;
}

/// The slope at the clamp for which the end has no moment.
template <class Load>
ElasticaTip find_elastica(const Load& load, double most) {
    double low = 0.0, high = most;
    for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (shoot(load, middle)[1] > 0.0 ? high : low) = middle;
    }
    const Shape y = shoot(load, 0.5 * (low + high));
    return {y[2], y[3]};
}

/// rad, of the handle that holds a tip whose end stands at an angle; lengths over that from the handle to the tip's middle.
double handle_of(double end, double beta, double share) {
    constexpr int kSteps = 100;
    const double h = share / kSteps, pull = beta / share;
    double angle = end, slope = 0.0; // towards the handle
    const auto bend = [pull](double phi) { return pull * std::sin(phi); };
    for (int i = 0; i < kSteps; ++i) {
        const double a = bend(angle), b = bend(angle + 0.5 * h * slope), c = bend(angle + 0.5 * h * (slope + 0.5 * h * a)), d = bend(angle + h * (slope + 0.5 * h * b));
        angle += h * (slope + h / 6.0 * (a + b + c));
        slope += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
    }
    return angle + (1.0 - 0.5 * share) * slope;
}

} // namespace

TurnedTip turned_tip(double beta, double share) {
    TurnedTip tip;
    const double root = std::sqrt(beta / share), turn = root * share;
    tip.slope = std::cosh(0.5 * turn) / (std::cosh(turn) + (1.0 - 0.5 * share) * root * std::sinh(turn));
    tip.snap = std::numeric_limits<double>::infinity();
    constexpr int kParts = 2000;
    constexpr double kPart = std::numbers::pi / kParts;
    double before = 0.0, last = 0.0;
    for (int k = 1; k <= kParts; ++k) {
        const double next = handle_of(k * kPart, beta, share);
        if (k > 1 && next < last) { // the top of a parabola through three
            const double rise = next - before, bow = before - 2.0 * last + next;
            tip.snap = last - 0.125 * rise * rise / bow;
            break;
        }
        before = last, last = next;
    }
    return tip;
}

ElasticaTip loaded_elastica(double load) {
    return find_elastica([load](double) { return load; }, std::min(load, std::sqrt(2.0 * load)));
}

ElasticaTip heavy_elastica(double weight) {
    return find_elastica([weight](double s) { return weight * (1.0 - s); }, 0.5 * weight);
}

double HelicalBuckling::spread() const { return 1.0 - 0.25 * moment * moment / tension; }

double HelicalBuckling::envelope(double s) const {
    const double sech = 1.0 / std::cosh(std::sqrt(tension * spread()) * s);
    return sech * sech;
}

HelicalBuckling helical_buckling(double slack, double turn, double ratio) {
    // slack^2 = 16 / t (1 - m^2 / 4t) gives t for any m, the larger root; turn = m / ratio + 4 acos(m / (2 sqrt(t))) grows with m.
    const auto with_moment = [&](double m) {
        const double half = 8.0 / (slack * slack);
        return HelicalBuckling{m, half + std::sqrt(std::max(0.0, half * half - 4.0 * m * m / (slack * slack)))};
    };
    const auto turn_of = [&](const HelicalBuckling& h) { return h.moment / ratio + 4.0 * std::acos(0.5 * h.moment / std::sqrt(h.tension)); };
    const auto slack_root = [&](double m) { // of the two tensions the one whose spread is small: the localised state near the straight rod
        HelicalBuckling h = with_moment(m);
        h.tension = 4.0 * m * m / (slack * slack) / h.tension;
        return h;
    };
    double low = 0.0, high = 4.0 / slack;
    for (int i = 0; i < 200; ++i) {
        const double middle = 0.5 * (low + high);
        (turn_of(slack_root(middle)) > turn ? high : low) = middle;
    }
    return slack_root(0.5 * (low + high));
}

double whirling_tip(double speed, double damping) {
    // y'''' = b^4 y, y(0) = y'(0) = 0, y''(1) = 1, y'''(1) = 0, and at rest y(1) = 1/2. b^4 = speed^2 - i speed damping.
    const std::complex<double> b = std::pow(std::complex<double>(speed * speed, -speed * damping), 0.25);
    const auto plus = std::cosh(b) + std::cos(b), minus = std::cosh(b) - std::cos(b);
    const auto odd_plus = std::sinh(b) + std::sin(b), odd_minus = std::sinh(b) - std::sin(b);
    const auto second = -odd_minus / plus;
    const auto first = 1.0 / (b * b * (plus + second * odd_plus));
    return 2.0 * std::abs(first * (minus + second * odd_minus));
}

} // namespace trocar::fem
