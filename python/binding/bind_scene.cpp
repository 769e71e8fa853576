#include "engine/experiments/explain.hpp"
#include "python/binding/arrays.hpp"
#include "python/binding/bindings.hpp"
#include "python/binding/errors.hpp"
#include "python/binding/long_call.hpp"
#include "python/binding/loaded_scene.hpp"
#include "python/binding/simulator.hpp"

#include <pybind11/stl.h>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <memory>

namespace trocar::python {

namespace {

ScenePtr load(const SceneSource& source) {
    const auto loaded = std::make_shared<Result<ScenePtr>>(ScenePtr{});
    run_long([loaded, source](const StopCheck& check_stop) {
        *loaded = load_scene(source, [&](const std::string&) { check_stop(); });
        check_stop();
    });
    return value_of(std::move(*loaded));
}

std::string explain(const ScenePtr& scene) {
    const auto text = std::make_shared<std::string>();
    run_long([text, scene](const StopCheck& check_stop) {
        engine::explain_scene(
            scene->scene(), scene->prepared(), [&](const std::string& part) { *text += part; }, [&](const std::string&) { check_stop(); });
    });
    return *text;
}

std::string budget_text(const engine::BudgetLimits& limits) { return engine::BudgetSpec{limits}.to_string(); }

template <class List>
std::vector<std::string> names_of(const List& list) {
    std::vector<std::string> names;
    for (const auto& each : list) names.push_back(each.name);
    return names;
}

} // namespace

void bind_scene(py::module_& module) {
    module.def("load_scene", [](std::string file, std::string text, std::string budget, std::optional<std::uint32_t> anatomy_seed) {
        return std::const_pointer_cast<LoadedScene>(load({std::move(file), std::move(text), std::move(budget), anatomy_seed}));
    });
    py::class_<LoadedScene, std::shared_ptr<LoadedScene>>(module, "Scene", "A prepared scene: immutable, shared by its simulators.")
        .def_property_readonly("name", [](const LoadedScene& s) { return s.scene().name; }, "Its name.")
        .def_property_readonly("file", [](const LoadedScene& s) { return s.source().file; }, "The file that it was loaded from.")
        .def_property_readonly("step", [](const LoadedScene& s) { return s.model().step_s; }, "s, simulated by one step.")
        .def_property_readonly("step_count", [](const LoadedScene& s) { return s.model().step_count; }, "Steps of the scene's duration.")
        .def_property_readonly("budget", [](const LoadedScene& s) { return budget_text(s.model().budget); }, "As the scene writes it.")
        .def_property_readonly("bodies", [](const LoadedScene& s) { return names_of(s.model().bodies); }, "Names of its bodies.")
        .def_property_readonly("instruments", [](const LoadedScene& s) { return names_of(s.model().instruments); }, "Names of its instruments.")
        .def_property_readonly(
            "targets",
            [](const LoadedScene& s) {
                py::dict targets;
                for (std::size_t i = 0; i < s.scene().targets.size(); ++i)
                    targets[py::str(s.scene().targets[i].name)] = copy_vector(s.prepared().targets[i].position);
                return targets;
            },
            "Places by name: (3,) float64, m, at rest.")
        .def_property_readonly("notices", [](const LoadedScene& s) { return s.prepared().notices; }, "What preparing found to tell.")
        .def_property_readonly("seconds", [](const LoadedScene& s) { return s.prepared().seconds; }, "s, that preparing took.")
        .def_property_readonly("hash", [](const LoadedScene& s) { return fmt::format("{:016x}", s.hash()); }, "Of the prepared model, 16 hex digits.")
        .def_property_readonly("drive_limits", [](const LoadedScene& s) {
                std::vector<std::pair<double, double>> limits;
                for (const auto& each : s.model().instruments) limits.emplace_back(each.limits.speed, each.limits.rotation);
                return limits;
            }, "(m/s, rad/s) of each instrument.")
        .def("triangles", [](const LoadedScene& s, const std::string& body) {
                const Index index = engine::find_body(s.scene(), body);
                if (index == kNoIndex) bad_usage(fmt::format("no body \"{}\"; known: {}", body, fmt::join(names_of(s.model().bodies), ", ")), "body");
                const auto& triangles = s.model().bodies[index].surface.triangles;
                static_assert(sizeof(Triangle) == 3 * sizeof(Index));
                return py::array_t<Index>({static_cast<py::ssize_t>(triangles.size()), py::ssize_t{3}}, triangles.empty() ? nullptr : &triangles[0][0]);
            }, py::arg("body"), "(M, 3) uint32: vertices of the triangles of a body's surface.")
        .def("explain", [](const std::shared_ptr<LoadedScene>& s) { return explain(s); },
             "What is simulated and why, what is not, and what it costs: the text of `trocar explain`.")
        .def("simulator", [](const std::shared_ptr<LoadedScene>& s, const std::optional<std::string>& budget) {
                engine::BudgetLimits limits = s->model().budget;
                if (budget) limits = value_of(engine::parse_budget(*budget)).limits;
                const py::gil_scoped_release released;
                return std::make_unique<PySimulator>(s, limits);
            }, py::arg("budget") = py::none(), "A simulator at the scene's start; under another budget than the scene's, where one is given.")
        .def("_source", [](const LoadedScene& s) {
            return py::make_tuple(s.source().file, s.source().text, s.source().budget, s.source().anatomy_seed);
        })
        .def("__repr__", [](const LoadedScene& s) {
            return fmt::format("<trocar.Scene \"{}\": {} bodies, {} instruments, steps of {:g} ms, budget {}>", s.scene().name,
                               s.model().bodies.size(), s.model().instruments.size(), 1e3 * s.model().step_s, budget_text(s.model().budget));
        });
}

} // namespace trocar::python
