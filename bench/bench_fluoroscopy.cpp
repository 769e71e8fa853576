// Frames a second of the C-arm: the CPU projector on one core and on all, beside the OpenGL renderer's X-ray picture of the same surfaces.
#include "assets/anatomy/shapes.hpp"
#include "bench/tables.hpp"
#include "engine/fluoroscopy/detector.hpp"
#include "engine/fluoroscopy/projector.hpp"
#include "engine/render/renderer.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <thread>

namespace trocar::engine {

namespace {

/// An organ with a vessel through it: 100K triangles.
std::vector<TriMesh> xray_anatomy(bool quick) {
    std::vector<TriMesh> bodies;
    bodies.push_back(anatomy::make_icosphere(Vec3::Zero(), 0.085, quick ? 5 : 6));
    const int rings = quick ? 60 : 300;
    std::vector<Vec3> axis;
    std::vector<double> radii;
    for (int k = 0; k <= rings; ++k) {
        const double t = static_cast<double>(k) / rings - 0.5;
        axis.emplace_back(0.05 * std::sin(6.0 * t), 0.02 * t, 0.3 * t);
        radii.push_back(0.006 - 0.004 * t);
    }
    bodies.push_back(anatomy::make_tube(axis, radii, 30));
    return bodies;
}

double median_ms(int rounds, const std::function<void()>& work) {
    std::vector<double> ms;
    for (int k = 0; k < rounds; ++k) {
        const StopWatch watch;
        work();
        ms.push_back(watch.elapsed_ms());
    }
    return median(ms);
}

} // namespace

Result<BenchTable> bench_fluoroscopy(const BenchOptions& options) {
    BenchTable table;
    const std::vector<TriMesh> bodies = xray_anatomy(options.quick);
    std::size_t triangles = 0;
    for (const TriMesh& body : bodies) triangles += body.triangles.size();
    const int rounds = options.quick ? 3 : 41;
    auto renderer = Renderer::make();
    if (!renderer.ok()) table.notes.push_back("OpenGL was not measured: " + renderer.error().to_string());
    std::vector<unsigned> threads{1u};
    if (const unsigned all = std::max(1u, std::thread::hardware_concurrency()); options.threads == 0 && all > 1) threads.push_back(all);
    if (options.threads > 1) threads.push_back(options.threads);
    for (const unsigned pixels : {128u, 256u, 512u}) {
        options.progress(fmt::format("{} x {}", pixels, pixels));
        XrayView view;
        view.pixels = {pixels, pixels};
        const ConeBeam beam = make_cone_beam(view, {0.5, 0.2});
        for (const unsigned count : threads) {
            AttenuationSums sums;
            std::vector<double> attenuation;
            Transmission transmission;
            Console console;
            Projector projector(beam, count);
            const double projected = median_ms(rounds, [&] {
                sums.assign(view.pixel_count(), 0);
                for (const TriMesh& body : bodies) projector.add({body.vertices, body.triangles, 21.8}, sums);
                projector.attenuations(sums, attenuation);
            });
            const double shown = median_ms(rounds, [&] {
                detect(view, attenuation, 0, transmission);
                (void)show(view, transmission, 0.0, console);
            });
            const double least = pixels == 128 ? 100.0 : pixels == 512 ? 25.0 : 0.0;
            BenchRow row{{"what", "CPU projector"}, {"pixels", pixels}, {"triangles", triangles}, {"threads", count}, {"project_ms", projected},
                         {"detect_ms", shown},      {"frames_per_s", 1e3 / (projected + shown)}};
            row["aim_per_s"] = least > 0.0 && count == 1 ? BenchRow(least) : BenchRow();
            table.rows.push_back(std::move(row));
        }
        if (!renderer.ok()) continue;
        RenderScene scene;
        for (const TriMesh& body : bodies) scene.surfaces.push_back({.vertices = body.vertices, .triangles = body.triangles, .attenuation = 21.8});
        std::vector<Vec3> points;
        for (const TriMesh& body : bodies) points.insert(points.end(), body.vertices.begin(), body.vertices.end());
        const Camera camera = frame_camera(points, {.direction = kAnteroPosteriorView, .aspect = 1.0, .orthographic = true});
        bool drawn = true;
        const double ms = median_ms(options.quick ? 2 : 7, [&] {
            drawn = drawn && (*renderer)->fluoroscopy(scene, camera, static_cast<int>(pixels), static_cast<int>(pixels)).ok();
        });
        if (drawn)
            table.rows.push_back({{"what", (*renderer)->context().renderer_name()}, {"pixels", pixels}, {"triangles", triangles}, {"threads", nullptr},
                                  {"project_ms", ms}, {"detect_ms", nullptr}, {"frames_per_s", 1e3 / ms}, {"aim_per_s", nullptr}});
    }
    table.notes.push_back("aims are for one core of a machine without load; the OpenGL rows upload all surfaces and read the picture back, as frames of a run do");
    return table;
}

} // namespace trocar::engine
