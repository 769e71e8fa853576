#include "engine/c_api/c_api.h"

#include "engine/prepare/model.hpp"
#include "engine/prepare/prepared.hpp"
#include "engine/scene/scene.hpp"
#include "engine/step/simulator.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <new>

using namespace trocar;
using namespace trocar::engine;

struct trocar_scene {
    Prepared prepared;
};

struct trocar_simulator {
    Simulator simulator;
    Inputs inputs; // commands that hold
};

namespace {

thread_local std::string last_error;

trocar_status refuse(trocar_status status, std::string sentence) {
    last_error = std::move(sentence);
    return status;
}
trocar_status refuse_null(const char* what) { return refuse(TROCAR_BAD_ARGUMENT, fmt::format("{} is a null pointer", what)); }

/// Nothing is thrown into a caller that knows no exceptions.
template <class Call>
trocar_status guarded(Call&& call) noexcept {
    try {
        return call();
    } catch (const std::bad_alloc&) {
        last_error.assign("no memory"); // short: it needs none of its own
        return TROCAR_NO_MEMORY;
    } catch (const std::exception& thrown) {
        last_error.assign(thrown.what());
        return TROCAR_BAD_ARGUMENT;
    }
}

trocar_status check_index(const char* what, std::size_t index, std::size_t count) {
    if (index < count) return TROCAR_OK;
    return refuse(TROCAR_BAD_ARGUMENT, fmt::format("{} {} of {}; expected less than {}", what, index, count, count));
}
trocar_status check_instrument(const trocar_simulator* simulator, std::size_t index) {
    if (simulator == nullptr) return refuse_null("simulator");
    return check_index("instrument", index, simulator->simulator.instrument_count());
}

struct Geometry {
    std::span<const Vec3> points;
    std::span<const Triangle> triangles;
};

trocar_status find_geometry(trocar_simulator* simulator, trocar_points points, std::size_t index, Geometry& found) {
    if (simulator == nullptr) return refuse_null("simulator");
    if (points != TROCAR_ROD && points != TROCAR_SKIN && points != TROCAR_SURFACE && points != TROCAR_NODES)
        return refuse(TROCAR_BAD_ARGUMENT, fmt::format("points is {}; expected 0 to 3, a trocar_points", static_cast<int>(points)));
    if (points == TROCAR_ROD || points == TROCAR_SKIN) {
        if (const trocar_status status = check_instrument(simulator, index); status != TROCAR_OK) return status;
        const InstrumentView view = simulator->simulator.instrument(index);
        found.points = points == TROCAR_ROD ? view.rod : view.skin;
        if (points == TROCAR_SKIN) found.triangles = view.skin_triangles;
        return TROCAR_OK;
    }
    if (const trocar_status status = check_index("body", index, simulator->simulator.body_count()); status != TROCAR_OK) return status;
    const BodyView view = simulator->simulator.body(index);
    found.points = points == TROCAR_SURFACE ? view.surface : view.nodes;
    if (points == TROCAR_SURFACE) found.triangles = view.triangles;
    return TROCAR_OK;
}

template <class List>
trocar_status count_list(trocar_simulator* simulator, trocar_points points, std::size_t index, List Geometry::* list, std::size_t* count) {
    if (count == nullptr) return refuse_null("count");
    Geometry found;
    if (const trocar_status status = find_geometry(simulator, points, index, found); status != TROCAR_OK) return status;
    *count = (found.*list).size();
    return TROCAR_OK;
}

/// Three numbers of each.
template <class List, class Number>
trocar_status copy_list(trocar_simulator* simulator, trocar_points points, std::size_t index, List Geometry::* list, const char* what, Number* to,
                        std::size_t capacity) {
    Geometry found;
    if (const trocar_status status = find_geometry(simulator, points, index, found); status != TROCAR_OK) return status;
    const List& from = found.*list;
    if (from.size() > capacity)
        return refuse(TROCAR_BAD_ARGUMENT, fmt::format("{}: room for {}; expected {} or more", what, capacity, from.size()));
    if (to == nullptr && !from.empty()) return refuse_null(what);
    for (std::size_t k = 0; k < from.size(); ++k)
        for (int part = 0; part < 3; ++part) to[3 * k + std::size_t(part)] = from[k][part];
    return TROCAR_OK;
}

void write(const Vec3& from, double* to) noexcept {
    for (int axis = 0; axis < 3; ++axis) to[axis] = from[axis];
}

trocar_status find_name(const char* name, std::size_t* index, const char* what, std::optional<std::size_t> found) {
    if (!found) return refuse(TROCAR_BAD_ARGUMENT, fmt::format("no {} is called {}", what, name));
    *index = *found;
    return TROCAR_OK;
}

} // namespace

