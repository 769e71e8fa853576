#include "engine/experiments/plan_files.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/path_csv.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/report/gnuplot.hpp"
#include "engine/report/html.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/report/places.hpp"
#include "engine/report/plot_html.hpp"
#include "engine/report/report_style.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace trocar::engine {

namespace {

const InstrumentModel& instrument_of(const PlanRecord& record) { return record.prepared.model.instruments[kLeadInstrument]; }

std::vector<PathRow> rows_in_units(const PlanRecord& record) {
    const Units& units = record.scene.units;
    std::vector<PathRow> rows;
    for (const DriveRow& row : record.plan.path)
        rows.push_back({row.time / units.time, row.insertion / units.length, row.rotation / units.angle});
    return rows;
}

nlohmann::ordered_json replay_json(const PlanRecord& record) {
    const Replay& replay = record.replay;
    if (replay.steps == 0) return nullptr;
    nlohmann::ordered_json json{{"steps", replay.steps},   {"seconds", replay.seconds}, {"target_distance_m", replay.last},
                                {"least_m", replay.least}, {"most_m", replay.most},     {"lumen_exits", replay.lumen_exits}};
    if (const auto& breathing = record.prepared.model.effects.breathing)
        json["breathing"] = {{"amplitude_m", breathing->amplitude}, {"period_s", breathing->period}};
    return json;
}

std::string centreline_text(const PlanRecord& record) {
    const Route& route = *instrument_of(record).route;
    const double unit = record.scene.units.length;
    std::string text = "x,y,z,radius\n";
    for (std::size_t i = 0; i < route.points.size(); ++i)
        text += fmt::format("{},{},{},{}\n", route.points[i].x() / unit, route.points[i].y() / unit, route.points[i].z() / unit,
                            route.radii[i] / unit);
    return text;
}

OutputJson route_json(const PlanRecord& record) {
    const InstrumentModel& instrument = instrument_of(record);
    return {{"length_m", record.route.length},
            {"points", instrument.route->points.size()},
            {"min_radius_m", record.route.smallest_radius},
            {"min_radius_at_m", record.route.smallest_radius_at},
            {"min_clearance_m", record.route.smallest_radius - instrument.rod.design.radius},
            {"max_curvature_per_m", record.route.sharpest_curvature},
            {"max_curvature_at_m", record.route.sharpest_curvature_at}};
}

#define TROCAR_PLAN_KEY(name, unit, meaning, value)                                                                                        \
    JsonKey<PlanRecord> {                                                                                                                  \
        {name, unit, meaning}, []([[maybe_unused]] const PlanRecord& r) -> OutputJson { return value; }                                                   \
    }
const JsonKey<PlanRecord> kPlanKeys[] = {
    TROCAR_PLAN_KEY("scene", "", "The scene's file, relative to its project.", project_path(r.scene.file)),
    TROCAR_PLAN_KEY("instrument", "", "The instrument that is driven.", instrument_of(r).name),
    TROCAR_PLAN_KEY("target", "", "The target's name.", r.target),
    TROCAR_PLAN_KEY("units", "", "Of `path.csv` and `centreline.csv`: `time`, `length`, `angle`.",
                    (OutputJson{{"time", r.scene.units.time_name}, {"length", r.scene.units.length_name}, {"angle", r.scene.units.angle_name}})),
    TROCAR_PLAN_KEY("arrived", "", "true: the tip came within the tolerance of the target.", r.plan.arrived),
    TROCAR_PLAN_KEY("time_s", "s", "Simulated time of the way.", r.plan.time),
    TROCAR_PLAN_KEY("steps", "", "Rows of `path.csv`, less one.", r.plan.path.size() - 1),
    TROCAR_PLAN_KEY("closest_m", "m", "Nearest that the tip came to the target.", r.plan.closest),
    TROCAR_PLAN_KEY("target_distance_m", "m", "Distance of the tip from the target at the end.", r.plan.last),
    TROCAR_PLAN_KEY("tolerance_m", "m", "Within which the tip has arrived.", instrument_of(r).follow.tolerance),
    TROCAR_PLAN_KEY("replay", "",
                    "The path driven again in the scene as it is: `steps`, `seconds`, `target_distance_m`, `least_m`, `most_m`, `lumen_exits`, "
                    "`breathing`; null where it was not.",
                    replay_json(r)),
    TROCAR_PLAN_KEY("retractions", "", "Times that the instrument was drawn back.", r.plan.retractions),
    TROCAR_PLAN_KEY("lumen_exits", "", "Instrument vertices outside the lumen, over all steps.", r.plan.lumen_exits),
    TROCAR_PLAN_KEY("max_contact_force_n", "N", "Largest normal force on the wall.", r.plan.largest_force),
    TROCAR_PLAN_KEY("route", "",
                    "`length_m`, `points`, `min_radius_m` and `min_radius_at_m` (of the lumen), `min_clearance_m`, `max_curvature_per_m`, "
                    "`max_curvature_at_m`.",
                    route_json(r)),
    TROCAR_PLAN_KEY("version", "", "Of the program.", build_facts().version),
    TROCAR_PLAN_KEY("commit", "", "Of the sources that it was built from.", build_facts().commit),
};
#undef TROCAR_PLAN_KEY

/// Names of files may hold any bytes; JSON is UTF-8.
std::string json_text(const PlanRecord& record) {
    return write_keys<PlanRecord>(kPlanKeys, record).dump(2, ' ', false, OutputJson::error_handler_t::replace) + "\n";
}

std::string route_data(const PlanRecord& record) {
    const InstrumentModel& instrument = instrument_of(record);
    std::string text;
    for (std::size_t i = 0; i < instrument.route->points.size(); ++i)
        text += fmt::format("{} {} {} {}\n", 1e3 * instrument.route->length[i], 1e3 * instrument.route->radii[i],
                            1e3 * (instrument.route->radii[i] - instrument.rod.design.radius), record.route.curvature[i]);
    return text;
}

std::string motion_data(const PlanRecord& record) {
    std::string text;
    for (std::size_t i = 0; i < record.plan.path.size(); ++i)
        text += fmt::format("{} {} {} {}\n", record.plan.path[i].time, 1e3 * record.plan.path[i].insertion, record.plan.path[i].rotation,
                            1e3 * record.plan.progress[i]);
    return text;
}

std::vector<Sketch> make_sketches(const PlanRecord& record) {
    const std::string along = "set xlabel 'along the route [mm]' textcolor rgb '#4b5563' offset 0,0.4\nset yrange [0:*]\n";
    const std::string time = "set xlabel 'time [s]' textcolor rgb '#4b5563' offset 0,0.4\n";
    Sketch room{{"room", "Clearance along the route", "Free radius around the lumen's centreline, and less the instrument's radius.", {}},
                540,
                300,
                along};
    room.commands += "set ylabel 'radius [mm]' textcolor rgb '#4b5563' offset 1,0\nplot 'route.txt' using 1:2 with lines lw 1.8 lc rgb '#2158d6' "
                     "title 'free radius', "
                     "'' using 1:3 with lines lw 1.6 lc rgb '#0f8a6d' title 'clearance'";
    Sketch bend{{"bend", "Curvature of the route", "What the instrument has to bend to, if it stays in the middle.", {}}, 540, 300, along};
    bend.commands +=
        "unset key\nset ylabel 'curvature [1/m]' textcolor rgb '#4b5563' offset 1,0\nplot 'route.txt' using 1:4 with lines lw 1.6 lc rgb '#7c3aed'";
    Sketch hand{{"hand", "Drive commands", "Insertion, and how far the tip is from the target.", {}}, 540, 300, time};
    hand.commands += "set ylabel 'length [mm]' textcolor rgb '#4b5563' offset 1,0\nplot 'motion.txt' using 1:2 with lines lw 1.8 lc rgb '#2158d6' "
                     "title 'inserted', "
                     "'' using 1:4 with lines lw 1.6 lc rgb '#d97706' title 'tip to target'";
    Sketch turn{{"turn", "Rotation of the handle", "", {}}, 540, 300, time};
    turn.commands +=
        "unset key\nset ylabel 'rotation [rad]' textcolor rgb '#4b5563' offset 1,0\nplot 'motion.txt' using 1:3 with lines lw 1.6 lc rgb '#2158d6'";
    return record.plan.path.size() > 1 ? std::vector{room, bend, hand, turn} : std::vector{room, bend};
}

std::string page_text(const PlanRecord& record, std::vector<std::string>& notices) {
    const std::string title = fmt::format("{}: way to {}", escape_html(record.scene.name), escape_html(record.target));
    std::string page = fmt::format("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
                                   "content=\"width=device-width,initial-scale=1\">\n"
                                   "<title>{0}</title>\n<style>{1}</style></head>\n<body><main>\n<p class=\"over\">{0}</p>\n",
                                   title, kReportStyle);
    const InstrumentModel& instrument = instrument_of(record);
    page += fmt::format("<h1>{}</h1>\n",
                        record.plan.arrived ? fmt::format("The tip arrives after {:.1f} s.", record.plan.time)
                                            : fmt::format("The tip does not arrive: {:.1f} mm at its nearest.", 1e3 * record.plan.closest));
    page += fmt::format("<p class=\"lead\">{:.0f} mm along the lumen, {:.2f} mm wide at its narrowest (after {:.0f} mm), bent to a radius "
                        "of {:.1f} mm at its "
                        "sharpest (after {:.0f} mm). {} retraction{}, {} vertices outside the lumen, at most {:.2g} N on the wall.</p>\n",
                        1e3 * record.route.length, 2e3 * record.route.smallest_radius, 1e3 * record.route.smallest_radius_at,
                        record.route.sharpest_curvature > 0.0 ? 1e3 / record.route.sharpest_curvature : 0.0,
                        1e3 * record.route.sharpest_curvature_at, record.plan.retractions, record.plan.retractions == 1 ? "" : "s",
                        record.plan.lumen_exits, record.plan.largest_force);
    const auto plots = draw_plots(make_sketches(record), {{"route.txt", route_data(record), "along_mm,radius_mm,clearance_mm,curvature_per_m"},
                                                            {"motion.txt", motion_data(record), "time_s,insertion_mm,rotation_rad,target_distance_mm"}});
    if (plots.ok()) {
        page += plots_html(*plots);
    } else {
        notices.push_back("no plots: " + plots.error().to_string());
        page += fmt::format("<p class=\"soft\">No plots: {}</p>\n", escape_html(plots.error().to_string()));
    }
    page += fmt::format("<h2>To follow it</h2>\n<pre>{}</pre>\n<p class=\"soft\">Instrument {}, radius {:.3g} mm, "
                        "tolerance {:.3g} mm.</p>\n",
                        escape_html(replay_command(record, output_name::kPath)), escape_html(instrument.name),
                        1e3 * instrument.rod.design.radius, 1e3 * instrument.follow.tolerance);
    if (const Replay& replay = record.replay; replay.steps > 0)
        page += fmt::format("<p>Replayed in the scene as it is, the tip is {:.2f} mm from {} at {:.6g} s, and {:.2f} to {:.2f} mm over the "
                            "last period of what moves by itself.</p>\n",
                            1e3 * replay.last, escape_html(record.target), replay.seconds, 1e3 * replay.least, 1e3 * replay.most);
    page += fmt::format("<footer>{}</footer>\n</main></body></html>\n", escape_html(build_text()));
    return page;
}

} // namespace

