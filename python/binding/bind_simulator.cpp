#include "engine/state/state_bytes.hpp"
#include "engine/step/checkpoint.hpp"
#include "python/binding/arrays.hpp"
#include "python/binding/bindings.hpp"
#include "python/binding/errors.hpp"
#include "python/binding/long_call.hpp"
#include "python/binding/simulator.hpp"
#include "python/binding/pictures.hpp"

#include <pybind11/stl.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstring>

namespace trocar::python {

namespace {

py::dtype contact_dtype() {
    const auto field = [](const char* name, const char* type) { return py::make_tuple(name, type); };
    const auto vector = [](const char* name) { return py::make_tuple(name, "<f8", py::make_tuple(3)); };
    py::list fields;
    fields.append(field("body_a", "<i4")), fields.append(field("body_b", "<i4")), fields.append(field("origin", "<i4"));
    fields.append(field("_", "<i4"));
    fields.append(vector("point")), fields.append(vector("normal"));
    fields.append(field("gap", "<f8")), fields.append(field("time", "<f8")), fields.append(vector("force"));
    return py::dtype::from_args(fields);
}

/// An element of Simulator.contacts().
struct PackedContact {
    std::int32_t body_a, body_b, origin, unused;
    double point[3], normal[3], gap, time, force[3];
};
static_assert(sizeof(PackedContact) == 4 * 4 + 11 * 8);

/// Bodies first, instruments after them.
std::int32_t number_of(const engine::SceneModel& model, Thing thing) {
    return static_cast<std::int32_t>(thing.is_body() ? thing.index() : model.bodies.size() + thing.index());
}

py::array list_contacts(PySimulator& simulator) {
    std::vector<Contact> contacts;
    {
        const py::gil_scoped_release released;
        contacts = simulator.contacts();
    }
    py::array out(contact_dtype(), std::vector<py::ssize_t>{static_cast<py::ssize_t>(contacts.size())});
    auto* packed = static_cast<PackedContact*>(out.mutable_data());
    for (const Contact& c : contacts) {
        PackedContact& p = *packed++;
        p = {number_of(simulator.model(), c.a), number_of(simulator.model(), c.b), static_cast<std::int32_t>(c.origin), 0, {}, {}, c.gap, c.time, {}};
        for (int k = 0; k < 3; ++k) p.point[k] = c.point[k], p.normal[k] = c.normal[k], p.force[k] = c.force[k];
    }
    out.attr("setflags")(py::arg("write") = false);
    return out;
}

std::size_t find_body(const PySimulator& simulator, const py::object& body) {
    if (!py::isinstance<py::str>(body)) return body.cast<std::size_t>();
    const Index index = engine::find_body(simulator.scene()->scene(), body.cast<std::string>());
    if (index == kNoIndex) {
        std::vector<std::string> names;
        for (const auto& each : simulator.model().bodies) names.push_back(each.name);
        bad_usage(fmt::format("no body \"{}\"; known: {}", body.cast<std::string>(), fmt::join(names, ", ")), "body");
    }
    return index;
}

std::size_t find_instrument(const PySimulator& simulator, const py::object& instrument) {
    if (!py::isinstance<py::str>(instrument)) return instrument.cast<std::size_t>();
    std::vector<std::string> names;
    for (const auto& each : simulator.model().instruments) {
        if (each.name == instrument.cast<std::string>()) return names.size();
        names.push_back(each.name);
    }
    bad_usage(fmt::format("no instrument \"{}\"; known: {}", instrument.cast<std::string>(), fmt::join(names, ", ")), "instrument");
}

std::string hash_text(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

const engine::State& state_of(const SavedState& saved) {
    if (!saved.state) bad_usage("a state that came from another process is known once a simulator has loaded it; expected load() first");
    return *saved.state;
}

py::bytes bytes_of(const SavedState& saved) {
    if (!saved.state) return saved.checkpoint;
    engine::Checkpoint checkpoint{saved.scene->hash(), saved.scene->model().name, saved.scene->model().budget, saved.state->step, {}};
    engine::append_state(*saved.state, checkpoint.state);
    return engine::checkpoint_bytes(checkpoint);
}

void bind_report(py::module_& module) {
    using engine::StepReport;
    py::class_<StepReport>(module, "StepReport", "What one step did: a copy of its own.")
        .def_readonly("step", &StepReport::step, "Steps done.")
        .def_readonly("time", &StepReport::time_s, "s, at the end of the step.")
        .def_property_readonly("tip", [](const StepReport& r) { return copy_vector(r.tip); }, "(3,) float64, m: tip of the first instrument.")
        .def_readonly("insertion", &StepReport::insertion_m, "m, of the first instrument.")
        .def_readonly("rotation", &StepReport::rotation_rad, "rad, of the first instrument's handle.")
        .def_readonly("contact_force", &StepReport::contact_force_n, "N, sum of the normal forces on walls.")
        .def_readonly("max_contact_force", &StepReport::max_contact_force_n, "N, at one place.")
        .def_readonly("friction_force", &StepReport::friction_force_n, "N, sum of the friction forces on walls.")
        .def_readonly("exact", &StepReport::exact_ran, "The exact stage answered, for every instrument.")
        .def_readonly("contacts", &StepReport::pressing_contacts, "Places where an instrument presses on its wall.")
        .def_readonly("exact_contacts", &StepReport::exact_contacts, "Contacts that continuous tests found, those that a correction removed included.")
        .def_readonly("exits", &StepReport::lumen_exits, "Instrument vertices outside the lumen.")
        .def_readonly("unresolved", &StepReport::unresolved, "Elementary tests without a verdict.")
        .def_readonly("assumed", &StepReport::assumed, "Untested sphere pairs that were taken for contacts.")
        .def_readonly("unproven", &StepReport::unproven_links, "Links of instruments whose freedom nothing proved.")
        .def_readonly("safe_fraction", &StepReport::safe_fraction, "Below 1: the step's motion was scaled to it.")
        .def_readonly("target_distance", &StepReport::target_distance_m, "m, tip to the target that the scene follows; negative: none.")
        .def_readonly("kinetic", &StepReport::kinetic_j, "J, of the tissue.")
        .def_readonly("elastic", &StepReport::elastic_j, "J, of the tissue.")
        .def_readonly("min_volume_ratio", &StepReport::min_volume_ratio, "Smallest det F of a tetrahedron.")
        .def_readonly("inverted_tets", &StepReport::inverted_tets, "Tetrahedra with det F <= 0.")
        .def_readonly("substeps", &StepReport::substeps, "Of the tissue's integration.")
        .def_readonly("budget_kept", &StepReport::budget_kept, "The step ended within its budget.")
        .def_readonly("work_units", &StepReport::work_units, "Sphere-pair tests that were charged.")
        .def_readonly("finite", &StepReport::finite, "False: the state left its bounds; it is the last good one.")
        .def_readonly("failure", &StepReport::failure, "What left its bounds; empty while finite.")
        .def_property_readonly("ms", [](const StepReport& r) {
                py::dict ms;
                ms["fem"] = r.ms.fem, ms["steer"] = r.ms.steer, ms["descend"] = r.ms.descend, ms["exact"] = r.ms.exact;
                ms["respond"] = r.ms.respond, ms["total"] = r.ms.total;
                return ms;
            }, "Wall time of the stages, ms.")
        .def("__repr__", [](const StepReport& r) {
            return fmt::format("<trocar.StepReport: step {}, {:.6g} s, tip ({:.2f}, {:.2f}, {:.2f}) mm, {} contacts, {:.3g} N{}>", r.step,
                               r.time_s, 1e3 * r.tip[0], 1e3 * r.tip[1], 1e3 * r.tip[2], r.pressing_contacts, r.contact_force_n,
                               r.finite ? "" : ", stopped: " + r.failure);
        });
}

void bind_saved_state(py::module_& module) {
    py::class_<SavedState>(module, "SavedState", "All that a simulator needs to go on to the same bits: state and held drive commands.")
        .def_property_readonly("step", [](const SavedState& s) { return state_of(s).step; }, "Steps done.")
        .def_property_readonly("time", [](const SavedState& s) { return state_of(s).time; }, "s.")
        .def_property_readonly("hash", [](const SavedState& s) { return hash_text(hash_state(state_of(s))); }, "16 hex digits, as Simulator.hash.")
        .def("_parts", [](const SavedState& s) {
            py::list drives;
            for (const auto& rate : s.drives) drives.append(rate ? py::object(py::make_tuple(rate->speed, rate->turn)) : py::none());
            return py::make_tuple(bytes_of(s), drives);
        });
    module.def("saved_state_from", [](const py::bytes& bytes, const std::vector<std::optional<std::pair<double, double>>>& drives) {
        SavedState saved;
        saved.checkpoint = bytes;
        for (const auto& rate : drives)
            saved.drives.push_back(rate ? std::optional(DriveRate{rate->first, rate->second}) : std::nullopt);
        return saved;
    });
}

} // namespace

void bind_simulator(py::module_& module) {
    bind_report(module);
    bind_saved_state(module);
    py::class_<PySimulator>(module, "Simulator", "One run of a scene. Calls from several threads follow one another.")
        .def_property_readonly("scene", [](const PySimulator& s) { return std::const_pointer_cast<LoadedScene>(s.scene()); }, "Its scene.")
        .def_property_readonly("budget", [](const PySimulator& s) { return engine::BudgetSpec{s.budget()}.to_string(); }, "Of every step.")
        .def("drive", [](PySimulator& s, const py::object& instrument, double speed, double turn) {
                const std::size_t index = find_instrument(s, instrument);
                free([&] { s.drive(index, DriveRate{speed, turn}); });
            }, py::arg("instrument"), py::arg("speed") = 0.0, py::arg("turn") = 0.0,
            "From now on the handle is pushed at `speed` (m/s; negative: drawn back) and turned at `turn` (rad/s), within its limits.")
        .def("release", [](PySimulator& s, const py::object& instrument) {
                const std::size_t index = find_instrument(s, instrument);
                free([&] { s.drive(index, std::nullopt); });
            }, py::arg("instrument"), "From now on the scene's own script drives the instrument.")
        .def("step", [](PySimulator& s, std::int64_t count) {
                if (count < 0) bad_usage(fmt::format("found {} steps, expected 0 or more", count), "count");
                const py::gil_scoped_release released;
                return s.step(static_cast<std::uint64_t>(count), [] {
                    const py::gil_scoped_acquire held;
                    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
                });
            }, py::arg("count") = 1, "Takes steps, and returns the last one's report.")
        .def_property_readonly("report", [](PySimulator& s) { return free([&] { return s.report(); }); }, "Of the last step.")
        .def_property_readonly("hash", [](PySimulator& s) { return hash_text(free([&] { return s.hash(); })); },
                               "Of the state, 16 hex digits: the `state_hash` of `trocar run`.")
        .def("save", [](PySimulator& s) { return free([&] { return s.save(); }); }, "The state, to go on from with load().")
        .def("load", [](PySimulator& s, const SavedState& saved) { free([&] { s.load(saved); }); }, py::arg("state"),
             "Goes on from a saved state of this scene.")
        .def("fork", [](PySimulator& s) { return free([&] { return s.fork(); }); }, "Another simulator that goes on to the same bits.")
        .def("rod", [](const py::object& self, const py::object& instrument) {
                auto& s = self.cast<PySimulator&>();
                return view_points(s.rod(find_instrument(s, instrument)), self);
            }, py::arg("instrument") = 0, "(N, 3) float64, m, read-only view: nodes of an instrument's rod, the tip last.")
        .def("skin", [](const py::object& self, const py::object& instrument) {
                auto& s = self.cast<PySimulator&>();
                return view_points(s.skin(find_instrument(s, instrument)), self);
            }, py::arg("instrument") = 0, "(N, 3) float64, m, read-only view: vertices of an instrument's surface.")
        .def("surface", [](const py::object& self, const py::object& body) {
                auto& s = self.cast<PySimulator&>();
                const std::size_t index = find_body(s, body);
                const auto points = free([&] { return s.surface(index); });
                return view_points(points, self);
            }, py::arg("body"), "(N, 3) float64, m, read-only view: vertices of a body's surface.")
        .def("render", [](PySimulator& s, const std::optional<std::string>& view) -> py::array {
                return picture_array(free([&] { return s.render(view.value_or("")); }));
            }, py::arg("view") = py::none(),
            "(rows, columns) uint16 or uint8: the X-ray frame of a view of the scene's outputs.fluoroscopy, its first where none is named; the "
            "whole patient from the front where the scene has none.")
        .def("_xray", [](PySimulator& s, const std::string& view) { return picture_dict(free([&] { return s.observe(view); })); })
        .def("contacts", &list_contacts, "Structured array of what the last step's response pushed against; of its own.")
        .def("__repr__", [](PySimulator& s) {
            const auto report = free([&] { return s.report(); });
            return fmt::format("<trocar.Simulator of \"{}\": step {}, {:.6g} s>", s.model().name, report.step, report.time_s);
        });
}

} // namespace trocar::python
