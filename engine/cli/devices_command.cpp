// `devices`: the catalogue of instruments that a scene names with "device"; one of them as the file that it is.
#include "engine/cli/commands.hpp"
#include "engine/scene/device.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/section.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdio>
#include <memory>

namespace trocar::engine {

namespace {

int list_devices() {
    fmt::print("{:<24}{:>10}{:>10}{:>10}{:>14}{:>14}  {}\n", "", "length mm", "radius mm", "bore mm", "EI N mm^2", "tip EI N mm^2", "");
    for (const DeviceText& text : device_texts()) {
        const Result<Device> device = parse_device(text.text, text.file);
        if (!device.ok()) return report_error(device.error());
        const fem::RodDesign design = solid_section(device->instrument);
        const auto rod = fem::make_rod_model(design);
        if (!rod.ok()) return report_error(rod.error());
        const Bending bending = find_bending(*rod);
        fmt::print("{:<24}{:>10.4g}{:>10.4g}{:>10.3g}{:>14.4g}{:>14.3g}  {}\n", text.name(), 1e3 * design.length,
                   1e3 * design.radius, 1e3 * device->instrument.inner_radius, 1e6 * bending.shaft, 1e6 * bending.tip, device->about);
    }
    fmt::print("`trocar devices NAME` prints one with the source of its numbers; a scene takes it by \"device\": \"NAME\"\n");
    return kExitFine;
}

int print_device(const std::string& name) {
    const std::optional<std::string_view> text = find_device(name);
    if (!text) return report_error({ErrorCode::BadUsage, refuse_unknown("device", name, device_names()), {}, 0, 0, "NAME"});
    fmt::print("{}", *text);
    return kExitFine;
}

} // namespace

Command add_devices_command(CLI::App& app) {
    const auto name = std::make_shared<std::string>();
    CLI::App* command = app.add_subcommand("devices", "List the catheters and guide wires that scenes can name, or print one");
    command->add_option("name", *name, "one of them: prints its file");
    return {command, [name] { return name->empty() ? list_devices() : print_device(*name); }};
}

} // namespace trocar::engine
