// trocar._engine: the engine for Python. What users see of it is described in python/trocar.
#include "python/binding/bindings.hpp"
#include "python/binding/errors.hpp"
#include "python/binding/long_call.hpp"

namespace py = pybind11;

namespace {

const char* code_name(trocar::ErrorCode code) {
    using enum trocar::ErrorCode;
    switch (code) {
    case BadUsage: return "BadUsage";
    case FileNotFound: return "FileNotFound";
    case BadSyntax: return "BadSyntax";
    case BadValue: return "BadValue";
    case BadMesh: return "BadMesh";
    case MissingTool: return "MissingTool";
    case ToolFailed: return "ToolFailed";
    case CannotWrite: return "CannotWrite";
    case NotFinite: return "NotFinite";
    }
    return "BadValue";
}

void translate(std::exception_ptr thrown) {
    try {
        if (thrown) std::rethrow_exception(thrown);
    } catch (const trocar::python::EngineError& e) {
        const py::object type = py::module_::import("trocar._errors").attr("Error");
        const trocar::Error& error = e.error();
        PyErr_SetObject(type.ptr(), type(error.message, code_name(error.code), error.file, error.line, error.column, error.key).ptr());
    } catch (const trocar::python::StoppedError& e) {
        PyErr_SetString(py::module_::import("trocar._errors").attr("StoppedError").ptr(), e.what());
    }
}

} // namespace

PYBIND11_MODULE(_engine, module) {
    module.doc() = "The engine of trocar: see trocar's own documentation";
    py::register_exception_translator(translate);
    trocar::python::bind_scene(module);
    trocar::python::bind_simulator(module);
    trocar::python::bind_functions(module);
    trocar::python::bind_episodes(module);
    py::module_::import("atexit").attr("register")(py::cpp_function(trocar::python::join_left_work));
}