extern "C" {

const char* trocar_version(void) { return TROCAR_VERSION; }

const char* trocar_last_error(void) { return last_error.c_str(); }

trocar_status trocar_load_scene(const char* file, trocar_scene** scene) {
    return guarded([&]() -> trocar_status {
        if (file == nullptr) return refuse_null("file");
        if (scene == nullptr) return refuse_null("scene");
        const auto read = read_scene(file);
        if (!read) return refuse(TROCAR_BAD_SCENE, read.error().to_string());
        auto prepared = prepare_scene(*read);
        if (!prepared) return refuse(TROCAR_BAD_SCENE, prepared.error().to_string());
        *scene = new trocar_scene{std::move(*prepared)};
        return TROCAR_OK;
    });
}

void trocar_free_scene(trocar_scene* scene) { delete scene; }

double trocar_step_length(const trocar_scene* scene) { return scene == nullptr ? 0.0 : scene->prepared.model().step_s; }

trocar_status trocar_create(const trocar_scene* scene, const char* budget, trocar_simulator** simulator) {
    return guarded([&]() -> trocar_status {
        if (scene == nullptr) return refuse_null("scene");
        if (simulator == nullptr) return refuse_null("simulator");
        BudgetLimits limits = scene->prepared.model().budget;
        if (budget != nullptr) {
            const auto spec = parse_budget(budget);
            if (!spec) return refuse(TROCAR_BAD_ARGUMENT, "budget: " + spec.error().message);
            limits = spec->limits;
        }
        *simulator = new trocar_simulator{Simulator(scene->prepared, limits), {}};
        return TROCAR_OK;
    });
}

trocar_status trocar_fork(trocar_simulator* simulator, trocar_simulator** fork) {
    return guarded([&]() -> trocar_status {
        if (simulator == nullptr) return refuse_null("simulator");
        if (fork == nullptr) return refuse_null("fork");
        *fork = new trocar_simulator{simulator->simulator.fork(), simulator->inputs};
        return TROCAR_OK;
    });
}

void trocar_destroy(trocar_simulator* simulator) { delete simulator; }

size_t trocar_count_instruments(const trocar_simulator* simulator) { return simulator == nullptr ? 0 : simulator->simulator.instrument_count(); }

size_t trocar_count_bodies(const trocar_simulator* simulator) { return simulator == nullptr ? 0 : simulator->simulator.body_count(); }

trocar_status trocar_find_instrument(const trocar_simulator* simulator, const char* name, size_t* index) {
    return guarded([&]() -> trocar_status {
        if (simulator == nullptr || name == nullptr || index == nullptr) return refuse_null("an argument");
        return find_name(name, index, "instrument", simulator->simulator.find_instrument(name));
    });
}

trocar_status trocar_find_body(const trocar_simulator* simulator, const char* name, size_t* index) {
    return guarded([&]() -> trocar_status {
        if (simulator == nullptr || name == nullptr || index == nullptr) return refuse_null("an argument");
        return find_name(name, index, "body", simulator->simulator.find_body(name));
    });
}

trocar_status trocar_set_drive(trocar_simulator* simulator, size_t instrument, double insertion, double rotation) {
    return guarded([&]() -> trocar_status {
        if (const trocar_status status = check_instrument(simulator, instrument); status != TROCAR_OK) return status;
        if (!std::isfinite(insertion) || !std::isfinite(rotation))
            return refuse(TROCAR_BAD_ARGUMENT, fmt::format("insertion {} m, rotation {} rad; expected finite numbers", insertion, rotation));
        simulator->inputs.drive.resize(simulator->simulator.instrument_count());
        simulator->inputs.drive[instrument] = DriveCommand{insertion, rotation};
        return TROCAR_OK;
    });
}

trocar_status trocar_release(trocar_simulator* simulator, size_t instrument) {
    return guarded([&]() -> trocar_status {
        if (const trocar_status status = check_instrument(simulator, instrument); status != TROCAR_OK) return status;
        if (!simulator->inputs.drive.empty()) simulator->inputs.drive[instrument].reset();
        return TROCAR_OK;
    });
}

trocar_status trocar_step(trocar_simulator* simulator) {
    return guarded([&]() -> trocar_status {
        if (simulator == nullptr) return refuse_null("simulator");
        const Result<void> taken = simulator->simulator.step(simulator->inputs);
        if (!taken.ok()) return refuse(TROCAR_BAD_ARGUMENT, taken.error().to_string());
        const StepReport& report = simulator->simulator.report();
        return report.finite ? TROCAR_OK : refuse(TROCAR_STOPPED, report.failure);
    });
}

trocar_status trocar_get_report(const trocar_simulator* simulator, trocar_report* report) {
    return guarded([&]() -> trocar_status {
        if (simulator == nullptr) return refuse_null("simulator");
        if (report == nullptr) return refuse_null("report");
        const StepReport& last = simulator->simulator.report();
        const BudgetLimits& limits = simulator->simulator.budget();
        *report = {};
        report->step = last.step;
        report->time_s = last.time_s;
        report->total_ms = last.ms.total;
        report->charged_ms = last.ms.budget;
        report->budget_kept = limits.mode != BudgetMode::Wall || last.ms.budget <= 1e3 * limits.wall_s;
        report->exact = last.exact_ran;
        report->lumen_exits = last.lumen_exits;
        report->unresolved = last.unresolved;
        report->assumed = last.assumed;
        report->contact_force_n = last.contact_force_n;
        report->max_contact_force_n = last.max_contact_force_n;
        return TROCAR_OK;
    });
}

trocar_status trocar_get_hash(trocar_simulator* simulator, uint64_t* hash) {
    return guarded([&]() -> trocar_status {
        if (simulator == nullptr) return refuse_null("simulator");
        if (hash == nullptr) return refuse_null("hash");
        *hash = simulator->simulator.hash();
        return TROCAR_OK;
    });
}

trocar_status trocar_get_handle(const trocar_simulator* simulator, double* force_n, double* torque_nm) {
    return guarded([&]() -> trocar_status {
        if (const trocar_status status = check_instrument(simulator, 0); status != TROCAR_OK) return status;
        const StepReport& last = simulator->simulator.report();
        if (force_n != nullptr) *force_n = last.handle_force_n;
        if (torque_nm != nullptr) *torque_nm = last.handle_torque_nm;
        return TROCAR_OK;
    });
}

trocar_status trocar_get_force(const trocar_simulator* simulator, size_t instrument, double force[3]) {
    return guarded([&]() -> trocar_status {
        if (const trocar_status status = check_instrument(simulator, instrument); status != TROCAR_OK) return status;
        if (force == nullptr) return refuse_null("force");
        Vec3 sum = Vec3::Zero();
        const Thing own = Thing::instrument(instrument);
        for (const Contact& contact : simulator->simulator.contacts()) {
            if (contact.a == own) sum += contact.force;
            if (contact.b == own) sum -= contact.force;
        }
        write(sum, force);
        return TROCAR_OK;
    });
}

trocar_status trocar_get_tip(const trocar_simulator* simulator, size_t instrument, double position[3]) {
    return guarded([&]() -> trocar_status {
        if (const trocar_status status = check_instrument(simulator, instrument); status != TROCAR_OK) return status;
        if (position == nullptr) return refuse_null("position");
        write(simulator->simulator.instrument(instrument).tip(), position);
        return TROCAR_OK;
    });
}

trocar_status trocar_get_drive(const trocar_simulator* simulator, size_t instrument, double* insertion, double* rotation) {
    return guarded([&]() -> trocar_status {
        if (const trocar_status status = check_instrument(simulator, instrument); status != TROCAR_OK) return status;
        const InstrumentView view = simulator->simulator.instrument(instrument);
        if (insertion != nullptr) *insertion = view.insertion;
        if (rotation != nullptr) *rotation = view.rotation;
        return TROCAR_OK;
    });
}

trocar_status trocar_count_positions(trocar_simulator* simulator, trocar_points points, size_t index, size_t* count) {
    return guarded([&] { return count_list(simulator, points, index, &Geometry::points, count); });
}

trocar_status trocar_copy_positions(trocar_simulator* simulator, trocar_points points, size_t index, double* positions, size_t capacity) {
    return guarded([&] { return copy_list(simulator, points, index, &Geometry::points, "positions", positions, capacity); });
}

trocar_status trocar_count_triangles(trocar_simulator* simulator, trocar_points points, size_t index, size_t* count) {
    return guarded([&] { return count_list(simulator, points, index, &Geometry::triangles, count); });
}

trocar_status trocar_copy_triangles(trocar_simulator* simulator, trocar_points points, size_t index, uint32_t* vertices, size_t capacity) {
    return guarded([&] { return copy_list(simulator, points, index, &Geometry::triangles, "triangles", vertices, capacity); });
}

} // extern "C"
