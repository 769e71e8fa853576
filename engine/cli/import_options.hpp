// Options that the kinds of `import` share, and what they mean.
#pragma once

#include "engine/cli/commands.hpp"
#include "engine/importing/import_organ.hpp"
#include "engine/importing/import_vessel.hpp"
#include "engine/importing/label_surface.hpp"
#include "engine/importing/vessel_files.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

struct ImportRequest {
    std::filesystem::path file, out;
    std::string unit, inlet, repair = "auto", label, regions, device, kind = "vessel", hold = "0,0,1,0.15";
    double error_voxels = LabelSurfaceOptions{}.error;
    bool force = false, quiet = false, explain = true;
};

void add_output_options(CLI::App& command, ImportRequest& request);
void add_vessel_options(CLI::App& command, ImportRequest& request);
/// The file, its unit, and the two above.
void add_surface_options(CLI::App& command, ImportRequest& request);

void add_segmentation_options(CLI::App& command, ImportRequest& request);
void add_organ_options(CLI::App& command, ImportRequest& request);
void add_curve_options(CLI::App& command, ImportRequest& request, const char* what);

void add_steve_options(CLI::App& command, ImportRequest& request);

[[nodiscard]] MendMode mend_mode(const ImportRequest& request);
[[nodiscard]] Result<OrganHold> hold_of(const ImportRequest& request);
[[nodiscard]] std::filesystem::path output_of(const ImportRequest& request);
[[nodiscard]] ImportSource source_of(const ImportRequest& request);

/// m per unit of the file, as asked for or recognised by size; noted in the source.
[[nodiscard]] Result<double> choose_unit(const ImportRequest& request, double longest, ImportSource& source);
/// Bodies measure 0.1 mm to 10 m; the error names --unit.
[[nodiscard]] Result<void> check_size(const Box3& box, double unit, const ImportRequest& request);
/// unit  m, of the numbers of --inlet
[[nodiscard]] Result<VesselOptions> vessel_options(const ImportRequest& request, double unit);

[[nodiscard]] Error about_file(Error error, const std::filesystem::path& file);

/// The kind that the command line names.
[[nodiscard]] int run_chosen(const std::vector<Command>& kinds);

} // namespace trocar::engine
