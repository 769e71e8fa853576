#include "assets/anatomy/anatomy.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <set>

namespace trocar::anatomy {
namespace {

TEST(Recipe, TheDefaultIsInRange) { EXPECT_TRUE(check_recipe(Recipe{}).ok()); }

TEST(Recipe, TheTableNamesEveryMemberOnce) {
    std::set<std::string_view> names;
    Recipe recipe;
    double value = 3;
    for (const RecipeField& field : recipe_fields()) {
        EXPECT_TRUE(names.insert(field.name).second) << field.name;
        EXPECT_LT(field.least, field.most) << field.name;
        EXPECT_FALSE(field.doc.empty()) << field.name;
        set_recipe_value(recipe, field, ++value);
    }
    value = 3;
    for (const RecipeField& field : recipe_fields()) EXPECT_EQ(recipe_value(recipe, field), ++value) << field.name;
}

TEST(Recipe, AValueOutOfRangeIsNamed) {
    for (const RecipeField& field : recipe_fields()) {
        if (field.name == "seed") continue; // every count is a seed
        for (const double value : {field.most * 2 + 1, std::numeric_limits<double>::quiet_NaN()}) {
            if (field.dimension == RecipeDimension::Count && !(value == value)) continue;
            Recipe recipe;
            set_recipe_value(recipe, field, value);
            const auto checked = check_recipe(recipe);
            ASSERT_FALSE(checked.ok()) << field.name;
            EXPECT_EQ(checked.error().code, ErrorCode::BadValue);
            EXPECT_EQ(checked.error().key, field.name);
        }
    }
}

TEST(Recipe, ARecipeOutOfRangeGeneratesNothing) {
    Recipe recipe;
    recipe.terminals = 1000;
    const auto anatomy = generate(recipe);
    ASSERT_FALSE(anatomy.ok());
    EXPECT_EQ(anatomy.error().key, "terminals");
}

} // namespace
} // namespace trocar::anatomy
