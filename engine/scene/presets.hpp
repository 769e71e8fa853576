// Tissues of the literature by name: docs/tissue.md says where each is from.
#pragma once

#include "fem/tissue/material.hpp"

#include <optional>
#include <string_view>
#include <vector>

namespace trocar::engine {

[[nodiscard]] std::vector<std::string_view> preset_names();
[[nodiscard]] std::optional<fem::Material> find_preset(std::string_view name) noexcept;

} // namespace trocar::engine
