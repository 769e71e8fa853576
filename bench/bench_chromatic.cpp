// Set-based culling on the scenes of Govindaraju et al. 2005: what each stage costs and leaves, beside AABB and sphere hierarchies
// and the paper's figures.
#include "bench/chromatic_table.hpp"
#include "bench/compare_device.hpp"
#include "engine/render/gl_cull_backend.hpp"

#include <fmt/format.h>

namespace trocar::engine {

namespace {

using collision::CullMemory;

void compare_methods(ChromaticTable& table, const CullScene& scene, bool all) {
    table.start(scene);
    table.add_volumes("AABB tree, pair by pair", VolumeKind::Box);
    table.add_volumes("sphere tree, pair by pair", VolumeKind::Sphere);
    table.add_hierarchy();
    table.add_sets("sets, I alone", {.method = CullMethod::None});
    table.add_sets("sets, I and II", {.method = CullMethod::Cpu});
    table.add_sets("sets, I and II, fronts", {.method = CullMethod::Cpu, .plan = {.memory = CullMemory::Fronts}});
    table.add_sets("sets, II where it pays", {.method = CullMethod::Auto});
    if (!all) return;
    table.add_sets("sets, I and II, fronts and reversed views",
                   {.method = CullMethod::Cpu, .plan = {.memory = CullMemory::Fronts, .reversed_views = true}});
    table.add_sets("sets, I and II, one round", {.method = CullMethod::Cpu, .plan = {.max_rounds = 1}});
}

/// The paper's queries, each saving of queries by itself and all together.
void compare_coherence(ChromaticTable& table, const CullScene& scene, int resolution) {
    table.start(scene);
    ContextOptions nowhere; // by the CPU: the counts are the same, and the times those of one machine
    nowhere.order.clear();
    const collision::QueryPlan bare{
        .resolution = resolution, .max_rounds = 2, .axis_tests = false, .view_coherence = false, .temporal_order = false};
    const auto add = [&](const char* name, bool axes, bool views, bool order) {
        collision::QueryPlan plan = bare;
        plan.axis_tests = axes;
        plan.view_coherence = views;
        plan.temporal_order = order;
        table.add_sets(name, {.method = CullMethod::Query, .queries = plan, .contexts = nowhere});
    };
    add("queries, no coherence", false, false, false);
    add("queries, 1D tests", true, false, false);
    add("queries, view coherence", false, true, false);
    add("queries, view coherence and temporal order", false, true, true);
    add("queries, all", true, true, true);
}

} // namespace

Result<BenchTable> bench_chromatic(const BenchOptions& options) {
    BenchTable result;
    ChromaticTable table(result, options);
    const auto gl = GlCullBackend::make();
    const bool hardware = gl.ok() && !(*gl)->is_software();
    result.notes.push_back(gl.ok() ? fmt::format("OpenGL: {}", (*gl)->name()) : "no OpenGL: " + gl.error().message);
    if (gl.ok() && !hardware)
        result.notes.push_back("OpenGL is drawn by software here: its rows are for the answers, and on the smallest scenes alone; "
                               "a graphics card was not measured");
    const std::size_t steps = options.quick ? 1 : 5;

    CullScene skirt = options.quick ? make_cloth_scene("skirt 3K", 40, 40, steps) : make_cloth_scene("skirt 13K", 81, 80, steps);
    skirt.paper_ms = "400-500";
    compare_methods(table, skirt, true);
    const CullScene small = make_cloth_scene("cloth 2K", 33, 32, options.quick ? 2 : 5);
    compare_coherence(table, small, 128);
    if (gl.ok()) {
        compare_with_device(table, result, **gl, options.quick ? 1 : 2);
        table.start(hardware ? skirt : small);
        table.add_sets("queries by OpenGL, all",
                       {.method = CullMethod::Query, .queries = {.resolution = hardware ? 0 : 128, .max_rounds = 2}});
    }
    table.start(skirt);
    for (const Index parts : {1u, 2u, 4u}) table.add_parts(parts);
    if (!options.quick) {
        for (const std::size_t side : {40, 57, 127}) { // with those before and after: shares by model size, the paper's figure 9a
            const CullScene cloth =
                make_cloth_scene(fmt::format("cloth {:.0f}K", 2e-3 * static_cast<double>(side * side)), side, side, steps);
            table.start(cloth);
            table.add_sets("sets, I and II", {.method = CullMethod::Cpu});
        }
        CullScene cloth = make_cloth_scene("cloth 23K", 107, 107, steps);
        cloth.paper_ms = "400-550";
        cloth.paper_sets = "19";
        compare_methods(table, cloth, false);
        CullScene curtains = make_curtains_scene(127, 128, steps);
        curtains.paper_ms = "2 x 100";
        curtains.paper_sets = "10";
        compare_methods(table, curtains, false);
        curtains.within = false;
        curtains.between = true;
        curtains.paper_ms = curtains.paper_sets = "";
        compare_methods(table, curtains, false); // cloth against an object: the paper has self-contact cost 3 to 5 times as much
        compare_methods(table, make_catheter_scene(steps), true);
        compare_methods(table, make_catheter_alone_scene(steps), false);
    }
    result.notes.push_back(
        "paper, quoted: cloth of 12,296 triangles: 6,442 left after I, 524 after II, 65K elementary tests without II and 2,737 with "
        "it; I 40-50 % of the time, II 35-45 %, tests below 10 %; 5 times faster than AABB trees without II, 15-20 times "
        "with it; self-contact 3 to 5 times cloth against object; 100-150 ms at 10 sets, 300-550 at 20");
    result.notes.push_back("sets, I and II: stage II in every step, by the CPU reference; sets, II where it pays: where it is predicted to pay, in so "
                           "many of the steps as steps_with_II says");
    result.notes.push_back("tests are exact verdicts, where the paper's are interval arithmetic; trees tested pair by pair count a pair of "
                           "features as often as pairs of triangles hold it, as those that the paper compares with");
    return result;
}

} // namespace trocar::engine
