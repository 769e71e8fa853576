#include "engine/report/missing.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

bool MissingOutputs::note(const std::string& what, const Result<void>& written) {
    const auto known = std::find_if(outputs_.begin(), outputs_.end(), [&](const Output& output) { return output.what == what; });
    if (written.ok()) {
        if (known != outputs_.end()) outputs_.erase(known);
        return false;
    }
    if (known != outputs_.end()) return false;
    outputs_.push_back({what, written.error(), 1});
    return true;
}

bool MissingOutputs::add(const std::string& what, const Error& error) {
    for (Output& output : outputs_)
        if (output.what == what) {
            ++output.count;
            return false;
        }
    outputs_.push_back({what, error, 1});
    return true;
}

std::vector<std::string> MissingOutputs::sentences() const {
    std::vector<std::string> lines;
    for (const Output& output : outputs_)
        lines.push_back(output.count == 1
                            ? fmt::format("{} is missing: {}", output.what, output.first.to_string())
                            : fmt::format("{} of {} are missing, the first: {}", output.count, output.what, output.first.to_string()));
    return lines;
}

} // namespace trocar::engine
