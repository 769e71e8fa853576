#include "engine/scene/device.hpp"

namespace trocar::engine {

std::vector<std::string_view> device_names() {
    std::vector<std::string_view> names;
    for (const DeviceText& device : device_texts()) names.push_back(device.name());
    return names;
}

std::optional<std::string_view> find_device(std::string_view name) noexcept {
    for (const DeviceText& device : device_texts())
        if (device.name() == name) return device.text;
    return std::nullopt;
}

} // namespace trocar::engine
