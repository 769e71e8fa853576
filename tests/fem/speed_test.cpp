// Prints the cost of the step loop's kernels; fails only where the median is out of all proportion (100 times the usual).
#include "fem/tissue/integrate.hpp"
#include "fem/embedding/links.hpp"
#include "tests/fem/bodies.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <gtest/gtest.h>

namespace trocar::fem {

using namespace test;

namespace {

struct Times {
    double median, p99, worst;
}; // s

template <class Work>
Times measure(int rounds, Work&& work) {
    std::vector<double> times;
    for (int round = 0; round < rounds; ++round) {
        const auto begin = std::chrono::steady_clock::now();
        work();
        times.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
    }
    std::sort(times.begin(), times.end());
    return {times[times.size() / 2], times[times.size() * 99 / 100], times.back()};
}

void print(const char* what, const Times& t, double count, const char* unit) {
    std::printf("%-44s median %8.1f ns, p99 %8.1f ns, worst %8.1f ns per %s\n", what, t.median / count * 1e9, t.p99 / count * 1e9,
                t.worst / count * 1e9, unit);
}

} // namespace

TEST(Speed, OfForcesStepsAndLinksIsPrinted) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
    GTEST_SKIP() << "times mean nothing under a sanitizer";
#endif
    const TetMesh mesh = make_bar(12, 12, 6, 0.01); // 5184 tets, about a coarse liver
    const double tets = static_cast<double>(mesh.tets.size());
    constexpr const char* kNames[] = {"stvk", "corotational", "neo_hookean"};
    auto force = zeros(mesh.vertices.size()), velocity = force;
    std::mt19937_64 random(1);
    auto position = mesh.vertices;
    for (Vec3& x : position) x += random_vec(random, 5e-4);
    for (Vec3& v : velocity) v = random_vec(random, 0.01);
    for (const MaterialLaw law : kLaws)
        for (const double viscosity : {0.0, 1.0}) {
            Material material = make_material(law, 0.45);
            material.viscosity = viscosity;
            const auto model = make_model(mesh, material);
            const Times t = measure(200, [&] { (void)add_tet_forces(model, position, velocity, force); });
            print((std::string("forces, ") + kNames[static_cast<int>(law)] + (viscosity > 0 ? ", viscous" : "")).c_str(), t, tets, "tet");
            EXPECT_LT(t.median / tets, 5e-6);
        }
    const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean, 0.45));
    TissueState state{position, velocity};
    RkWorkspace workspace;
    print("RK4 sub-step, neo_hookean", measure(100, [&] { (void)integrate_rk4(model, state, 1e-5, 1, {}, workspace); }), tets, "tet");
    print("RK4 frame of 8 sub-steps, neo_hookean", measure(30, [&] { (void)integrate_rk4(model, state, 8e-5, 8, {}, workspace); }),
          8 * tets, "tet and sub-step");
    StableStepWorkspace stable;
    print("stable step, cold",
          measure(5,
                  [&] {
                      stable.warm = false;
                      (void)find_stable_step(model, position, nullptr, stable);
                  }),
          tets, "tet");
    print("stable step, warm", measure(50, [&] { (void)find_stable_step(model, position, nullptr, stable); }), tets, "tet");

    std::vector<Vec3> dense, out;
    for (int i = 0; i < 60000; ++i) dense.push_back(Vec3(0.06, 0.06, 0.03) + random_vec(random, 0.03));
    RigidLinks links;
    print("making embedded links", measure(1, [&] { links = make_embedded_links(mesh, dense, 0.01).value(); }), 60000, "vertex");
    out.resize(dense.size());
    LinkFrames frames;
    print("update embedded surface", measure(100, [&] { (void)update_embedded_surface(links, position, dense, frames, out); }), 60000, "vertex");
}

} // namespace trocar::fem
