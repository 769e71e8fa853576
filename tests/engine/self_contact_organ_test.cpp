// A real organ that touches itself: places that the same nodes of its coarse mesh move, which no impulse takes apart.
#include "step_fixture.hpp"

#include <cstdlib>
#include <filesystem>

namespace trocar::engine {
namespace {

TEST(SelfContactOfAnOrgan, HeldAtOneEndItHangsAndDoesNotBurst) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr || !std::filesystem::is_directory(std::filesystem::path(data) / "organs"))
        GTEST_SKIP() << "TROCAR_TEST_DATA names no folder with organs/";
    const PreparedScene prepared = test::prepare(R"({
    "name": "spleen", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 2}, "budget": "exact", "gravity": [0, 0, -9810],
    "bodies": {"spleen": {"kind": "deformable",
        "surface": {"file": "${TROCAR_TEST_DATA}/organs/hra_vhm_spleen_17k.obj.gz", "unit": "m", "repair": ["weld", "drop_degenerate"]},
        "material": {"law": "neo_hookean", "young_modulus": 5, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.01, "mass_damping": 0},
        "translate": [-81.1, -370.1, 85.8], "fixed": [{"box": [[30, -500, -500], [500, 500, 500]]}]}},
    "effects": ["elasticity", "gravity", "damping", "coarse_contact", "self_contact"]
})");
    Simulator simulator(prepared.model);
    std::uint64_t touches = 0;
    for (int step = 0; step < 25; ++step) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << "step " << step << ": " << report.failure;
        EXPECT_GT(report.min_volume_ratio, 0.2) << "step " << step;
        touches += report.solid_touches;
    }
    EXPECT_GT(touches, 0u) << "it touches itself";
}

} // namespace
} // namespace trocar::engine
