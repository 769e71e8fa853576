// What generated anatomy is made from: a patient from named numbers with ranges, one table for readers, schemas and checks; a vessel
// tree from its branches.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"

#include <cstdint>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

namespace trocar::anatomy {

/// Lengths in m. The defaults are the demo's patient; a seed alone gives another one.
struct Recipe {
    std::uint32_t seed = 1;                // liver shape, course of the vessels, hepatic tree
    double liver_width = 0.200;            // m, right to left
    double liver_depth = 0.150;            // m, back to front
    double liver_height = 0.140;           // m, lower margin to dome
    double variation = 1.0;                // [-] how far a seed may depart from the average patient
    std::uint32_t liver_triangles = 23000; // aimed at, met within a few per cent
    std::uint32_t lumen_triangles = 60000; // aimed at, met within a few per cent
    std::uint32_t terminals = 16;          // ends of the intrahepatic tree
    double terminal_radius = 0.00125;      // m, of every end but the tumour's feeder
    double murray_exponent = 3.0;          // r_parent^e = sum r_child^e at every intrahepatic fork
    double tumour_flow = 2.5;              // [-] flow of the tumour's feeder over a terminal's
    double aorta_radius = 0.0095;          // m, at the coeliac trunk
    double coeliac_angle = 1.13;           // rad, from the aorta's cranial direction to the coeliac trunk
    double capsule_margin = 0.004;         // m, least tissue between an intrahepatic vessel's wall and the liver's surface
};

/// What a recipe's number measures: readers convert it once.
enum class RecipeDimension : std::uint8_t { Count, Ratio, Length, Angle };

struct RecipeField {
    std::string_view name;
    std::variant<std::uint32_t Recipe::*, double Recipe::*> member;
    RecipeDimension dimension;
    double least, most; // inclusive, SI
    std::string_view doc;
};

/// Every member of Recipe once, in its order.
[[nodiscard]] std::span<const RecipeField> recipe_fields() noexcept;

[[nodiscard]] double recipe_value(const Recipe& recipe, const RecipeField& field) noexcept;

/// value  SI; counts are rounded to the nearest integer. No range check.
void set_recipe_value(Recipe& recipe, const RecipeField& field, double value) noexcept;

/// BadValue with the field's name in `key` for the first number that is not finite or out of range.
[[nodiscard]] Result<void> check_recipe(const Recipe& recipe);

/// Of a vessel tree (vessels.hpp makes its surface).
struct VesselBranch {
    std::vector<Vec3> axis;    // m, way points of a natural spline, at least 2
    std::vector<double> radii; // m, [axis], linear between them along the arc
};

} // namespace trocar::anatomy
