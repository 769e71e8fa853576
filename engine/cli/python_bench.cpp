#include "engine/cli/python_bench.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <unistd.h>

namespace trocar::engine {

namespace {

namespace fs = std::filesystem;

bool has_module(const fs::path& package) {
    std::error_code failed;
    for (const auto& entry : fs::directory_iterator(package, failed))
        if (entry.path().filename().string().starts_with("_engine.") && entry.path().extension() == ".so") return true;
    return false;
}

bool is_program(const fs::path& file) { return access(file.c_str(), X_OK) == 0; }

bool has_installed_package(const fs::path& environment) {
    std::error_code failed;
    for (const auto& python : fs::directory_iterator(environment / "lib", failed))
        if (has_module(python.path() / "site-packages" / "trocar")) return true;
    return false;
}

} // namespace

Result<PythonWithPackage> find_python(const fs::path& program) {
    const fs::path build = program.parent_path(), environment = build.parent_path() / "venv";
    if (is_program(environment / "bin" / "python") && has_installed_package(environment)) return PythonWithPackage{environment / "bin" / "python", {}};
    if (has_module(build / "python" / "trocar") && is_program("/usr/bin/python3")) return PythonWithPackage{"/usr/bin/python3", build / "python"};
    return Error{ErrorCode::MissingTool,
                 fmt::format("the Python package is neither in {} nor in {}; expected one of them: `./start python` installs what it needs and makes it",
                             environment.string(), (build / "python").string()),
                 {}, 0, 0, "bench"};
}

Error become_python_bench(const std::vector<std::string>& arguments) {
    std::error_code failed;
    const auto python = find_python(fs::read_symlink("/proc/self/exe", failed));
    if (!python) return python.error();
    if (!python->package_folder.empty()) {
        const char* before = std::getenv("PYTHONPATH");
        const std::string paths = python->package_folder.string() + (before != nullptr && *before != '\0' ? ":" + std::string(before) : "");
        setenv("PYTHONPATH", paths.c_str(), 1);
    }
    std::vector<std::string> words{python->interpreter.string(), "-m", "trocar.bench"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    execv(python->interpreter.c_str(), pointers.data());
    return {ErrorCode::ToolFailed, fmt::format("{} could not be started: {}", python->interpreter.string(), std::strerror(errno)), {}, 0, 0, "bench"};
}

} // namespace trocar::engine
