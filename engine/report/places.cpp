#include "engine/report/places.hpp"

#include <fmt/format.h>

#include <fstream>

#include <sys/utsname.h>
#include <unistd.h>

namespace trocar::engine {

namespace fs = std::filesystem;

std::string project_path(const fs::path& file) {
    std::error_code failed;
    const fs::path whole = fs::weakly_canonical(fs::absolute(file, failed), failed);
    if (failed) return file.generic_string();
    for (fs::path folder = whole.parent_path();; folder = folder.parent_path()) {
        if (fs::exists(folder / "CMakePresets.json", failed)) return whole.lexically_relative(folder).generic_string();
        if (folder == folder.parent_path()) break;
    }
    const fs::path relative = whole.lexically_relative(fs::weakly_canonical(fs::current_path(failed), failed));
    return relative.empty() ? whole.generic_string() : relative.generic_string();
}

std::string shell_quoted(std::string_view word) {
    constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+./:,=@%";
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string_view::npos) return std::string(word);
    std::string quoted = "'";
    for (const char c : word) {
        if (c == '\'')
            quoted += "'\\''";
        else
            quoted += c;
    }
    return quoted + "'";
}

std::string repeat_command(const Scene& scene, std::uint64_t steps) {
    std::string command =
        fmt::format("trocar run {} -n {} --budget {}", shell_quoted(project_path(scene.file)), steps, scene.budget.to_string());
    for (const std::string& setting : scene.settings) command += setting.starts_with("--") ? " " + setting : " --set " + shell_quoted(setting);
    if (!scene.instruments.empty() && !scene.instruments[kLeadInstrument].path_file.empty())
        command += " --path " + shell_quoted(scene.instruments[kLeadInstrument].path_file.string());
    if (!scene.instruments.empty() && !scene.instruments[kLeadInstrument].path.empty() && scene.instruments[kLeadInstrument].follow)
        command += " --to " + shell_quoted(scene.targets[scene.instruments[kLeadInstrument].follow->target].name);
    return command + " --out repeated";
}

const char* mode_name(BudgetMode mode) noexcept {
    switch (mode) {
    case BudgetMode::Wall:
        return "wall";
    case BudgetMode::Work:
        return "work";
    case BudgetMode::Exact:
        return "exact";
    }
    return "";
}

Machine describe_machine() {
    Machine machine;
    std::ifstream cpu("/proc/cpuinfo");
    for (std::string line; machine.processor.empty() && std::getline(cpu, line);)
        if (line.starts_with("model name")) {
            const std::size_t colon = line.find(": ");
            if (colon != std::string::npos) machine.processor = line.substr(colon + 2);
        }
    const long cores = sysconf(_SC_NPROCESSORS_ONLN), pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    machine.cores = cores > 0 ? static_cast<unsigned>(cores) : 0;
    machine.memory_gib = static_cast<double>(pages) * static_cast<double>(page) / (1024.0 * 1024.0 * 1024.0);
    utsname name{};
    if (uname(&name) == 0) machine.system = fmt::format("{} {}", name.sysname, name.machine);
    if (machine.processor.empty()) machine.processor = name.machine;
    machine.compiler = fmt::format("GCC {}", __VERSION__);
#ifdef __clang__
    machine.compiler = __VERSION__;
#endif
    return machine;
}

} // namespace trocar::engine
