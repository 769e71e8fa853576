#include "engine/scene/device.hpp"

namespace trocar::engine {

namespace {

std::string_view name_of(const DeviceText& device) noexcept { return device.file.substr(0, device.file.rfind('.')); }

} // namespace

std::vector<std::string_view> device_names() {
    std::vector<std::string_view> names;
    for (const DeviceText& device : device_texts()) names.push_back(name_of(device));
    return names;
}

std::optional<std::string_view> find_device(std::string_view name) noexcept {
    for (const DeviceText& device : device_texts())
        if (name_of(device) == name) return device.text;
    return std::nullopt;
}

} // namespace trocar::engine
