#include "engine/scene/scene_table.hpp"

#include "engine/scene/describe_body.hpp"
#include "engine/scene/describe_contact.hpp"
#include "engine/scene/describe_effects.hpp"
#include "engine/scene/describe_instrument.hpp"
#include "engine/scene/describe_run.hpp"

namespace trocar::engine {
namespace {

FieldSpec unit_field(std::string_view key, Dimension dimension, std::string_view doc) {
    std::vector<std::string_view> names;
    for (const UnitName& unit : known_units(dimension)) names.push_back(unit.name);
    FieldSpec field = choice_field(key, std::move(names), doc);
    field.value.dimension = dimension;
    return field;
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

namespace {

/// What no part of the reader can say alone: read_scene.cpp reads each after those that it refers to.
struct SceneKeys {
    using Struct = Scene;
    static auto of(auto& s) {
        const auto& effects = effects_table();
        return described(
            {"scene", "The whole file."}, custom_key(text_field("$schema", "Where editors find the schema; not read."), kReadApart),
            custom_key(text_field("name", "Of the scene; the file's name when absent."), kReadApart, s.name),
            custom_key(object_field("units", units_table(), "Units of all numbers in this file.").required(), kReadApart, s.units),
            object_key<TimeKeys>(s.time, object_field("time", table_of<TimeKeys>(), "Steps and duration.").required()),
            custom_key(value_field("budget", any_value({text_field("", "").value, object_value(table_of<BudgetKeys>())}),
                                   "Of a step: a limit, or an object with limit and scope.")
                           .by_default(std::string_view("exact")),
                       kReadApart, s.budget),
            key(s.gravity, vector_field("gravity", Dimension::Acceleration, between(-1000.0, 1000.0),
                                        "Free fall, as in [0, 0, -9810] with lengths in mm.")),
            object_key<ContactKeys>(s.contact, object_field("contact", table_of<ContactKeys>(), "Contact and response.")),
            object_key<CostKeys>(s.cost, object_field("cost", table_of<CostKeys>(), "Comparison of contacts between runs.")),
            custom_key(map_field("bodies", object_value(table_of<BodyKeys>()), "Organs, vessels, obstacles by name."), kReadApart,
                       s.bodies),
            custom_key(map_field("instruments", object_value(table_of<InstrumentKeys>()), "Catheters and guide wires by name."), kReadApart,
                       s.instruments),
            custom_key(map_field("targets", target_value(), "Places to reach, by name."), kReadApart, s.targets),
            custom_key(value_field("effects", any_value({list_value(choice_value(effects.keys()), 0), object_value(effects)}),
                                   "A list of names, or an object by name. When absent: elasticity, damping, coarse_contact, "
                                   "exact_contact and friction, and gravity where it is given."),
                       kReadApart, s.effects),
            object_key<OutputKeys>(s.outputs, object_field("outputs", table_of<OutputKeys>(), "Pictures and recordings.")),
            no_key(s.file, s.questions, s.positions, s.settings));
    }
};
static_assert(describes_all<SceneKeys>);

} // namespace

const ObjectSpec& scene_table() { return table_of<SceneKeys>(); }

} // namespace trocar::engine
