#include "fem/rod/rod_model.hpp"

#include "base/trig.hpp"
#include "fem/rod/tip_arcs.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <span>
#include <string>

namespace trocar::fem {

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
    case TipShape::Pigtail:
        return mean;
    case TipShape::Curve:
        break; // node by node: curve_curvature
    }
    return 0.0;
}

/// A pigtail's loops lie beside one another: it rises by kLoopRise radii in a turn.
constexpr double kLoopRise = 2.5;

/// A helix in the frame of its root. Of a polygon: second differences of a curve that turns by x a node are 2 sin(x / 2).
std::array<double, 2> pigtail_curvature(const RodDesign& design, double segment, double s) noexcept {
    const double mean = design.tip_angle / design.tip_length;
    const double rise = kLoopRise * design.radius / (2.0 * std::numbers::pi);  // m/rad
    const SinCos turn = sin_cos(mean * mean * rise * (design.tip_length - s)); // torsion of a helix that is nearly flat
    const double polygon = 2.0 / segment * sin_cos(0.5 * mean * segment).sin;
    return {polygon * turn.cos, polygon * turn.sin};
}

/// Of what a node stands for, half a segment to either side: the turn of the arcs there, as corner of the polygon.
std::array<double, 2> curve_curvature(const RodDesign& design, double segment, double from_tip) noexcept {
    const std::array<double, 2> turn = turn_of_arcs(design.arcs, design.tip_length - from_tip - 0.5 * segment, design.tip_length - from_tip + 0.5 * segment);
    const double angle = size_of(turn);
    if (angle == 0.0) return {0.0, 0.0};
    const double curvature = 2.0 / segment * sin_cos(0.5 * angle).sin;
    return {curvature * turn[0] / angle, curvature * turn[1] / angle};
}

/// Largest turn of a curve at a node, rad.
double sharpest_turn(const RodDesign& design, double segment) noexcept {
    double sharpest = 0.0;
    for (double s = design.tip_length - segment; s > -segment; s -= segment) {
        const std::array<double, 2> turn = turn_of_arcs(design.arcs, s - 0.5 * segment, s + 0.5 * segment);
        sharpest = std::max(sharpest, size_of(turn));
    }
    return sharpest;
}

double profile_at(std::span<const ProfileRow> rows, double from_tip) noexcept {
    std::size_t k = 0;
    while (k < rows.size() && rows[k].from_tip < from_tip) ++k;
    if (k == 0) return rows.front().factor;
    if (k == rows.size()) return rows.back().factor;
    const double t = (from_tip - rows[k - 1].from_tip) / (rows[k].from_tip - rows[k - 1].from_tip);
    return rows[k - 1].factor + t * (rows[k].factor - rows[k - 1].factor);
}

double factor_at(const RodDesign& design, double from_tip) noexcept {
    if (!design.stiffness.empty()) return profile_at(design.stiffness, from_tip);
    return 1.0 + tip_share(design, from_tip) * (design.tip_stiffness - 1.0);
}

Error bad_value(const char* what, double value, const char* right) {
    return Error{ErrorCode::BadValue, std::string("rod ") + what + " is " + std::to_string(value) + ": " + right};
}

std::optional<Error> check_profile(std::span<const ProfileRow> rows, const std::string& name) {
    for (std::size_t k = 0; k < rows.size(); ++k) {
        if (!(rows[k].factor > 0.0) || !std::isfinite(rows[k].factor))
            return bad_value((name + " factor").c_str(), rows[k].factor, "it must be positive and finite");
        if (!(rows[k].from_tip >= 0.0) || (k > 0 && !(rows[k].from_tip > rows[k - 1].from_tip)))
            return bad_value((name + " row at").c_str(), rows[k].from_tip, "lengths from the tip must be 0 or more and ascend");
    }
    return std::nullopt;
}

std::optional<Error> check_arcs(const RodDesign& design) {
    double length = 0.0;
    for (const TipArc& arc : design.arcs) {
        if (!(arc.length > 0.0) || !std::isfinite(arc.length)) return bad_value("arc length", arc.length, "it must be positive and finite");
        if (!std::isfinite(arc.angle) || !std::isfinite(arc.plane)) return bad_value("arc angle", arc.angle, "angles must be finite");
        length += arc.length;
    }
    if (std::abs(length - design.tip_length) <= 1e-9 * length && design.tip_length <= design.length) return std::nullopt;
    return bad_value("tip_length", design.tip_length, "it must be the sum of the arcs' lengths, and at most the rod's");
}