std::vector<OutputTable> plan_output_tables() { return {{"plan.json", "", keys_of<PlanRecord>(kPlanKeys)}}; }

std::vector<DriveRow> rows_as_written(const PlanRecord& record) {
    const Units& units = record.scene.units;
    std::vector<DriveRow> rows;
    for (const PathRow& row : rows_in_units(record))
        rows.push_back({row.time * units.time, row.insertion * units.length, row.rotation * units.angle});
    return rows;
}

std::string replay_command(const PlanRecord& record, const std::string& path) {
    const std::uint64_t steps = count_replay_steps(record.prepared.model, record.plan.path.size());
    std::string command = fmt::format("trocar run {} --path {} --to {}", shell_quoted(project_path(record.scene.file)), shell_quoted(path),
                                      shell_quoted(record.target));
    return steps == record.prepared.model.step_count ? command : command + fmt::format(" -n {}", steps);
}

std::vector<Result<void>> write_plan(const PlanRecord& record, const std::filesystem::path& folder, std::vector<std::string>& notices,
                                     bool page) {
    return {write_path_csv(folder / output_name::kPath, rows_in_units(record)),
            write_file_atomically(folder / output_name::kCentreline, centreline_text(record)),
            page ? write_file_atomically(folder / output_name::kReport, page_text(record, notices)) : Result<void>(),
            write_file_atomically(folder / output_name::kPlan, json_text(record))};
}

} // namespace trocar::engine
