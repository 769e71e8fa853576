// Steps a scene from C++ and prints where the catheter's tip is: cmake --install Trocar, then find_package(Trocar).
#include <trocar.hpp>

#include <cstdio>
#include <cstdlib>

namespace sim = trocar::engine;

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: step_a_scene SCENE [STEPS]\n");
        return 2;
    }
    const auto scene = sim::read_scene(argv[1]);
    if (!scene.ok()) return std::fprintf(stderr, "%s\n", scene.error().to_string().c_str()), 2;
    const auto prepared = sim::prepare_scene(*scene);
    if (!prepared.ok()) return std::fprintf(stderr, "%s\n", prepared.error().to_string().c_str()), 2;

    sim::Simulator simulator(*prepared);
    const int steps = argc > 2 ? std::atoi(argv[2]) : 100;
    for (int k = 0; k < steps; ++k) {
        const sim::StepReport& report = simulator.step();
        if (!report.finite) return std::fprintf(stderr, "stopped: %s\n", report.failure.c_str()), 3;
        if ((k + 1) % 10 == 0)
            std::printf("t %.2f s  tip (%.2f, %.2f, %.2f) mm  %.3f ms  contacts %zu\n", report.time_s, 1e3 * report.tip.x(),
                        1e3 * report.tip.y(), 1e3 * report.tip.z(), report.ms.total, simulator.contacts().size());
    }
    std::printf("state %016llx\n", static_cast<unsigned long long>(simulator.hash()));
}
