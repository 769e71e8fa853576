#include "engine/scene/scene_table.hpp"

#include "engine/scene/describe_contact.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {
namespace {

constexpr double kLongestRun = 7 * 86400.0; // s
constexpr double kMostPixels = 8192.0;      // of a picture's edge, as the renderer allows

FieldSpec unit_field(std::string_view key, Dimension dimension, std::string_view doc) {
    std::vector<std::string_view> names;
    for (const UnitName& unit : known_units(dimension)) names.push_back(unit.name);
    FieldSpec field = choice_field(key, std::move(names), doc);
    field.value.dimension = dimension;
    return field;
}

const ObjectSpec& pace_table() {
    static const PaceSpec usual{};
    static const ObjectSpec table{
        "pace",
        "How simulated time goes against wall time. No step's result depends on it.",
        "",
        "",
        {
            number_field("speed", Dimension::None, {1e-3, 1e3, false, 0.01, 10.0, "1 is real time"},
                         "Simulated seconds in a second: 1 is real time, 0.25 a quarter of it.")
                .by_default(usual.speed),
            choice_field("late", {"slow_motion", "catch_up"},
                         "A step that begins too late: the run stays behind by as much, or the next steps do not wait until it has caught "
                         "up. Both are counted.")
                .by_default(std::string_view("slow_motion")),
        }};
    return table;
}

const ObjectSpec& time_table() {
    static const ObjectSpec table{
        "time",
        "How far and how finely the scene is simulated.",
        "",
        "",
        {
            number_field("step", Dimension::Time, above(0.0, 1.0), "Length of a step of the whole engine.").required(),
            number_field("duration", Dimension::Time, above(0.0, kLongestRun), "Simulated time of a run.").required(),
            value_field("substeps", any_value({choice_value({"auto"}), count_field("", 1, 100000, "").value}),
                        "Sub-steps of the tissue's integration in a step; \"auto\" takes as many as stability asks for.")
                .by_default(std::string_view("auto")),
            count_field("max_substeps", 1, 1e6, "A run whose tissue needs more sub-steps than this is stopped.")
                .by_default(double(TimeSpec{}.max_substeps)),
            choice_field("integrator", {"rk4", "leapfrog"},
                         "Of the tissue: Runge-Kutta 4, or leapfrog with a third of its evaluations and second order.")
                .by_default(std::string_view("rk4")),
            value_field("pace", object_value(pace_table()), "When steps of a run begin; as soon as they can when absent."),
        }};
    return table;
}

const ObjectSpec& budget_table() {
    static const ObjectSpec table{
        "budget",
        "What a step may cost.",
        "",
        "",
        {
            text_field("limit", "A time (\"8ms\", \"250us\"), a number of sphere-pair tests (\"work:20000\") or \"exact\".").required(),
            choice_field("scope", {"collision", "step"}, "What the budget pays for: collision detection, or the whole step.")
                .by_default(std::string_view("collision")),
            value_field("drop", list_value(choice_value({"exact_contact", "elasticity"}), 0),
                        "With the scope \"step\": what a step leaves out when its forecast does not fit, first to go "
                        "first. Without elasticity the tissue stands still for that step."),
        }};
    return table;
}

const ObjectSpec& cost_table() {
    static const ObjectSpec table{
        "cost",
        "How the command cost compares contacts under a budget with the exact ones.",
        "",
        "",
        {
            number_field("patch", Dimension::Length, above(0.0, 1.0),
                         "Edge of the cells that a surface is cut into; contacts are the same when their cell is. When "
                         "absent: four times the surface's mean edge."),
            number_field("tolerance", Dimension::Length, above(0.0, 0.05),
                         "Solids whose spheres come nearer than this are in contact; the contact margin when absent, which is "
                         "also as far as contacts are searched for."),
        }};
    return table;
}

const ObjectSpec& breathing_table() {
    static const BreathingSpec usual{};
    static const ObjectSpec table{
        "breathing",
        "Moves the fixed nodes of every deformable body there and back once a period.",
        "",
        "",
        {
            number_field("amplitude", Dimension::Length, above(0.0, 0.1), "End to end.").by_default(usual.amplitude),
            number_field("period", Dimension::Time, {0.5, 60.0, false, 2.0, 10.0, "adults at rest breathe in 3 to 6 s"}, "Of a breath.")
                .by_default(usual.period),
            vector_field("direction", Dimension::None, {}, "Of the movement; its length does not matter.").by_default(usual.direction),
        }};
    return table;
}

const ObjectSpec& picture_table() {
    static const ObjectSpec table{
        "picture",
        "One picture of the run.",
        "",
        "",
        {
            choice_field("view", {"anatomy", "tip", "fluoroscopy"},
                         "The whole patient, the surroundings of the tip, or an X-ray (needs the effect fluoroscopy).")
                .required(),
            number_field("time", Dimension::Time, between(0.0, kLongestRun), "When, at most the duration.").required(),
        }};
    return table;
}

const ObjectSpec& outputs_table() {
    static const OutputSpec usual{};
    static const ObjectSpec table = [] {
        ValueSpec size;
        size.kind = ValueKind::Vector;
        size.columns = {{"width", Dimension::None, between(16, kMostPixels)}, {"height", Dimension::None, between(16, kMostPixels)}};
        return ObjectSpec{
            "outputs",
            "What a run leaves behind besides its tables and report.",
            "",
            "",
            {
                value_field("pictures", any_value({count_field("", 0, 1000, "").value, list_value(object_value(picture_table()), 0)}),
                            "How many pictures, spread evenly over the run, or a list of them; 0 when absent."),
                value_field("size", std::move(size), "Of a picture in pixels, 1280 x 720 when absent."),
                count_field("record_every", 0, 1e9, "Steps between recorded states; 0 records none unless the command line asks.")
                    .by_default(double(usual.record_every)),
            }};
    }();
    return table;
}

} // namespace

