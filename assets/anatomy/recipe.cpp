#include "assets/anatomy/recipe.hpp"

#include <array>
#include <cmath>

namespace trocar::anatomy {
namespace {

using D = RecipeDimension;

const std::array kFields = {
    RecipeField{"seed", &Recipe::seed, D::Count, 0, 4294967295.0, "another number is another patient"},
    RecipeField{"liver_width", &Recipe::liver_width, D::Length, 0.15, 0.26, "right to left, of the average shape"},
    RecipeField{"liver_depth", &Recipe::liver_depth, D::Length, 0.11, 0.20, "back to front, of the average shape"},
    RecipeField{"liver_height", &Recipe::liver_height, D::Length, 0.11, 0.20, "lower margin to dome, of the average shape"},
    RecipeField{"variation", &Recipe::variation, D::Ratio, 0, 1.5, "how far a seed departs from the average patient"},
    RecipeField{"liver_triangles", &Recipe::liver_triangles, D::Count, 2000, 200000, "of the liver's surface, about"},
    RecipeField{"lumen_triangles", &Recipe::lumen_triangles, D::Count, 40000, 400000, "of the arteries' surface, about"},
    RecipeField{"terminals", &Recipe::terminals, D::Count, 4, 24, "ends of the arterial tree inside the liver"},
    RecipeField{"terminal_radius", &Recipe::terminal_radius, D::Length, 0.001, 0.0015, "of the thinnest vessels"},
    RecipeField{"murray_exponent", &Recipe::murray_exponent, D::Ratio, 2.3, 3.2, "r_parent^e = sum r_child^e at forks"},
    RecipeField{"tumour_flow", &Recipe::tumour_flow, D::Ratio, 1, 4, "of the tumour's feeder, over a terminal's"},
    RecipeField{"aorta_radius", &Recipe::aorta_radius, D::Length, 0.008, 0.0115, "at the coeliac trunk"},
    RecipeField{"coeliac_angle", &Recipe::coeliac_angle, D::Angle, 0.9, 1.3, "from the aorta's cranial direction"},
    RecipeField{"capsule_margin", &Recipe::capsule_margin, D::Length, 0.003, 0.008,
                "least tissue between an intrahepatic vessel and the surface"},
};

} // namespace

std::span<const RecipeField> recipe_fields() noexcept { return kFields; }

double recipe_value(const Recipe& recipe, const RecipeField& field) noexcept {
    return std::visit([&](auto member) { return static_cast<double>(recipe.*member); }, field.member);
}

void set_recipe_value(Recipe& recipe, const RecipeField& field, double value) noexcept {
    if (const auto* count = std::get_if<std::uint32_t Recipe::*>(&field.member)) {
        const bool fits = value >= 0 && value <= 4294967295.0;
        recipe.** count = fits ? static_cast<std::uint32_t>(std::llround(value)) : 0;
    } else {
        recipe.*std::get<double Recipe::*>(field.member) = value;
    }
}

Result<void> check_recipe(const Recipe& recipe) {
    for (const RecipeField& field : kFields) {
        const double value = recipe_value(recipe, field);
        if (value >= field.least && value <= field.most) continue; // NaN fails both
        Error error{ErrorCode::BadValue, std::to_string(value) + " is outside " + std::to_string(field.least) + " .. " +
                                             std::to_string(field.most) + " (SI units): " + std::string(field.doc)};
        error.key = field.name;
        return error;
    }
    return {};
}

} // namespace trocar::anatomy
