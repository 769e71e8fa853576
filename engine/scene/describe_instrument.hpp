// Keys of an instrument: its rod, where it enters, what moves it.
#pragma once

#include "engine/scene/describe_place.hpp"

namespace trocar::engine {

inline constexpr double kLongestRod = 10.0; // m

struct TipKeys {
    using Struct = fem::RodDesign;
    static auto of(auto& s) {
        using Shape = fem::TipShape;
        return described(
            {"tip", "The shaped distal part.", "", "shape", "device"},
            key(s.tip,
                choice_field<Shape>(
                    "shape", {{"J", Shape::J}, {"straight", Shape::Straight}, {"simmons", Shape::Simmons}, {"pigtail", Shape::Pigtail}, {"curve", Shape::Curve}},
                    "At rest. A straight tip is as stiff as the shaft, unless the instrument's key stiffness says otherwise. A curve is told by "
                    "arcs or points.")),
            key(s.tip_length, number_field("length", Dimension::Length, {5e-4, 1.0, false, 2e-3, 0.3, "shaped tips are 2 to 150 mm long, coils up to 300"},
                                           "Of the shaped part; a pigtail's is 40 mm when absent.")
                                  .when({"J", "simmons", "pigtail"})),
            key(s.tip_angle,
                number_field("angle", Dimension::Angle, {0.0, 1000.0, true, 0.0, 300.0, "a pigtail turns one and a half times, a coil of 300 mm and 4 mm across 150 rad"},
                             "Total bend of the shaped part; a pigtail's is 6 rad when absent. A coil is a pigtail of many turns.")
                    .when({"J", "simmons", "pigtail"})),
            key(s.tip_stiffness,
                number_field("stiffness", Dimension::None, above(0.0, 10.0), "Modulus of the shaped part over the shaft's; a curve's is 1 when absent.")
                    .when({"J", "simmons", "pigtail", "curve"})),
            custom_key(value_field("arcs",
                                   rows_value({{"length", Dimension::Length, above(0.0, 0.5)},
                                               {"angle", Dimension::Angle, between(-200.0, 200.0)},
                                               {"plane", Dimension::Angle, between(-10.0, 10.0)}},
                                              1, 1000),
                                   "Rows [length, angle, plane] from the shaft to the tip: straight pieces (angle 0) and arcs. Plane is the side "
                                   "to which an arc turns, about the rod's axis: 0 everywhere is a flat shape, and a negative angle turns back.")
                           .when({"curve"}),
                       read_arcs, s.arcs),
            custom_key(value_field("points", rows_value({{"x", Dimension::Length, coordinate()}, {"y", Dimension::Length, coordinate()}, {"z", Dimension::Length, coordinate()}}, 3, 1000),
                                   "In place of arcs: places on the tip's line from the shaft to the tip, in any frame. A spline goes through them; "
                                   "the handle at 0 turns the last one to where a J points.")
                           .when({"curve"}),
                       kReadApart));
    }
};

struct LimitKeys {
    using Struct = DriveLimits;
    static auto of(auto& s) {
        return described({"limits", "Limits of the drive commands. Values above a surgeon's must be set here."},
                         key(s.speed, number_field("speed", Dimension::Speed, above(0.0, 10.0), "Of insertion and withdrawal.")),
                         key(s.rotation, number_field("rotation", Dimension::AngularSpeed, above(0.0, 1000.0), "Of the handle.")));
    }
};
static_assert(describes_all<LimitKeys>);

/// Part of the keys of "follow".
struct FollowSettingKeys {
    using Struct = FollowSettings;
    static auto of(auto& s) {
        return described({"follow", "The script drives the tip."},
                         key(s.speed, number_field("speed", Dimension::Speed, above(0.0, 10.0),
                                                   "Of insertion where the way is straight, at most the limit.")),
                         key(s.look_ahead, number_field("look_ahead", Dimension::Length, above(0.0, 0.2),
                                                        "Of the route beyond the tip that the tip is turned to.")),
                         key(s.tolerance, number_field("tolerance", Dimension::Length, above(0.0, 0.1),
                                                       "Distance to the target that counts as arrived.")));
    }
};
static_assert(describes_all<FollowSettingKeys>);

struct FollowKeys {
    using Struct = FollowSpec;
    static auto of(auto& s) {
        return described({"follow", "The script drives the tip to a target by itself."},
                         custom_key(text_field("target", "One of the scene's targets.").required(), read_follow_target, s.target),
                         inline_keys<FollowSettingKeys>(s.settings));
    }
};
static_assert(describes_all<FollowKeys>);

/// Drive commands: rows, or a file of them.
[[nodiscard]] inline ValueSpec path_value() {
    constexpr double kMostTurns = 1e4; // rad of a handle
    ValueSpec file;
    file.kind = ValueKind::Path;
    return any_value({rows_value({{"t", Dimension::Time, between(0.0, 1e6)},
                                  {"insertion", Dimension::Length, between(0.0, kLongestRod)},
                                  {"rotation", Dimension::Angle, between(-kMostTurns, kMostTurns)}},
                                 1, 1000000),
                      file});
}

struct TipLoadKeys {
    using Struct = TipLoad;
    static auto of(auto& s) {
        return described({"tip_load", "A force and a torque on the tip, with the effect loads; one of them at least."},
                         key(s.force, vector_field("force", Dimension::Force, between(-1e3, 1e3), "It does not turn with the tip.")),
                         key(s.torque, number_field("torque", Dimension::Torque, between(-10.0, 10.0),
                                                    "About the tip's own axis, with which it turns; needs the effect twist.")),
                         custom_key(value_field("over", rows_over_time({"factor", Dimension::None, between(-1e6, 1e6)}),
                                                "Factor over time, linear between rows, held before the first and after the last; a step takes that of its "
                                                "end. 1 when absent."),
                                    read_over, s.over));
    }
};
static_assert(describes_all<TipLoadKeys>);

struct TipClampKeys {
    using Struct = TipClamp;
    static auto of(auto& s) {
        return described(
            {"tip_clamp", "What holds the last segment of the rod, from its middle on, where it is at the start, and moves it: turned about its own "
                          "axis, then about a line, then displaced. It is there without any effect, and not for a rod in another's bore or with a "
                          "wire in its own. The rod touches neither itself nor other instruments."},
            key(s.slides, flag_field("slides", "Along its own axis it is free: a force of tip_load pulls there.")),
            key(s.spins, flag_field("spins", "About its own axis it is free: a torque of tip_load turns it.")),
            custom_key(value_field("rotation", rows_over_time({"angle", Dimension::Angle, between(-1e6, 1e6)}),
                                   "Angle about its own axis over time, linear between rows; needs the effect twist."),
                       read_rotation, s.rotation),
            custom_key(value_field("moves", displacement_rows(), "Displacement over time, linear between rows; it rests when absent."), read_moves,
                       s.moves),
            custom_key(value_field("turns", rows_over_time({"angle", Dimension::Angle, between(-1e6, 1e6)}),
                                   "Angle over time, linear between rows, about the line through turn_point along turn_axis; before moves."),
                       read_turns, s.turns),
            key(s.point, vector_field("turn_point", Dimension::Length, coordinate(), "On the line of turns.")),
            direction_key(s.axis, vector_field("turn_axis", Dimension::None, {}, "Along that line; its length does not matter.")));
    }
};
static_assert(describes_all<TipClampKeys>);

struct InstrumentKeys {
    using Struct = SceneInstrument;
    static auto of(auto& s) {
        auto& rod = s.design;
        return described(
            {"instrument", "A catheter or guide wire."},
            custom_key(text_field("device", "What it begins as: a name of the catalogue, which `trocar devices` lists, or a device file, FILE.json. The "
                                            "other keys replace those of the device one by one."),
                       kReadApart, s.device, s.device_file),
            key(s.kind, choice_field("kind", {"rod", "mass_spring"},
                                     "rod: bending and stretch, solved implicitly. mass_spring: the mass-spring chain of Govindaraju et "
                                     "al. 2005, with as many explicit sub-steps as its stiffness asks for.")),
            key(rod.length, number_field("length", Dimension::Length,
                                         {0.01, kLongestRod, false, 0.1, 4.0, "catheters and guide wires are 0.4 to 3 m long"},
                                         "Of the whole instrument. Needed without a device.")
                                .default_in_doc()),
            key(rod.radius, number_field("radius", Dimension::Length,
                                         {5e-5, 0.02, false, 1e-4, 5e-3, "guide wires from 0.1 mm, catheters up to 5 mm"}, "Outer. Needed without a device.")
                                .default_in_doc()),
            key(s.inner_radius, number_field("inner_radius", Dimension::Length, between(0.0, 0.02),
                                             "Of the bore. It bends, stretches, twists and weighs as the tube does; a wire in it must be thinner.")),
            custom_key(value_field("layers",
                                   rows_value({{"outer_radius", Dimension::Length, above(0.0, 0.02)},
                                               {"young_modulus", Dimension::Pressure, between(1e5, 6e11)},
                                               {"density", Dimension::Density, between(500.0, 23000.0)}},
                                              1, 20),
                                   "Rows [outer radius, Young's modulus, density] from the inside out, in place of young_modulus and density; "
                                   "the last one ends at radius."),
                       read_layers, s.layers),
            key(rod.young_modulus,
                number_field("young_modulus", Dimension::Pressure,
                             {1e5, 6e11, false, 1e6, 4.2e11, "polymers are 1 MPa to 4 GPa, nitinol 30 to 80 GPa, steel 200 GPa"},
                             "Of its material.")),
            key(rod.poisson_ratio,
                number_field("poisson_ratio", Dimension::None, {-1.0, 0.5, true, 0.2, 0.5, "metals are 0.3, polymers 0.35 to 0.5"},
                             "With the effect twist: the shear modulus is E / (2 + 2 nu).")),
            custom_key(value_field("stiffness",
                                   rows_value({{"from_tip", Dimension::Length, between(0.0, kLongestRod)},
                                               {"factor", Dimension::None, between(1e-4, 1e4)}},
                                              1, 1000),
                                   "Rows [arc length from the tip, factor of the Young's modulus], linear between them and held beyond; "
                                   "instead of the tip's stiffness."),
                       read_stiffness, rod.stiffness),
            key(rod.density, number_field("density", Dimension::Density,
                                          {500.0, 23000.0, false, 800.0, 22600.0,
                                           "polymers are 900 to 2200 kg/m^3, nitinol 6450, steel 7900, platinum 21450"},
                                          "Mass per volume.")),
            part_key<TipKeys>(rod, object_field("tip", table_of<TipKeys>(), "Shape of the distal end.")),
            custom_key(value_field("coating",
                                   rows_value({{"from_tip", Dimension::Length, between(0.0, kLongestRod)},
                                               {"factor", Dimension::None, between(1e-3, 1e3)}},
                                              1, 1000),
                                   "Rows [arc length from the tip, factor of the friction against walls], linear between them and held beyond: "
                                   "a hydrophilic tip."),
                       read_coating, rod.coating),
            key(s.friction, number_field("friction", Dimension::None, {0.0, 2.0, false, 0.0, 1.0, "coated catheters are 0.01 to 0.3"},
                                         "Coulomb's mu against every wall.")),
            key(s.self_contact, flag_field("self_contact", "Whether the rod touches itself, where the scene has that effect. One that shares its axis "
                                                           "with another, and a mass-spring chain, do not.")),
            key(s.detachable, flag_field("detachable", "Its drive may push it wholly out of its port, as a coil: from then on nothing holds it, and its drive commands "
                                                       "do nothing. An instrument below it that enters at the same place waits in the port until then. A rod "
                                                       "in no bore and with no wire in its own; it twists, whatever the effects.")),
            key(s.min_bend_radius, number_field("min_bend_radius", Dimension::Length, between(0.0, 1.0),
                                                "Tighter bends kink it: `plan` refuses ways that need them. 0: not stated.")),
            key(rod.segment, number_field("segment", Dimension::Length, {1e-4, 0.1, false, 2e-4, 0.02, "short against the vessels' bends"},
                                          "Distance of the rod's nodes.")),
            key(s.skin_triangles, count_field("skin_triangles", 100, 1e6, "Of the dense surface, aimed at.")),
            key(rod.drag, number_field("drag", Dimension::Rate, between(0.0, 1e5), "Mass-proportional damping of the rod.")),
            key(rod.transverse_drag,
                number_field("whip_drag", Dimension::None, between(0.0, 1e5),
                             "N s/m^2 in any units: transverse drag, per length of rod. 0.03 is blood's.")),
            custom_key(value_field("entry", entry_value(),
                                   "Where it enters the body: a landmark, or a position and a direction. Needed unless it is inside an "
                                   "instrument."),
                       kReadApart, s.entry),
            custom_key(text_field("lumen", "Name of the hollow body it is inside of. Needed unless it is inside an instrument."),
                       kReadApart, s.lumen),
            custom_key(text_field("inside",
                                  "Name of an instrument above it, of kind rod, in whose bore it runs as a guide wire: with its entry and "
                                  "lumen, pushed and turned on its own. See play."),
                       kReadApart, s.inside),
            key(s.play, flag_field("play", "Of a rod inside an instrument with an inner_radius: it has play in that bore and rests on its wall, with friction. "
                                           "Without, or where no bore is stated, both share one axis where they overlap and bend with both "
                                           "stiffnesses, without friction.")),
            key(s.inserted, number_field("inserted", Dimension::Length, between(0.0, kLongestRod),
                                         "Beyond the entry at the start; the first row's insertion where there is a path, 0 otherwise.")
                                .default_in_doc()),
            object_key<LimitKeys>(
                s.limits, object_field("limits", table_of<LimitKeys>(), "Of the drive commands: 35 mm/s and 3.14 rad/s when absent.")),
            object_key<TipLoadKeys>(s.tip_load, object_field("tip_load", table_of<TipLoadKeys>(), "A force and a torque on the tip; none when absent.")),
            object_key<TipClampKeys>(s.tip_clamp, object_field("tip_clamp", table_of<TipClampKeys>(), "Holds the tip; it is free when absent.")),
            custom_key(value_field("path", path_value(),
                                   "Drive commands: rows [t, insertion, rotation], or the name of a CSV file with such rows "
                                   "in the scene's units. A file may move several instruments: its header then names them, as in "
                                   "t,catheter.insertion,catheter.rotation,wire.insertion,wire.rotation."),
                       kReadApart, s.path, s.path_file),
            object_key<FollowKeys>(s.follow,
                                   object_field("follow", table_of<FollowKeys>(), "Instead of a path: drives to a target by itself.")),
            no_key(s.name, rod.torsion, rod.stretch_factor, rod.turn_factor)); // its key in the scene's map; the effect twist; of the section
    }
};
static_assert(describes_all_with<fem::RodDesign, InstrumentKeys, TipKeys>);

} // namespace trocar::engine
