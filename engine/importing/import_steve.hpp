// The two set-ups of the navigation benchmark stEVE as scenes: the same devices, entry and targets, numbers converted once to SI.
#pragma once

#include "engine/importing/import_vessel.hpp"
#include "engine/importing/vessel_files.hpp"

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// A device as stEVE states it: mm, kg, s, so that moduli are kPa.
struct SteveDevice {
    std::string name;
    double length, diameter, bore, tip_diameter;     // mm
    double tip_radius, tip_angle;                    // mm, rad; angle 0: straight
    double modulus, tip_modulus;                     // kPa
    double density;                                  // kg/mm^3
    double friction;                                 // Coulomb mu
};

/// In the scene's words, kPa to MPa, kg/mm^3 to kg/m^3.
/// wire_in  the instrument in whose bore it runs; empty: none
/// notes    a device without a cross-section (bore as wide as it is) is taken as solid, and said
[[nodiscard]] std::string steve_instrument_text(const SteveDevice& device, std::string_view wire_in, const std::string& place, std::vector<std::string>& notes);

struct SteveSetup {
    ImportedVessel vessel;
    std::string instruments, targets; // members of the scene
    std::vector<std::string> notes;
    std::vector<std::filesystem::path> files; // that its curves were read from
};

/// DualDeviceNav: the folder of its centrelines (Centrelines_comb, or what holds it); a micro catheter with a micro guide wire in it.
[[nodiscard]] Result<SteveSetup> import_dual_device_nav(const std::filesystem::path& folder, const std::function<void(const std::string&)>& progress);
/// ArchVariety: an aortic arch with its three branches and a guide wire. stEVE draws a new arch for every episode; this is one of them in kind.
[[nodiscard]] Result<SteveSetup> import_arch_variety(const std::function<void(const std::string&)>& progress);

[[nodiscard]] std::string steve_scene_text(const SteveSetup& setup, const ImportSource& source);

} // namespace trocar::engine