const ObjectSpec& units_table() {
    static const ObjectSpec table{
        "units",
        "What the numbers of this file are measured in. Compound units follow: a speed is in length/time.",
        "",
        "",
        {
            unit_field("length", Dimension::Length, "Of every position, radius, distance.").required(),
            unit_field("time", Dimension::Time, "Of steps, durations, periods.").by_default(std::string_view("s")),
            unit_field("angle", Dimension::Angle, "Of rotations and tip angles.").by_default(std::string_view("rad")),
            unit_field("pressure", Dimension::Pressure, "Of Young's moduli; a viscosity is in pressure * time.")
                .by_default(std::string_view("Pa")),
            unit_field("density", Dimension::Density, "Of materials.").by_default(std::string_view("kg/m^3")),
            unit_field("force", Dimension::Force, "A stiffness is in force/length.").by_default(std::string_view("N")),
        }};
    return table;
}

const ObjectSpec& pulse_table() {
    static const PulseSpec usual{};
    static const ObjectSpec table{
        "pulse",
        "The walls of hollow bodies widen and narrow, along their outward normals.",
        "",
        "",
        {
            number_field("amplitude", Dimension::None, {0.0, 0.3, false, 0.0, 0.1, "large arteries widen by 3 to 10 %"},
                         "Share of the local radius, from diastole to systole.")
                .by_default(usual.amplitude),
            number_field("period", Dimension::Time, {0.2, 5.0, false, 0.4, 1.5, "40 to 150 beats a minute"}, "Of a beat.")
                .by_default(usual.period),
        }};
    return table;
}

const ObjectSpec& blood_table() {
    static const BloodSpec usual{};
    static const ObjectSpec table{
        "blood_drag",
        "Blood flows from the inlet into every branch of the vessels that instruments move in, and drags them along. Branches share it "
        "by the cubes of their ends' radii (Murray's law); it is twice as fast in a vessel's middle as on average (Poiseuille).",
        "",
        "",
        {
            number_field("speed", Dimension::Speed, {0.0, 5.0, false, 0.005, 1.5, "means are 0.1 to 0.3 m/s in large arteries"},
                         "At the inlet, mean over the cross-section and over time.")
                .by_default(usual.speed),
            number_field("density", Dimension::Density, {500.0, 2000.0, false, 990.0, 1080.0, "water is 993, blood 1060 kg/m^3"},
                         "Of the blood.")
                .by_default(usual.density),
            number_field("viscosity", Dimension::Viscosity, {1e-5, 1.0, false, 7e-4, 1e-2, "water is 0.7, whole blood 3 to 4 mPa s"},
                         "Of the blood.")
                .by_default(usual.viscosity),
            number_field("pulsatility", Dimension::None, between(0.0, 3.0),
                         "Share of the mean speed by which the blood is faster and slower within a beat; needs the effect pulse, and is "
                         "fastest when that has widened the walls.")
                .by_default(usual.pulsatility),
            value_field(
                "inlet", target_value(),
                "Where the blood comes in. When absent: the end of the vessel behind the instrument's entry, so that it flows along it."),
        }};
    return table;
}

