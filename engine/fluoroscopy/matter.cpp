#include "engine/fluoroscopy/matter.hpp"

#include <array>

namespace trocar::engine {

const XrayCoefficient& coefficient_of(XrayMatter matter) noexcept {
    static constexpr std::array<XrayCoefficient, 5> kAll{{
        {"tissue", 0.02048, 1060.0},
        {"blood", 0.02057, 1060.0},
        {"bone", 0.03148, 1920.0},
        {"nitinol", 0.558 * 0.1512 + 0.442 * 0.07661, 6450.0},
        {"steel", 0.1205, 7900.0},
    }};
    return kAll[static_cast<std::size_t>(matter)];
}

} // namespace trocar::engine
