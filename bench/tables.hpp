// The list of benches: a new table is a function in its own file and a line here.
#pragma once

#include "bench/bench_table.hpp"

#include <array>

namespace trocar::engine {

[[nodiscard]] Result<BenchTable> bench_deadline(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_fem(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_spheretree(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_interruptible(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_contacts(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_chromatic(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_device(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_image_space(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_seed001(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_seed004(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_price(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_effects(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_step(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_growth(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_laws(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_hard_cases(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_fluoroscopy(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_validation(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_literature(const BenchOptions& options);
[[nodiscard]] Result<BenchTable> bench_import(const BenchOptions& options);

inline constexpr std::array kBenches{
    Bench{"deadline", "budgets from 0.1 to 33 ms on the main scene: kept or not, p99, p99.9, worst", bench_deadline},
    Bench{"price", "what accuracy costs: shipped scenes under budgets from nothing to no limit, each against its exact run", bench_price},
    Bench{"effects", "what each effect of a scene costs: the scene beside the scene without it", bench_effects},
    Bench{"step", "where the time of a step goes, part by part: time, hardware counters, bytes and arithmetic against this machine's roofline", bench_step},
    Bench{"growth", "time and memory over 10K to 2M wall triangles, 1K to 500K tetrahedra, 1 to 64 bodies, 1 to 8 instruments: exponents",
          bench_growth},
    Bench{"fem", "element forces, integrators and rigid links on bars of 5K to 500K tets and the liver, beside Bullet", bench_fem},
    Bench{"validation", "the tissue against analytic answers and against beams of SOFA and CalculiX, each with its bound",
          bench_validation},
    Bench{"laws", "laws of contact, each with its reference and bound, at several steps, meshers and budgets", bench_laws},
    Bench{"literature", "the literature's cases of rods and tissue: reference, several resolutions, order of convergence, target met or not",
          bench_literature},
    Bench{"hard-cases", "every hard case with its bound, what is measured, and by how much it holds; --long: ten minutes of simulated time",
          bench_hard_cases},
    Bench{"spheretree", "sphere trees of many meshes by each builder: size, tightness, coverage, time; the descent's rate of tests",
          bench_spheretree},
    Bench{"interruptible", "two dragons, two bunnies, bunny and dragon: the descent interrupted, in four orders, against the truth",
          bench_interruptible},
    Bench{"contacts", "exact contacts of moving meshes, stage by stage, beside FCL, CGAL and Embree; growth to 1M triangles",
          bench_contacts},
    Bench{"chromatic", "set-based culling on cloth, curtains and a catheter: stages, what each leaves, beside an AABB hierarchy",
          bench_chromatic},
    Bench{"seed001", "a walking figure in trousers: k-DOPs, arity, inflation, cones, coherence, each switch's time and loss",
          bench_seed001},
    Bench{"device", "stage II on this machine's OpenGL: from which size on it is faster than the CPU, and 100K triangles at 1024 x 1024",
          bench_device},
    Bench{"fluoroscopy", "X-ray frames of 100K triangles by the CPU projector, at 128, 256 and 512 pixels, beside OpenGL on this machine",
          bench_fluoroscopy},
    Bench{"image-space", "image-space culling of a bunny and two cows: time per pass, share pruned", bench_image_space},
    Bench{"seed004", "cloth on solids, step by step: no duplicates, representative triangles, without and with skipping frame sessions",
          bench_seed004},
    Bench{"import", "users' anatomy to scenes: repairs, surfaces, radii of phantoms, plans and runs of the scenes as they were written", bench_import},
};

} // namespace trocar::engine