std::optional<Error> check_design(const RodDesign& design) {
    const struct {
        const char* name;
        double value;
    } positive[] = {{"length", design.length},
                    {"radius", design.radius},
                    {"segment", design.segment},
                    {"density", design.density},
                    {"young_modulus", design.young_modulus},
                    {"stretch_factor", design.stretch_factor},
                    {"turn_factor", design.turn_factor},
                    {"tip_length", design.tip_length},
                    {"tip_stiffness", design.tip_stiffness}};
    for (const auto& entry : positive)
        if (!(entry.value > 0.0) || !std::isfinite(entry.value))
            return bad_value(entry.name, entry.value, "it must be positive and finite");
    const double pieces = std::round(design.length / design.segment);
    if (!(pieces >= 4.0 && pieces <= 1e5)) return bad_value("segment", design.segment, "length / segment must lie between 4 and 100000");
    if (design.torsion && !(design.poisson_ratio > -1.0 && design.poisson_ratio <= 0.5))
        return bad_value("poisson_ratio", design.poisson_ratio, "it must lie above -1 and be at most 0.5");
    if (auto error = check_profile(design.stiffness, "stiffness")) return error;
    if (auto error = check_profile(design.coating, "coating")) return error;
    if (design.tip == TipShape::Curve)
        if (auto error = check_arcs(design)) return error;
    const double turn = sharpest_node(design);
    if (!(turn <= kSharpestNode * (1.0 + 1e-9)))
        return bad_value("segment", design.segment, ("the tip turns by " + std::to_string(turn) + " rad at a node; expected at most 0.8").c_str());
    return std::nullopt;
}

/// Per segment, at its middle; GJ of a circular section is 4 G / E times half its EI.
void add_torsion(RodModel& model) {
    const RodDesign& design = model.design;
    const std::size_t nodes = model.node_count();
    const double area = std::numbers::pi * design.radius * design.radius;
    const double polar_moment = 0.5 * area * design.radius * design.radius;
    const double shear_modulus = design.young_modulus / (2.0 + 2.0 * design.poisson_ratio);
    for (std::size_t i = 0; i + 1 < nodes; ++i) {
        const double from_tip = (static_cast<double>(nodes - 1 - i) - 0.5) * model.segment;
        model.twist_stiffness.push_back(shear_modulus * factor_at(design, from_tip) * polar_moment / model.segment);
    }
    for (std::size_t i = 0; i < nodes; ++i)
        model.turn_inertia.push_back(model.mass[i] * 0.5 * design.radius * design.radius * design.turn_factor); // of a disc about its axis
}

} // namespace

double sharpest_node(const RodDesign& design) noexcept {
    const double segment = design.length / std::round(design.length / design.segment);
    if (design.tip == TipShape::Curve) return sharpest_turn(design, segment);
    return design.tip == TipShape::Pigtail ? design.tip_angle * segment / design.tip_length : 0.0;
}

Result<RodModel> make_rod_model(const RodDesign& design) {
    if (const auto error = check_design(design)) return *error;
    const double pieces = std::round(design.length / design.segment);
    RodModel model;
    model.design = design;
    const auto nodes = static_cast<std::size_t>(pieces) + 1;
    model.segment = design.length / pieces;
    const double area = std::numbers::pi * design.radius * design.radius;
    const double second_moment = 0.25 * area * design.radius * design.radius;
    model.bend_stiffness.assign(nodes, 0.0);
    model.stretch_stiffness.assign(nodes - 1, design.stretch_factor * design.young_modulus * area / model.segment);
    if (!design.stiffness.empty())
        for (std::size_t i = 0; i + 1 < nodes; ++i)
            model.stretch_stiffness[i] *= factor_at(design, (static_cast<double>(nodes - 1 - i) - 0.5) * model.segment);
    model.mass.assign(nodes, design.density * area * model.segment);
    model.mass.front() *= 0.5;
    model.mass.back() *= 0.5;
    model.rest_curvature.assign(nodes, {0.0, 0.0});
    for (std::size_t i = 1; i + 1 < nodes; ++i) {
        const double from_tip = static_cast<double>(nodes - 1 - i) * model.segment;
        const double modulus = design.young_modulus * factor_at(design, from_tip);
        model.bend_stiffness[i] = modulus * second_moment / (model.segment * model.segment * model.segment);
        model.rest_curvature[i][0] = rest_curvature(design, from_tip);
        if (design.tip == TipShape::Pigtail && from_tip <= design.tip_length)
            model.rest_curvature[i] = pigtail_curvature(design, model.segment, from_tip);
        if (design.tip == TipShape::Curve) model.rest_curvature[i] = curve_curvature(design, model.segment, from_tip);
    }
    if (!design.coating.empty())
        for (std::size_t i = 0; i < nodes; ++i)
            model.friction_share.push_back(profile_at(design.coating, static_cast<double>(nodes - 1 - i) * model.segment));
    if (design.torsion) add_torsion(model);
    return model;
}

} // namespace trocar::fem
