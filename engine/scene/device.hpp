// Devices by name: assets/devices/*.json, which are part of the program, and files of the same kind.
#pragma once

#include "base/result.hpp"
#include "engine/scene/scene.hpp"

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct DeviceText {
    std::string_view file; // "cobra_c2.json"
    std::string_view text;

    [[nodiscard]] constexpr std::string_view name() const noexcept { return file.substr(0, file.rfind('.')); }
};

/// Sorted by name; generated from assets/devices/.
[[nodiscard]] std::span<const DeviceText> device_texts() noexcept;

[[nodiscard]] std::vector<std::string_view> device_names();
/// Text of the device with that name; empty where there is none.
[[nodiscard]] std::optional<std::string_view> find_device(std::string_view name) noexcept;

struct Device {
    SceneInstrument instrument; // its design, as read_design leaves it; nothing about where it is
    std::string about, source;
    std::vector<std::string> questions; // numbers that are unusual
};

/// fails     as read_scene does: file, line, column, key, what was found and what was expected
[[nodiscard]] Result<Device> parse_device(std::string_view text, const std::filesystem::path& file);

} // namespace trocar::engine
