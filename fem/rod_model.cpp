#include "fem/rod.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace seldinger::fem {

namespace {

/// Share of the shaped tip at arc length s from the tip: 1 within tip_length, falling to 0 over as much again.
double tip_share(const RodDesign& design, double s) noexcept {
    if (s <= design.tip_length) return 1.0;
    const double t = (s - design.tip_length) / design.tip_length;
    return t < 1.0 ? 1.0 - t * t * (3.0 - 2.0 * t) : 0.0;
}

/// Rest curvature along the first material axis, 1/m. J bends one way; Simmons bends back before its end.
double rest_curvature(const RodDesign& design, double s) noexcept {
    if (s > design.tip_length) return 0.0;
    const double mean = design.tip_angle / design.tip_length;
    switch (design.tip) {
    case TipShape::Straight:
        return 0.0;
    case TipShape::J:
        return mean;
    case TipShape::Simmons:
        return s < 0.35 * design.tip_length ? -mean : 2.2 * mean;
    }
    return 0.0;
}

Error bad_value(const char* what, double value, const char* right) {
    return Error{ErrorCode::BadValue, std::string("rod ") + what + " is " + std::to_string(value) + ": " + right};
}

} // namespace

Result<RodModel> make_rod_model(const RodDesign& design) {
    const struct {
        const char* name;
        double value;
    } positive[] = {{"length", design.length},
                    {"radius", design.radius},
                    {"segment", design.segment},
                    {"density", design.density},
                    {"young_modulus", design.young_modulus},
                    {"tip_length", design.tip_length},
                    {"tip_stiffness", design.tip_stiffness}};
    for (const auto& entry : positive)
        if (!(entry.value > 0.0) || !std::isfinite(entry.value))
            return bad_value(entry.name, entry.value, "it must be positive and finite");
    const double pieces = std::round(design.length / design.segment);
    if (!(pieces >= 4.0 && pieces <= 1e5)) return bad_value("segment", design.segment, "length / segment must lie between 4 and 100000");

    RodModel model;
    model.design = design;
    const auto nodes = static_cast<std::size_t>(pieces) + 1;
    model.segment = design.length / pieces;
    const double area = std::numbers::pi * design.radius * design.radius;
    const double second_moment = 0.25 * area * design.radius * design.radius;
    model.bend_stiffness.assign(nodes, 0.0);
    model.stretch_stiffness.assign(nodes - 1, design.young_modulus * area / model.segment);
    model.mass.assign(nodes, design.density * area * model.segment);
    model.mass.front() *= 0.5;
    model.mass.back() *= 0.5;
    model.rest_curvature.assign(nodes, {0.0, 0.0});
    for (std::size_t i = 1; i + 1 < nodes; ++i) {
        const double from_tip = static_cast<double>(nodes - 1 - i) * model.segment;
        const double share = tip_share(design, from_tip);
        const double modulus = design.young_modulus * (1.0 + share * (design.tip_stiffness - 1.0));
        model.bend_stiffness[i] = modulus * second_moment / (model.segment * model.segment * model.segment);
        model.rest_curvature[i][0] = rest_curvature(design, from_tip);
    }
    return model;
}

} // namespace seldinger::fem
