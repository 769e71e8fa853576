// A scene as it stands late in its run: instruments laid along their routes.
#include "engine/experiments/laid_out.hpp"
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

std::string following() {
    std::string text = test::bent_tube_scene();
    const std::size_t path = text.find("\"path\""), end = text.find("]]", path) + 2;
    text.replace(path, end - path, R"("inserted": 20, "follow": {"target": "end"})");
    text.replace(text.rfind('}'), 1, R"(, "targets": {"end": {"position": [70, 0, 75]}}})");
    return text;
}

TEST(LaidOut, AnInstrumentWithARouteStandsAtItsEndAndStaysInside) {
    const PreparedScene prepared = test::prepare(following());
    ASSERT_EQ(prepared.model.instruments.size(), 1u);
    ASSERT_TRUE(prepared.model.instruments[0].route.has_value());
    const double length = prepared.model.instruments[0].route->length.back();
    const std::optional<State> inside = lay_along_routes(prepared.model);
    ASSERT_TRUE(inside);
    Simulator simulator(prepared.model);
    ASSERT_TRUE(simulator.restore(*inside).ok());
    EXPECT_NEAR(simulator.state().instruments[0].rod.insertion, length, 1e-12);
    double force = 0.0;
    for (int k = 0; k < 60; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        EXPECT_EQ(report.lumen_exits, 0u) << "step " << report.step;
        force = std::max(force, report.contact_force_n);
    }
    EXPECT_GT(force, 0.0) << "it leans on the bend";
    EXPECT_LT(simulator.report().target_distance_m, 0.02);
}

TEST(LaidOut, WithoutARouteThereIsNothingToLayOut) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene());
    EXPECT_FALSE(lay_along_routes(prepared.model));
}

} // namespace
} // namespace trocar::engine
