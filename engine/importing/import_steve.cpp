#include "engine/importing/import_steve.hpp"

#include "base/inside.hpp"
#include "engine/importing/import_curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {

namespace {

namespace fs = std::filesystem;

constexpr double kKiloPascal = 1e-3;  // MPa
constexpr double kPerCubicMm = 1e9;   // kg/m^3 of 1 kg/mm^3
constexpr double kDensest = 23000.0;  // kg/m^3
constexpr double kLightest = 500.0;   // kg/m^3
/// mm: at the start this much of a device is in.
constexpr double kInserted = 10.0;

/// DualDeviceNav's insertion point and direction in its own frame, which is (y, -z, -x) of the centrelines' frame.
const Vec3 kInsertion(65, -5, 35), kDirection(-1, 0, 1); // mm, -
constexpr const char* kTargetCurves[] = {"LCCA", "LVA", "RCCA", "RVA"};

/// The files' curves lie in LPS, of which stEVE's frame is (y, -z, -x).
Vec3 to_curves(const Vec3& steve) { return {steve.z(), -steve.x(), -steve.y()}; }

std::string shown(const Vec3& p) { return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", p.x(), p.y(), p.z()); }

/// The place on the centrelines that is nearest, with the direction along them that agrees with the one given.
void enter_at(ImportedVessel& vessel, const Vec3& place, const Vec3& direction) {
    double least = std::numeric_limits<double>::infinity();
    for (const CentrelineBranch& branch : vessel.branches)
        for (std::size_t i = 0; i + 1 < branch.points.size(); ++i) {
            const double away = (branch.points[i] - place).norm();
            if (away >= least || branch.radii[i] < 2.0 * vessel.instrument.radius) continue;
            least = away;
            vessel.entry = branch.points[i];
            const Vec3 along = (branch.points[std::min(i + 3, branch.points.size() - 1)] - branch.points[i]).normalized();
            vessel.direction = along.dot(direction) >= 0.0 ? along : Vec3(-along);
        }
}

/// On the named curve, so far before its end that the lumen is wide there.
Vec3 place_before_end(const NamedCurve& curve, const InsideTest& inside, double room) {
    for (std::size_t i = curve.points.size(); i-- > 1;)
        if (-inside.signed_distance(curve.points[i]) >= room) return curve.points[i];
    return curve.points.front();
}

double straight_length(const ImportedVessel& vessel, const InsideTest& inside, double radius) {
    double s = 0.0;
    while (s < 1e-3 * kInserted && -inside.signed_distance(vessel.entry + (s + 5e-4) * vessel.direction) >= 1.5 * radius) s += 5e-4;
    return 0.8 * s;
}

} // namespace

std::string steve_instrument_text(const SteveDevice& d, std::string_view wire_in, const std::string& place, std::vector<std::string>& notes) {
    double bore = d.bore;
    if (!(bore < d.diameter)) {
        notes.push_back(fmt::format("{}: its bore of {:g} mm is as wide as itself, it has no cross-section; taken as solid instead", d.name, d.bore));
        bore = 0.0;
    }
    double density = kPerCubicMm * d.density;
    if (density > kDensest) notes.push_back(fmt::format("{}: {:.0f} kg/m^3 is denser than any metal; taken as {:g}", d.name, density, kDensest)), density = kDensest;
    if (density < kLightest) notes.push_back(fmt::format("{}: {:.0f} kg/m^3 is lighter than any polymer; taken as {:g}", d.name, density, kLightest)), density = kLightest;
    const std::string section = bore > 0.0 ? fmt::format("\"inner_radius\": {:.6g}, ", 0.5 * bore) : std::string();
    const double tip_ratio = std::pow(d.tip_diameter / d.diameter, 4.0) * d.tip_modulus / d.modulus;
    std::string tip = "{\"shape\": \"straight\"}";
    if (d.tip_angle > 0.0)
        tip = fmt::format("{{\"shape\": \"J\", \"length\": {:.6g}, \"angle\": {:.6g}, \"stiffness\": {:.4g}}}", d.tip_radius * d.tip_angle, d.tip_angle,
                          std::clamp(tip_ratio, 1e-3, 10.0));
    return fmt::format("        \"{}\": {{\n            {}\"length\": {:g}, \"radius\": {:.6g}, {}\"young_modulus\": {:.6g}, \"density\": {:.6g}, \"friction\": {:g},\n"
                       "            \"tip\": {}, \"segment\": 2.5, \"skin_triangles\": 4000,\n            {}\n        }}",
                       d.name, wire_in.empty() ? std::string() : fmt::format("\"inside\": \"{}\", ", wire_in), d.length, 0.5 * d.diameter, section, kKiloPascal * d.modulus, density,
                       std::max(d.friction, 0.0), tip, place);
}

Result<SteveSetup> import_dual_device_nav(const fs::path& folder, const std::function<void(const std::string&)>& progress) {
    std::error_code failed;
    const fs::path inner = folder / "Centrelines_comb";
    const Result<CurveSet> curves = read_slicer(fs::is_directory(inner, failed) ? inner : folder);
    if (!curves.ok()) return curves.error();
    VesselOptions options;
    options.inlet = 1e-3 * to_curves(kInsertion);
    Result<ImportedVessel> vessel = import_curve_set(*curves, options, progress);
    if (!vessel.ok()) return vessel.error();
    SteveSetup setup{std::move(*vessel), {}, {}, {}, curves->files};
    enter_at(setup.vessel, *options.inlet, to_curves(kDirection));
    const InsideTest inside(setup.vessel.surface);
    for (const char* wanted : kTargetCurves) {
        const auto curve = std::find_if(curves->curves.begin(), curves->curves.end(), [&](const NamedCurve& each) { return each.name.ends_with(wanted); });
        if (curve == curves->curves.end())
            return Error{ErrorCode::BadValue, fmt::format("has no curve whose name ends in {}; expected LCCA, LVA, RCCA and RVA", wanted), folder.string()};
        setup.targets += fmt::format("{}\n        \"{}\": {{\"position\": {}}}", setup.targets.empty() ? "" : ",", wanted,
                                     shown(1e3 * place_before_end(*curve, inside, 1e-3)));
    }
    const double inserted = 1e3 * straight_length(setup.vessel, inside, 3.5e-4);
    const std::string place = fmt::format("\"entry\": {{\"position\": {}, \"direction\": {}}}, \"lumen\": \"vessel\", \"inserted\": {:.6g},\n            "
                                          "\"follow\": {{\"target\": \"RCCA\", \"speed\": 30, \"tolerance\": 5}}",
                                          shown(1e3 * setup.vessel.entry), shown(setup.vessel.direction), inserted);
    setup.instruments = steve_instrument_text({"micro_catheter", 900, 0.7, 0.57, 0.6, 0, 0, 1e3, 1e3, 5e-6, 0.001}, "", place, setup.notes) + ",\n" +
                        steve_instrument_text({"micro_guide_wire", 900, 0.36, 0.36, 0.36, 0, 0, 1e3, 1e3, 5e-6, 0.001}, "micro_catheter",
                                              fmt::format("\"inserted\": {:.6g}", inserted), setup.notes);
    setup.notes.emplace_back("frame: that of the centrelines, turned into RAS; stEVE's own is (-y, -z, x) of it");
    return setup;
}

Result<SteveSetup> import_arch_variety(const std::function<void(const std::string&)>& progress) {
    CurveSet set;
    const auto add = [&](const char* name, std::initializer_list<std::array<double, 4>> rows) { // mm
        NamedCurve curve{name, {}, {}};
        for (const auto& [x, y, z, radius] : rows) curve.points.emplace_back(1e-3 * x, 1e-3 * y, 1e-3 * z), curve.radii.push_back(1e-3 * radius);
        set.curves.push_back(std::move(curve));
    };
    add("aorta", {{0, 0, 0, 11}, {0, 0, 60, 11}, {0, 0, 110, 11}, {-2, 3, 145, 11.5}, {-10, 10, 166, 12}, {-26, 19, 177, 12.5}, {-46, 28, 174, 13}, {-60, 35, 156, 13.5}, {-64, 38, 125, 14}});
    add("left subclavian", {{-12, 12, 168, 4.5}, {-9, 11, 190, 4.5}, {4, 7, 220, 4}, {24, 3, 250, 3.6}});
    add("left carotid", {{-26, 19, 177, 4}, {-28, 21, 198, 3.8}, {-28, 24, 226, 3.4}, {-24, 28, 280, 3.2}});
    add("brachiocephalic", {{-44, 27, 175, 6}, {-50, 31, 198, 5.8}, {-58, 38, 224, 5.2}, {-66, 44, 260, 4.5}});
    VesselOptions options;
    options.inlet = Vec3::Zero();
    Result<ImportedVessel> vessel = import_curve_set(set, options, progress);
    if (!vessel.ok()) return vessel.error();
    SteveSetup setup{std::move(*vessel), {}, {}, {}, {}};
    const InsideTest inside(setup.vessel.surface);
    for (std::size_t c = 1; c < set.curves.size(); ++c) {
        std::string name = set.curves[c].name;
        std::replace(name.begin(), name.end(), ' ', '_');
        setup.targets += fmt::format("{}\n        \"{}\": {{\"position\": {}}}", setup.targets.empty() ? "" : ",", name,
                                     shown(1e3 * place_before_end(set.curves[c], inside, 2.5e-3)));
    }
    const double inserted = 1e3 * straight_length(setup.vessel, inside, 4.45e-4);
    const std::string place = fmt::format("\"entry\": {{\"position\": {}, \"direction\": {}}}, \"lumen\": \"vessel\", \"inserted\": {:.6g},\n            "
                                          "\"follow\": {{\"target\": \"left_carotid\", \"speed\": 30, \"tolerance\": 5}}",
                                          shown(1e3 * setup.vessel.entry), shown(setup.vessel.direction), inserted);
    setup.instruments = steve_instrument_text({"guide_wire", 450, 0.89, 0, 0.7, 12.1, 0.4 * std::numbers::pi, 80e3, 17e3, 2.1e-5, 0.1}, "", place, setup.notes);
    setup.notes.emplace_back("stEVE draws another arch for every episode; this is one of them in kind, and not one of its files");
    return setup;
}

std::string steve_scene_text(const SteveSetup& setup, const ImportSource& source) {
    return fmt::format("{{\n    \"name\": \"{}\",\n    \"units\": {{\"length\": \"mm\", \"pressure\": \"MPa\"}},\n    \"time\": {{\"step\": 0.006, \"duration\": 30}},\n"
                       "    \"budget\": {{\"limit\": \"6ms\"}},\n    \"bodies\": {{\n"
                       "        \"vessel\": {{\"kind\": \"static\", \"hollow\": true, \"surface\": {{\"file\": \"{}\", \"unit\": \"mm\"}}}}\n    }},\n"
                       "    \"instruments\": {{\n{}\n    }},\n    \"targets\": {{{}\n    }},\n"
                       "    \"effects\": [\"coarse_contact\", \"exact_contact\", \"friction\"],\n    \"outputs\": {{\"pictures\": 2}}\n}}\n",
                       source.name, import_name::kSurface, setup.instruments, setup.targets);
}

} // namespace trocar::engine