const std::vector<std::string_view>& effect_names() {
    static const std::vector<std::string_view> names = effects_table().keys();
    return names;
}

const ObjectSpec& effects_table() {
    static const ObjectSpec table{
        "effects",
        "What is simulated, by name; whatever is not named is off.",
        "",
        "",
        {
            flag_field("elasticity", "Deformable bodies deform; off, they stay at rest.").by_default(false),
            flag_field("gravity", "Weight, as the key gravity says.").by_default(false),
            flag_field("damping", "Viscosity and mass damping of the materials.").by_default(false),
            flag_field("coarse_contact", "Contacts by sphere trees, interrupted by the budget.").by_default(false),
            flag_field("exact_contact", "Continuous contacts, when the budget allows.").by_default(false),
            flag_field("friction", "Coulomb friction of instruments on walls, by each instrument's key friction; the wall feels it too.")
                .by_default(false),
            value_field("breathing", any_value({flag_field("", "").value, object_value(breathing_table())}),
                        "Respiration: true for the defaults.")
                .by_default(false),
            value_field("pulse", any_value({flag_field("", "").value, object_value(pulse_table())}),
                        "Arterial pulse: true for the defaults.")
                .by_default(false),
            flag_field("self_contact", "Solid bodies against themselves, where their leaf spheres lay apart at rest; needs coarse_contact.")
                .by_default(false),
            flag_field("twist", "Torsion of instruments: a turn of the handle travels along them; off, it reaches the tip at once.")
                .by_default(false),
            value_field("blood_drag", any_value({flag_field("", "").value, object_value(blood_table())}),
                        "Drag of the blood on instruments: true for the defaults.")
                .by_default(false),
            flag_field("fluoroscopy", "X-ray pictures.").by_default(false),
        }};
    return table;
}

const ObjectSpec& scene_table() {
    static const Range gravity = between(-1000.0, 1000.0);
    static const ObjectSpec table{
        "scene",
        "The whole file.",
        "",
        "",
        {
            text_field("$schema", "Where editors find the schema; not read."),
            text_field("name", "Of the scene; the file's name when absent."),
            object_field("units", units_table(), "Units of all numbers in this file.").required(),
            object_field("time", time_table(), "Steps and duration.").required(),
            value_field("budget", any_value({text_field("", "").value, object_value(budget_table())}),
                        "Of a step: a limit, or an object with limit and scope.")
                .by_default(std::string_view("exact")),
            vector_field("gravity", Dimension::Acceleration, gravity, "Free fall, as in [0, 0, -9810] with lengths in mm.")
                .by_default(Vec3(0, 0, 0)),
            object_field("contact", table_of<ContactKeys>(), "Contact and response."),
            object_field("cost", cost_table(), "Comparison of contacts between runs."),
            map_field("bodies", object_value(body_table()), "Organs, vessels, obstacles by name."),
            map_field("instruments", object_value(instrument_table()), "Catheters and guide wires by name."),
            map_field("targets", target_value(), "Places to reach, by name."),
            value_field("effects", any_value({list_value(choice_value(effects_table().keys()), 0), object_value(effects_table())}),
                        "A list of names, or an object by name. When absent: elasticity, damping, coarse_contact and "
                        "exact_contact, and gravity where it is given."),
            object_field("outputs", outputs_table(), "Pictures and recordings."),
        }};
    return table;
}

} // namespace trocar::engine
