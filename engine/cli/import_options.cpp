#include "engine/cli/import_options.hpp"

#include "engine/cli/number_range.hpp"
#include "engine/importing/unit_guess.hpp"
#include "engine/io/printable.hpp"
#include "engine/scene/device.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/units.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdlib>

namespace trocar::engine {

namespace {

constexpr double kSmallestBody = 1e-4, kLargestBody = 10.0; // m, as scenes take them
constexpr double kFarthest = 1e8;                           // times its size, from the origin

Error bad_import_option(std::string option, std::string message) { return {ErrorCode::BadUsage, std::move(message), {}, 0, 0, std::move(option)}; }

} // namespace

void add_output_options(CLI::App& command, ImportRequest& request) {
    command.add_option("--out", request.out, "output folder; out/<file name> where none is given");
    command.add_flag("--force", request.force, "write into an output folder that is not empty");
    command.add_flag("!--no-explain", request.explain, "do not try what the scene costs: no explain.txt");
    command.add_flag("--quiet", request.quiet, "no progress line");
}

static void add_instrument_option(CLI::App& command, ImportRequest& request) {
    command.add_option("--instrument", request.device, "a device that `trocar devices` lists; a catheter made for the way where none is named");
}

void add_vessel_options(CLI::App& command, ImportRequest& request) {
    command.add_option("--inlet", request.inlet, "x,y,z in the file's unit, near the end that instruments enter by; the widest end where none is given");
    command.add_option("--repair", request.repair, "auto: what the surface needs, each repair named with its count; none: refuse a surface that needs one")
        ->check(CLI::IsMember({"auto", "none"}));
    add_instrument_option(command, request);
}

void add_surface_options(CLI::App& command, ImportRequest& request) {
    command
        .add_option("surface", request.file, "surface file (OBJ, PLY, STL, OFF, VTK, VTP; plain or .gz); of a file of tetrahedra the boundary")
        ->required();
    command.add_option("--unit", request.unit, "of the file's coordinates: m, cm, mm, um; recognised by size where none is given");
    add_vessel_options(command, request);
    add_output_options(command, request);
}

void add_segmentation_options(CLI::App& command, ImportRequest& request) {
    command.add_option("labels", request.file, "label map: .nrrd, .seg.nrrd, .nhdr, .nii, .nii.gz, .hdr, .mha or .mhd")->required();
    command.add_option("--label", request.label, "a segment's name, or a label's number; needed where there are several");
    command.add_option("--as", request.kind, "what the segment is")->check(CLI::IsMember({"vessel", "organ"}));
    command.add_option("--error", request.error_voxels, "of the smallest voxel spacing: farthest that fewer triangles may lie from the surface, anywhere")
        ->check(number_range(1e-3, 2.0));
    command.add_option("--hold", request.hold, "with --as organ: x,y,z,share: direction to the part that is held, and its share of the extent");
    add_vessel_options(command, request);
    add_output_options(command, request);
}

void add_organ_options(CLI::App& command, ImportRequest& request) {
    command
        .add_option("organ", request.file, "tetrahedra (MSH, VTK, VTU, MEDIT, TetGen, Vega), or a closed surface (OBJ, PLY, STL, OFF, VTP); plain or .gz")
        ->required();
    command.add_option("--unit", request.unit, "of the file's coordinates: m, cm, mm, um; recognised by size where none is given");
    command.add_option("--hold", request.hold, "x,y,z,share: direction to the part that is held, and its share of the extent along it");
    command.add_option("--regions", request.regions, "cell array of integers that says which region each cell belongs to; the usual ones are found by name");
    command.add_option("--repair", request.repair, "auto: what the surface needs, each repair named with its count; none: refuse a surface that needs one")
        ->check(CLI::IsMember({"auto", "none"}));
    add_output_options(command, request);
}

void add_curve_options(CLI::App& command, ImportRequest& request, const char* what) {
    command.add_option("centrelines", request.file, what)->required();
    add_instrument_option(command, request);
    command.add_option("--inlet", request.inlet, "x,y,z in mm, near the end that instruments enter by; the widest end where none is given");
    add_output_options(command, request);
}

void add_steve_options(CLI::App& command, ImportRequest& request) {
    command.add_option("centrelines", request.file, "of DualDeviceNav: the folder with its centrelines (.mrk.json)");
    command.add_option("--setup", request.kind, "which one: dualdevicenav where none is named")->check(CLI::IsMember({"dualdevicenav", "archvariety"}));
    add_output_options(command, request);
}

std::filesystem::path output_of(const ImportRequest& request) {
    if (!request.out.empty()) return request.out;
    const std::filesystem::path named = request.file.has_filename() ? request.file : request.file.parent_path();
    return std::filesystem::path("out") / safe_file_name(named.stem().stem().string());
}

ImportSource source_of(const ImportRequest& request) {
    const std::filesystem::path named = request.file.has_filename() ? request.file : request.file.parent_path();
    ImportSource source;
    source.name = safe_file_name(named.stem().stem().string());
    source.file = request.file.string();
    return source;
}

Result<double> choose_unit(const ImportRequest& request, double longest, ImportSource& source) {
    if (!request.unit.empty()) {
        const auto known = find_unit(Dimension::Length, request.unit);
        if (!known) {
            std::vector<std::string_view> names;
            for (const UnitName& unit : known_units(Dimension::Length)) names.push_back(unit.name);
            return bad_import_option("--unit", fmt::format("no unit '{}'; known: {}", request.unit, fmt::join(names, ", ")));
        }
        source.facts.emplace_back("unit", request.unit + ", as asked for");
        return source.unit = *known;
    }
    const UnitGuess guess = guess_unit(longest);
    source.facts.emplace_back("unit", fmt::format("{}, by its size: the longest side is {:.6g}; --unit says otherwise", guess.name, longest));
    return source.unit = guess.metres;
}

Result<void> check_size(const Box3& box, double unit, const ImportRequest& request) {
    const double size = unit * box.longest_edge();
    if (!(size >= kSmallestBody && size <= kLargestBody))
        return Error{ErrorCode::BadValue, fmt::format("its longest side is {:.6g} m; expected {:g} m to {:g} m", size, kSmallestBody, kLargestBody),
                     request.file.string(), 0, 0, "--unit"};
    if (const double away = unit * box.centre().cwiseAbs().maxCoeff(); away > kFarthest * size)
        return Error{ErrorCode::BadValue, fmt::format("it lies {:.3g} m from the origin, {:.3g} times its size: its shape is lost to rounding", away,
                                                      away / size),
                     request.file.string()};
    return {};
}

/// Numbers with commas between them; empty: not so many, or not finite.
static std::vector<double> parse_list(const std::string& text, std::size_t count) {
    std::vector<double> numbers;
    const char* at = text.c_str();
    for (std::size_t i = 0; i < count; ++i) {
        char* end = nullptr;
        numbers.push_back(std::strtod(at, &end));
        if (end == at || *end != (i + 1 < count ? ',' : '\0') || !std::isfinite(numbers.back())) return {};
        at = end + 1;
    }
    return numbers;
}

Result<VesselOptions> vessel_options(const ImportRequest& request, double unit) {
    VesselOptions options;
    options.mode = mend_mode(request);
    if (!request.device.empty() && !find_device(request.device)) return bad_import_option("--instrument", refuse_unknown("device", request.device, device_names()));
    options.device = request.device;
    if (request.inlet.empty()) return options;
    const std::vector<double> place = parse_list(request.inlet, 3);
    if (place.empty())
        return bad_import_option("--inlet", fmt::format("found '{}'; expected three numbers with commas between them, such as 12,-3.5,40", request.inlet));
    options.inlet = unit * Vec3(place[0], place[1], place[2]);
    return options;
}

MendMode mend_mode(const ImportRequest& request) { return request.repair == "none" ? MendMode::None : MendMode::Automatic; }

Result<OrganHold> hold_of(const ImportRequest& request) {
    const std::vector<double> hold = parse_list(request.hold, 4);
    if (hold.empty() || !(Vec3(hold[0], hold[1], hold[2]).norm() > 0.0) || !(hold[3] > 0.0 && hold[3] <= 1.0))
        return bad_import_option("--hold", fmt::format("found '{}'; expected a direction and a share of the extent along it, such as 0,0,1,0.15", request.hold));
    return OrganHold{Vec3(hold[0], hold[1], hold[2]).normalized(), hold[3]};
}

Error about_file(Error error, const std::filesystem::path& file) {
    if (error.file.empty()) error.file = file.string();
    return error;
}

int run_chosen(const std::vector<Command>& kinds) {
    for (const Command& kind : kinds) {
        if (!kind.app->parsed()) continue;
        for (const CLI::Option* option : kind.app->get_options())
            for (const std::string& value : option->results())
                if (value.empty())
                    return report_error({ErrorCode::BadUsage, "found an empty value; give it one, or leave it out", {}, 0, 0, option->get_name()});
        return kind.run();
    }
    return kExitBadInput;
}

} // namespace trocar::engine
