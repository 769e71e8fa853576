#include "collision/search/contact_search.hpp"
#include "engine/experiments/contact_record.hpp"
#include "engine/experiments/plan_files.hpp"
#include "engine/experiments/plan_scene.hpp"
#include "fem/tissue/kernels.hpp"
#include "python/binding/arrays.hpp"
#include "python/binding/bindings.hpp"
#include "python/binding/errors.hpp"
#include "python/binding/long_call.hpp"
#include "python/binding/loaded_scene.hpp"
#include "spheretree/lumen/lumen_path.hpp"

#include <pybind11/stl.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <memory>

namespace trocar::python {

namespace {

/// At a distance, pairs up to this part of it farther apart may be reported as well.
constexpr double kDistanceTolerance = 1e-9;

struct Planned {
    engine::RouteReport route;
    engine::Route way;
    engine::Plan plan;
    engine::Replay replay;
};

Planned plan_scene(const SceneSource& source, const std::string& target, double time_limit, const StopCheck& check_stop) {
    engine::Scene scene = value_of(read_source(source));
    check(engine::aim_to_plan(scene, target));
    const engine::PreparedScene prepared = value_of(engine::make_prepared_scene(scene, [&](const std::string&) { check_stop(); }));
    const engine::InstrumentModel& instrument = prepared.model.instruments[engine::kLeadInstrument];
    Planned planned{engine::inspect_route(*instrument.route, instrument.rod.design.radius), *instrument.route, {}, {}};
    check(engine::check_bends(scene, planned.route, target));
    const auto go_on = [&](double) {
        check_stop();
        return false;
    };
    planned.plan = engine::find_motion(prepared.model, time_limit > 0.0 ? time_limit : engine::usual_trial_time(planned.route, instrument), go_on);
    if (planned.plan.arrived) {
        const engine::PlanRecord record{scene, prepared, target, planned.route, planned.plan, {}};
        planned.replay = engine::replay_path(prepared.model, engine::rows_as_written(record), go_on);
    }
    return planned;
}

py::array_t<double> table(std::size_t rows, py::ssize_t columns, const std::function<double(std::size_t, py::ssize_t)>& at) {
    py::array_t<double> out({static_cast<py::ssize_t>(rows), columns});
    auto cells = out.mutable_unchecked<2>();
    for (std::size_t r = 0; r < rows; ++r)
        for (py::ssize_t c = 0; c < columns; ++c) cells(static_cast<py::ssize_t>(r), c) = at(r, c);
    return out;
}

py::dict plan(const std::shared_ptr<LoadedScene>& scene, const std::string& target, double time_limit) {
    const auto planned = std::make_shared<Planned>();
    run_long([planned, scene, target, time_limit](const StopCheck& check_stop) {
        *planned = plan_scene(scene->source(), target, time_limit, check_stop);
    });
    const engine::Plan& p = planned->plan;
    const engine::Route& way = planned->way;
    py::dict out;
    out["arrived"] = p.arrived, out["time"] = p.time, out["closest"] = p.closest, out["last"] = p.last;
    out["retractions"] = p.retractions, out["exits"] = p.lumen_exits, out["largest_force"] = p.largest_force;
    out["replayed_last"] = planned->replay.last, out["length"] = planned->route.length;
    out["path"] = table(p.path.size(), 3, [&](std::size_t r, py::ssize_t c) {
        const engine::DriveRow& row = p.path[r];
        return c == 0 ? row.time : c == 1 ? row.insertion : row.rotation;
    });
    out["centreline"] = table(way.points.size(), 4, [&](std::size_t r, py::ssize_t c) { return c < 3 ? way.points[r][c] : way.radii[r]; });
    return out;
}

struct Frames {
    std::vector<std::vector<Vec3>> t0, t1;
    std::vector<collision::SurfaceTopology> surfaces;
    std::vector<engine::ContactRecord> rows;
};

void search(Frames& frames, bool within, double distance, unsigned threads, const StopCheck& check_stop) {
    std::vector<const collision::SurfaceTopology*> surfaces;
    std::vector<std::span<const Vec3>> positions;
    std::vector<collision::SurfaceMotion> motions;
    for (std::size_t i = 0; i < frames.surfaces.size(); ++i) {
        surfaces.push_back(&frames.surfaces[i]), positions.push_back(frames.t0[i]);
        motions.push_back({&frames.surfaces[i], frames.t0[i], frames.t1[i]});
    }
    collision::SearchOptions options;
    options.within = within;
    options.distance = distance;
    options.tolerance = kDistanceTolerance * distance;
    options.threads = threads;
    collision::ContactSearch search;
    search.build(surfaces, positions, options);
    check_stop();
    search.refit(motions);
    search.find_candidates();
    check_stop();
    std::vector<collision::SearchContact> found;
    search.decide(found);
    for (const collision::SearchContact& each : found) frames.rows.push_back(engine::record_of(each));
    std::sort(frames.rows.begin(), frames.rows.end(), [](const auto& a, const auto& b) { return a.compare_ids(b) < 0; });
}

/// An element of the answer of trocar.contacts.
struct PackedRow {
    char kind[2];
    std::int16_t body_a, body_b;
    std::int16_t unused;
    std::int64_t feature_a[2], feature_b[3];
    double time, bary_a, bary_b[2], normal[3];
};
static_assert(sizeof(PackedRow) == 8 + 5 * 8 + 7 * 8);

py::array pack(const std::vector<engine::ContactRecord>& rows) {
    const auto many = [](const char* name, const char* type, int count) { return py::make_tuple(name, type, py::make_tuple(count)); };
    py::list fields;
    fields.append(py::make_tuple("kind", "S2")), fields.append(py::make_tuple("body_a", "<i2")), fields.append(py::make_tuple("body_b", "<i2"));
    fields.append(py::make_tuple("_", "<i2"));
    fields.append(many("feature_a", "<i8", 2)), fields.append(many("feature_b", "<i8", 3));
    fields.append(py::make_tuple("time", "<f8")), fields.append(py::make_tuple("bary_a", "<f8"));
    fields.append(many("bary_b", "<f8", 2)), fields.append(many("normal", "<f8", 3));
    py::array out(py::dtype::from_args(fields), std::vector<py::ssize_t>{static_cast<py::ssize_t>(rows.size())});
    auto* packed = static_cast<PackedRow*>(out.mutable_data());
    for (const engine::ContactRecord& row : rows) {
        const bool vertex_face = row.kind == engine::ContactKind::VF;
        *packed++ = {{vertex_face ? 'V' : 'E', vertex_face ? 'F' : 'E'},
                     static_cast<std::int16_t>(row.body_a),
                     static_cast<std::int16_t>(row.body_b),
                     0,
                     {row.feature_a0, row.feature_a1},
                     {row.feature_b0, row.feature_b1, row.feature_b2},
                     row.time,
                     row.bary_a,
                     {row.bary_b0, row.bary_b1},
                     {row.normal[0], row.normal[1], row.normal[2]}};
    }
    return out;
}

using Points = py::array_t<double, py::array::c_style>;
using Triangles = py::array_t<Index, py::array::c_style>;

/// surfaces   (V0, V1, F) of each, as the Python side has checked them: [n, 3], [n, 3], [m, 3] with ids below n
py::array contacts(const std::vector<std::tuple<Points, Points, Triangles>>& surfaces, bool within, double distance, unsigned threads) {
    const auto frames = std::make_shared<Frames>();
    for (const auto& [t0, t1, f] : surfaces) {
        frames->t0.push_back(take_points(t0)), frames->t1.push_back(take_points(t1));
        const auto* first = reinterpret_cast<const Triangle*>(f.data());
        const std::vector<Triangle> triangles(first, first + f.shape(0));
        frames->surfaces.push_back(collision::make_topology(triangles, frames->t0.back().size()));
    }
    run_long([=](const StopCheck& check_stop) { search(*frames, within, distance, threads, check_stop); });
    return pack(frames->rows);
}

py::array_t<double> centreline(const LoadedScene& scene, const std::string& target, std::size_t instrument) {
    const engine::SceneModel& model = scene.model();
    if (instrument >= model.instruments.size()) bad_usage(fmt::format("found instrument {} of {}", instrument, model.instruments.size()), "instrument");
    const Index index = engine::find_target(scene.scene(), target);
    if (index == kNoIndex) {
        std::vector<std::string> known;
        for (const auto& each : scene.scene().targets) known.push_back(each.name);
        bad_usage(fmt::format("no target \"{}\"; known: {}", target, fmt::join(known, ", ")), "target");
    }
    const engine::InstrumentModel& own = model.instruments[instrument];
    spheretree::PathOptions options;
    options.min_radius = own.rod.design.radius;
    const auto path = value_of(spheretree::find_lumen_path(*model.bodies[own.lumen].lumen, own.port.position, scene.prepared().targets[index].position, options));
    return table(path.size(), 4, [&](std::size_t r, py::ssize_t c) { return c < 3 ? path[r].centre[c] : path[r].radius; });
}

} // namespace

void bind_functions(py::module_& module) {
    module.def("plan", &plan);
    module.def("contacts", &contacts);
    module.def("choose_isa", &fem::choose_isa);
    module.def("centreline", [](const std::shared_ptr<LoadedScene>& s, const std::string& t, std::size_t i) { return centreline(*s, t, i); });
}

} // namespace trocar::python
