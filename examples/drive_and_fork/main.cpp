// Drives an instrument by hand, then tries two ways from one state: push on, or draw back.
#include <trocar.hpp>

#include <cstdio>
#include <cstdlib>

namespace sim = trocar::engine;

namespace {

/// Steps towards an insertion; the limits of the instrument's drive bound how fast.
bool drive(sim::Simulator& simulator, double insertion, int steps) {
    sim::Inputs inputs;
    inputs.drive.resize(simulator.instrument_count());
    inputs.drive[0] = sim::DriveCommand{.insertion = insertion, .rotation = 0.0};
    for (int k = 0; k < steps; ++k) {
        if (const auto taken = simulator.step(inputs); !taken.ok()) return std::fprintf(stderr, "%s\n", taken.error().to_string().c_str()), false;
        if (!simulator.report().finite) return std::fprintf(stderr, "%s\n", simulator.report().failure.c_str()), false;
    }
    return true;
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return std::fprintf(stderr, "usage: drive_and_fork SCENE [STEPS]\n"), 2;
    const auto scene = sim::read_scene(argv[1]);
    if (!scene.ok()) return std::fprintf(stderr, "%s\n", scene.error().to_string().c_str()), 2;
    const auto prepared = sim::prepare_scene(*scene);
    if (!prepared.ok()) return std::fprintf(stderr, "%s\n", prepared.error().to_string().c_str()), 2;
    const int steps = argc > 2 ? std::atoi(argv[2]) : 50;

    sim::Simulator simulator(*prepared);
    if (simulator.instrument_count() == 0) return std::fprintf(stderr, "%s has no instrument to drive\n", argv[1]), 2;
    if (!drive(simulator, 0.1, steps)) return 3;
    sim::Simulator back = simulator.fork(); // in the same state: both go on to the same bits
    if (!drive(simulator, 0.2, steps) || !drive(back, 0.0, steps)) return 3;
    std::printf("pushed on to %.2f mm, drawn back to %.2f mm; contacts %zu and %zu\n", 1e3 * simulator.report().insertion_m,
                1e3 * back.report().insertion_m, simulator.contacts().size(), back.contacts().size());
    return simulator.report().insertion_m > back.report().insertion_m ? 0 : 1;
}
