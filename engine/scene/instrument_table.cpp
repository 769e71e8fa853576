#include "engine/scene/scene_table.hpp"

#include "engine/scene/scene.hpp"

namespace trocar::engine {
namespace {

constexpr double kLongestRod = 10.0; // m
constexpr double kMostTurns = 1e4;   // rad of a handle

const ObjectSpec& tip_table() {
    static const fem::RodDesign usual{};
    static const ObjectSpec table{
        "tip",
        "The shaped distal part.",
        "",
        "shape",
        {
            choice_field("shape", {"J", "straight", "simmons", "pigtail"}, "At rest.").by_default(std::string_view("J")),
            number_field("length", Dimension::Length, {5e-4, 0.3, false, 2e-3, 0.15, "shaped tips are 2 to 150 mm long"},
                         "Of the shaped part; a pigtail's is 40 mm when absent.")
                .by_default(usual.tip_length)
                .when({"J", "simmons", "pigtail"}),
            number_field("angle", Dimension::Angle, {0.0, 20.0, true, 0.0, 9.5, "a pigtail turns one and a half times at most"},
                         "Total bend of the shaped part; a pigtail's is 6 rad when absent.")
                .by_default(usual.tip_angle)
                .when({"J", "simmons", "pigtail"}),
            number_field("stiffness", Dimension::None, above(0.0, 10.0), "Modulus of the shaped part over the shaft's.")
                .by_default(usual.tip_stiffness)
                .when({"J", "simmons", "pigtail"}),
        }};
    return table;
}

const ObjectSpec& landmark_entry_table() {
    static const ObjectSpec table{
        "landmark",
        "A named place of a generated patient.",
        "landmark",
        "",
        {
            text_field("landmark", "Such as femoral_entry.").required(),
            text_field("body", "The recipe body it belongs to; needed where the patient is not clear without it."),
        }};
    return table;
}

const ObjectSpec& position_entry_table() {
    static const ObjectSpec table{
        "entry position",
        "A place inside the lumen and the direction into the vessel.",
        "position",
        "",
        {
            vector_field("position", Dimension::Length, coordinate(), "Where the instrument enters.").required(),
            vector_field("direction", Dimension::None, {}, "Into the vessel; its length does not matter.").required(),
        }};
    return table;
}

const ObjectSpec& position_target_table() {
    static const ObjectSpec table{"target position",
                                  "A place.",
                                  "position",
                                  "",
                                  {vector_field("position", Dimension::Length, coordinate(), "In the lumen.").required()}};
    return table;
}

const ObjectSpec& limits_table() {
    static const ObjectSpec table{
        "limits",
        "Limits of the drive commands. Values above a surgeon's must be set here.",
        "",
        "",
        {
            number_field("speed", Dimension::Speed, above(0.0, 10.0), "Of insertion and withdrawal.").by_default(kSurgeonSpeedLimit),
            number_field("rotation", Dimension::AngularSpeed, above(0.0, 1000.0), "Of the handle.").by_default(kSurgeonRotationLimit),
        }};
    return table;
}

const ObjectSpec& follow_table() {
    static const FollowSpec usual{};
    static const ObjectSpec table{
        "follow",
        "The script drives the tip to a target by itself.",
        "",
        "",
        {
            text_field("target", "One of the scene's targets.").required(),
            number_field("speed", Dimension::Speed, above(0.0, 10.0), "Of insertion where the way is straight, at most the limit.")
                .by_default(usual.speed),
            number_field("look_ahead", Dimension::Length, above(0.0, 0.2), "Of the route beyond the tip that the tip is turned to.")
                .by_default(usual.look_ahead),
            number_field("tolerance", Dimension::Length, above(0.0, 0.1), "Distance to the target that counts as arrived.")
                .by_default(usual.tolerance),
        }};
    return table;
}

ValueSpec entry_value() { return any_value({object_value(landmark_entry_table()), object_value(position_entry_table())}); }

ValueSpec path_value() {
    ValueSpec file;
    file.kind = ValueKind::Path;
    const Range turn = between(-kMostTurns, kMostTurns);
    return any_value({rows_value({{"t", Dimension::Time, between(0.0, 1e6)},
                                  {"insertion", Dimension::Length, between(0.0, kLongestRod)},
                                  {"rotation", Dimension::Angle, turn}},
                                 1, 1000000),
                      file});
}

} // namespace

ValueSpec target_value() { return any_value({object_value(landmark_entry_table()), object_value(position_target_table())}); }

const ObjectSpec& instrument_table() {
    static const fem::RodDesign usual{};
    static const SceneInstrument instrument{};
    static const ObjectSpec table{
        "instrument",
        "A catheter or guide wire.",
        "",
        "",
        {
            choice_field("kind", {"rod", "mass_spring"},
                         "rod: bending and stretch, solved implicitly. mass_spring: the mass-spring chain of Govindaraju et al. 2005, "
                         "with as many explicit sub-steps as its stiffness asks for.")
                .by_default(std::string_view("rod")),
            number_field("length", Dimension::Length, {0.01, kLongestRod, false, 0.1, 4.0, "catheters and guide wires are 0.4 to 3 m long"},
                         "Of the whole instrument.")
                .required(),
            number_field("radius", Dimension::Length, {5e-5, 0.02, false, 1e-4, 5e-3, "guide wires from 0.1 mm, catheters up to 5 mm"},
                         "Outer.")
                .required(),
            number_field("young_modulus", Dimension::Pressure,
                         {1e5, 6e11, false, 1e6, 4.2e11, "polymers are 1 MPa to 4 GPa, nitinol 30 to 80 GPa, steel 200 GPa"},
                         "Of the solid circular section.")
                .by_default(usual.young_modulus),
            number_field("poisson_ratio", Dimension::None, {-1.0, 0.5, true, 0.2, 0.5, "metals are 0.3, polymers 0.35 to 0.5"},
                         "With the effect twist: the shear modulus is E / (2 + 2 nu).")
                .by_default(usual.poisson_ratio),
            value_field(
                "stiffness",
                rows_value({{"from_tip", Dimension::Length, between(0.0, kLongestRod)}, {"factor", Dimension::None, between(1e-4, 1e4)}}, 1,
                           1000),
                "Rows [arc length from the tip, factor of the Young's modulus], linear between them and held beyond; instead of "
                "the tip's stiffness."),
            number_field(
                "density", Dimension::Density,
                {500.0, 23000.0, false, 800.0, 22600.0, "polymers are 900 to 2200 kg/m^3, nitinol 6450, steel 7900, platinum 21450"},
                "Mass per volume.")
                .by_default(usual.density),
            object_field("tip", tip_table(), "Shape of the distal end."),
            number_field("friction", Dimension::None, {0.0, 2.0, false, 0.0, 1.0, "coated catheters are 0.01 to 0.3"},
                         "Coulomb's mu against every wall.")
                .by_default(instrument.friction),
            number_field("min_bend_radius", Dimension::Length, between(0.0, 1.0),
                         "Tighter bends kink it: `plan` refuses ways that need them. 0: not stated.")
                .by_default(instrument.min_bend_radius),
            number_field("segment", Dimension::Length, {1e-4, 0.1, false, 2e-4, 0.02, "short against the vessels' bends"},
                         "Distance of the rod's nodes.")
                .by_default(usual.segment),
            count_field("skin_triangles", 100, 1e6, "Of the dense surface, aimed at.").by_default(double(instrument.skin_triangles)),
            number_field("drag", Dimension::Rate, between(0.0, 1e5), "Mass-proportional damping of the rod.").by_default(usual.drag),
            number_field("whip_drag", Dimension::Viscosity, between(0.0, 1e5), "Transverse drag, per length of rod.")
                .by_default(usual.transverse_drag),
            value_field("entry", entry_value(),
                        "Where it enters the body: a landmark, or a position and a direction. Needed unless it is inside an instrument."),
            text_field("lumen", "Name of the hollow body it is inside of. Needed unless it is inside an instrument."),
            text_field(
                "inside",
                "Name of an instrument above it, of kind rod, in whose bore it runs as a guide wire: with its entry and lumen, pushed "
                "and turned on its own. Where they overlap they share one axis and bend with both stiffnesses."),
            number_field("inserted", Dimension::Length, between(0.0, kLongestRod),
                         "Beyond the entry at the start; the first row's insertion where there is a path, 0 otherwise."),
            object_field("limits", limits_table(), "Of the drive commands: 35 mm/s and 3.14 rad/s when absent."),
            value_field("path", path_value(),
                        "Drive commands: rows [t, insertion, rotation], or the name of a CSV file with such rows "
                        "in the scene's units. A file may move several instruments: its header then names them, as in "
                        "t,catheter.insertion,catheter.rotation,wire.insertion,wire.rotation."),
            object_field("follow", follow_table(), "Instead of a path: drives to a target by itself."),
        }};
    return table;
}

} // namespace trocar::engine
