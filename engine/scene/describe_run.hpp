// Keys of what is not simulated itself: "time", "budget", "cost", "outputs".
#pragma once

#include "engine/scene/describe_fluoroscopy.hpp"
#include "engine/scene/described.hpp"
#include "engine/scene/reader.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

inline constexpr double kLongestRun = 7 * 86400.0; // s

struct PaceKeys {
    using Struct = PaceSpec;
    static auto of(auto& s) {
        return described(
            {"pace", "How simulated time goes against wall time. No step's result depends on it."},
            key(s.speed, number_field("speed", Dimension::None, {1e-3, 1e3, false, 0.01, 10.0, "1 is real time"},
                                      "Simulated seconds in a second: 1 is real time, 0.25 a quarter of it.")),
            key(s.late, choice_field("late", {"slow_motion", "catch_up"},
                                     "A step that begins too late: the run stays behind by as much, or the next steps do not wait until "
                                     "it has caught up. Both are counted.")));
    }
};
static_assert(describes_all<PaceKeys>);

struct TimeKeys {
    using Struct = TimeSpec;
    static auto of(auto& s) {
        return described(
            {"time", "How far and how finely the scene is simulated."},
            key(s.step, number_field("step", Dimension::Time, above(0.0, 1.0), "Length of a step of the whole engine.").required()),
            key(s.duration, number_field("duration", Dimension::Time, above(0.0, kLongestRun), "Simulated time of a run.").required()),
            custom_key(value_field("substeps", any_value({choice_value({"auto"}), count_field("", 1, 100000, "").value}),
                                   "Sub-steps of the tissue's integration in a step; \"auto\" takes as many as stability asks for. A number is the "
                                   "least: one that is too small for the tissue at rest is refused; where stability asks for more during a run, "
                                   "as many are taken, and counted (raised_bodies).")
                           .by_default(std::string_view("auto")),
                       read_substeps, s.substeps),
            key(s.max_substeps, count_field("max_substeps", 1, 1e6, "A run whose tissue needs more sub-steps than this is stopped.")),
            key(s.integrator, choice_field("integrator", {"auto", "rk4", "leapfrog", "implicit"},
                                           "Of the tissue: Runge-Kutta 4, leapfrog with a third of its evaluations and second order, or an implicit rule of second "
                                           "order that takes one sub-step as a rule, however stiff or thin the tissue is, and damps what is faster. auto: rk4, but implicit for held "
                                           "bodies of which a step would have more than 100 sub-steps; explain says which. A wall and the organ that it is joined to take leapfrog "
                                           "instead of rk4.")),
            object_key<PaceKeys>(
                s.pace, object_field("pace", table_of<PaceKeys>(), "When steps of a run begin; as soon as they can when absent.")));
    }
};
static_assert(describes_all<TimeKeys>);

struct BudgetKeys {
    using Struct = BudgetSpec;
    static auto of(auto& s) {
        return described(
            {"budget", "What a step may cost."},
            custom_key(
                text_field("limit", "A time (\"8ms\", \"250us\"), a number of sphere-pair tests (\"work:20000\") or \"exact\".").required(),
                read_limit, s.limits),
            key(s.scope, choice_field("scope", {"collision", "step"}, "What the budget pays for: all that contact costs, or the whole step.")),
            custom_key(value_field("drop", list_value(choice_value({"exact_contact", "elasticity"}), 0),
                                   "With the scope \"step\": what a step leaves out when its forecast does not fit, first to go "
                                   "first. Without elasticity the tissue stands still for that step."),
                       read_drop, s.drop));
    }
};
static_assert(describes_all<BudgetKeys>);

struct CostKeys {
    using Struct = CostSpec;
    static auto of(auto& s) {
        return described(
            {"cost", "How the command cost compares contacts under a budget with the exact ones."},
            key(s.from, number_field("from", Dimension::Time, between(0.0, 1e6),
                                     "Simulated time at which the compared stretch begins: until then the exact run goes alone, for all.")),
            key(s.patch, number_field("patch", Dimension::Length, above(0.0, 1.0),
                                      "Edge of the cells that a surface is cut into; contacts are the same when their cell is. When "
                                      "absent: four times the surface's mean edge.")),
            key(s.tolerance, number_field("tolerance", Dimension::Length, above(0.0, 0.05),
                                          "Solids whose spheres come nearer than this are in contact; the contact margin when absent, "
                                          "which is also as far as contacts are searched for.")));
    }
};
static_assert(describes_all<CostKeys>);

struct PictureKeys {
    using Struct = PictureSpec;
    static auto of(auto& s) {
        return described(
            {"picture", "One picture of the run."},
            key(s.view, choice_field("view", {"anatomy", "tip", "fluoroscopy"},
                                     "The whole patient, the surroundings of the tip, or an X-ray (needs the effect fluoroscopy).")
                            .required()),
            key(s.time, number_field("time", Dimension::Time, between(0.0, kLongestRun), "When, at most the duration.").required()));
    }
};
static_assert(describes_all<PictureKeys>);

struct PackingKeys {
    using Struct = PackingSpec;
    static auto of(auto& s) {
        return described({"packing", "A ball, as an aneurysm's sac is one, of which instruments fill a share: packing_density in steps.csv and summary.json."},
                         key(s.centre, vector_field("centre", Dimension::Length, coordinate(), "Middle.").required()),
                         key(s.radius, number_field("radius", Dimension::Length, above(0.0, 1.0), "Of the ball.").required()));
    }
};
static_assert(describes_all<PackingKeys>);

struct OutputKeys {
    using Struct = OutputSpec;
    static auto of(auto& s) {
        const Range edge = between(16, 8192); // pixels, as the renderer allows
        ValueSpec size;
        size.kind = ValueKind::Vector;
        size.columns = {{"width", Dimension::None, edge}, {"height", Dimension::None, edge}};
        return described(
            {"outputs", "What a run leaves behind besides its tables and report."},
            custom_key(value_field("pictures",
                                   any_value({count_field("", 0, 1000, "").value, list_value(object_value(table_of<PictureKeys>()), 0)}),
                                   "How many pictures, spread evenly over the run, or a list of them; 0 when absent."),
                       read_pictures, s.pictures),
            custom_key(value_field("size", std::move(size), "Of a picture in pixels, 1280 x 720 when absent."), read_picture_size, s.width,
                       s.height),
            key(s.record_every,
                count_field("record_every", 0, 1e9, "Steps between recorded states; 0 records none unless the command line asks.")),
            object_key<PackingKeys>(s.packing, object_field("packing", table_of<PackingKeys>(), "Which share of a ball the instruments fill.")),
            object_key<FluoroscopyKeys>(
                s.fluoroscopy,
                object_field("fluoroscopy", table_of<FluoroscopyKeys>(), "X-ray frames of a C-arm, in the folder fluoro; none when absent.")));
    }
};
static_assert(describes_all<OutputKeys>);

} // namespace trocar::engine
