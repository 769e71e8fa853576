#include "engine/time/date.hpp"

#include <array>
#include <ctime>

namespace trocar::engine {

std::string today() {
    const std::time_t now = std::time(nullptr);
    std::tm parts{};
    std::array<char, 16> text{};
    if (gmtime_r(&now, &parts) == nullptr || std::strftime(text.data(), text.size(), "%Y-%m-%d", &parts) == 0) return "unknown";
    return text.data();
}

} // namespace trocar::engine
