#include "engine/report/plots.hpp"

#include "engine/report/outline.hpp"
#include "engine/report/verdict.hpp"
#include "engine/report/xray_frames.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

namespace trocar::engine {

namespace {

constexpr const char* kCurveFile = "curve.tsv";

constexpr const char* kCurveColumns =
    "time_s,step_min_ms,step_max_ms,charged_min_ms,charged_max_ms,normal_force_n,kinetic_j,elastic_j,volume_ratio,insertion_mm,target_distance_mm,"
    "level_min,level_max,pairs_open,exact_share,tip_x_mm,tip_y_mm,tip_z_mm";

/// Columns of the curve's file, from 1.
enum Column {
    kTime = 1,
    kTotalMin,
    kTotalMax,
    kChargedMin,
    kChargedMax,
    kForce,
    kKinetic,
    kElastic,
    kVolume,
    kInsertion,
    kTarget,
    kLevelMin,
    kLevelMax,
    kOpen,
    kExactShare,
    kTipX,
    kTipY,
    kTipZ,
};

std::string curve_text(const Curve& curve) {
    std::string text;
    for (const CurvePoint& p : curve.points())
        fmt::format_to(std::back_inserter(text),
                       "{:.9g}\t{:.5g}\t{:.5g}\t{:.5g}\t{:.5g}\t{:.5g}\t{:.5g}\t{:.5g}\t{:.5g}\t{:.7g}\t{:.7g}\t{}\t{}\t{}\t{:.4g}\t"
                       "{:.7g}\t{:.7g}\t{:.7g}\n",
                       p.time_s, p.total_ms.min, p.total_ms.max, p.charged_ms.min, p.charged_ms.max, p.force_n.max, p.kinetic_j.max,
                       p.elastic_j.max, p.volume_ratio.min, 1e3 * p.insertion_m.last, 1e3 * p.target_distance_m.last, p.level.min,
                       p.level.max, p.pairs_open.max, static_cast<double>(p.exact_steps) / static_cast<double>(p.steps), 1e3 * p.tip.x(),
                       1e3 * p.tip.y(), 1e3 * p.tip.z());
    return text;
}

Sketch sketch_times(const RunRecord& record) {
    const BudgetSpec& budget = record.scene.budget;
    const bool wall = budget.limits.mode == BudgetMode::Wall;
    const char* scope = budget.scope == BudgetScope::Step ? "charged" : "collision";
    Sketch sketch;
    sketch.plot = {"times",
                   wall ? "Time of each step against its budget" : "Time of each step",
                   "Milliseconds on a logarithmic scale; where several steps share a point, the slowest is drawn.",
                   {}};
    sketch.commands = "set logscale y\nset format y '%g'\nset ylabel 'time of a step [ms]' textcolor rgb '#4b5563' offset 1,0\n";
    if (wall && budget.limits.wall_s > 0.0)
        sketch.commands +=
            fmt::format("set arrow 1 from graph 0, first {0} to graph 1, first {0} nohead lc rgb '#d64545' lw 1.6 dt (8,5) front\n"
                        "budget = {0}\n",
                        1e3 * budget.limits.wall_s);
    const double floor = record.summary.floor_ms;
    if (wall && floor > 0.0) {
        sketch.commands += "set key maxrows 2\nset key at graph 0, 1.25\nset tmargin 3.4\n"; // four names above the plot
        sketch.plot.caption += fmt::format(" The floor, {} ms, is what a step from the run's end takes under a budget of nothing.", number_text(floor));
        sketch.commands += fmt::format("floor_ms = {:.6g}\n", floor);
    }
    sketch.commands += fmt::format("plot file using {}:{} with lines lw 1.1 lc rgb '#a9bfe8' title 'whole step', "
                                   "'' using {}:{} with lines lw 1.3 lc rgb '#2158d6' title '{}'",
                                   int{kTime}, int{kTotalMax}, int{kTime}, int{kChargedMax}, scope);
    if (wall && budget.limits.wall_s > 0.0)
        sketch.commands += ", '' using 1:(budget) with lines lw 1.6 lc rgb '#d64545' dt (8,5) title 'budget'";
    if (wall && floor > 0.0) sketch.commands += ", '' using 1:(floor_ms) with lines lw 1.4 lc rgb '#6b7280' dt (2,4) title 'floor'";
    return sketch;
}

Sketch sketch_advance(const RunRecord& record) {
    Sketch sketch;
    const bool target = record.statistics.target_distance_m >= 0.0;
    sketch.plot = {"advance",
                   target ? "Insertion, and distance to the target" : "Insertion",
                   target ? "Length of instrument beyond the entry, and straight distance from its tip to the target."
                          : "Length of instrument beyond the entry.",
                   {}};
    sketch.commands = fmt::format("set ylabel 'length [mm]' textcolor rgb '#4b5563' offset 1,0\nset yrange [0:*]\n"
                                  "plot file using {}:{} with lines lw 1.8 lc rgb '#2158d6' title 'inserted'",
                                  int{kTime}, int{kInsertion});
    if (target)
        sketch.commands +=
            fmt::format(", '' using {}:{} with lines lw 1.8 lc rgb '#d97706' title 'tip to target'", int{kTime}, int{kTarget});
    return sketch;
}

Sketch sketch_force() {
    Sketch sketch;
    sketch.plot = {"force", "Force on the walls", "Sum of the normal forces between instrument and wall.", {}};
    sketch.commands = fmt::format("set ylabel 'normal force [N]' textcolor rgb '#4b5563' offset 1,0\nset yrange [0:*]\nunset key\n"
                                  "plot file using {0}:{1} with filledcurves y1=0 fc rgb '#0f8a6d', "
                                  "'' using {0}:{1} with lines lw 1.1 lc rgb '#0f8a6d'",
                                  int{kTime}, int{kForce});
    return sketch;
}

Sketch sketch_depth(const RunRecord& record) {
    Sketch sketch;
    sketch.plot = {"level",
                   "Level reached, and exact answers",
                   "Coarsest level of the sphere trees that was still open when a step's descent ended (higher is finer), and the "
                   "share of steps in which the exact stage gave the answer.",
                   {}};
    sketch.commands =
        fmt::format("set ylabel 'level of the trees' textcolor rgb '#2158d6' offset 1,0\nset yrange [0:*]\nset ytics 1\nset y2label 'exact answers [share of steps]' textcolor rgb '#0f8a6d' offset -1,0\nset y2range [0:1]\nset y2tics "
                    "('0 %%' 0, '50 %%' 0.5, '100 %%' 1)\n"
                    "set rmargin 7\nplot file using {0}:{2} axes x1y2 with filledcurves y=0 fc rgb '#7cc4ae' title 'exact answers', "
                    "'' using {0}:{1} with steps lw 1.6 lc rgb '#2158d6' title 'level reached'",
                    int{kTime}, int{kLevelMin}, int{kExactShare});
    if (std::none_of(record.statistics.curve.points().begin(), record.statistics.curve.points().end(),
                     [](const CurvePoint& p) { return p.level.max > 12.0; }))
        return sketch;
    const std::size_t at = sketch.commands.find("set ytics 1\n");
    sketch.commands.erase(at, std::string("set ytics 1\n").size());
    return sketch;
}

Sketch sketch_energy() {
    Sketch sketch;
    sketch.plot = {"energy", "Energy", "Kinetic and elastic energy of everything that moves; a run that explodes shows here first.", {}};
    sketch.commands = fmt::format("set ylabel 'energy [J]' textcolor rgb '#4b5563' offset 1,0\nset logscale y\nset format y '10^{{%L}}'\n"
                                  "plot file using {0}:{1} with lines lw 1.3 lc rgb '#7c3aed' title 'elastic', "
                                  "'' using {0}:{2} with lines lw 1.3 lc rgb '#d97706' title 'kinetic'",
                                  int{kTime}, int{kElastic}, int{kKinetic});
    return sketch;
}

constexpr const char* kContrastFile = "contrast.txt";

/// The time-density curve: iodine where the targets are, and in all vessels.
Sketch sketch_contrast(const RunRecord& record) {
    Sketch sketch;
    sketch.plot = {"contrast", "Contrast over time", "Iodine in the blood at the targets, at every frame (the time-density curve), and in all vessels.", {}};
    sketch.commands = "set ylabel 'iodine at a target [mg/ml]' textcolor rgb '#4b5563' offset 1,0\nset yrange [0:*]\n"
                      "set y2label 'in all vessels [mg]' textcolor rgb '#6b7280' offset -1,0\nset y2range [0:*]\nset y2tics\nset rmargin 9\n";
    sketch.commands += fmt::format("plot '{}' using 2:(1e6*$4) axes x1y2 with filledcurves y=0 fc rgb '#d5dbe6' title 'in all vessels'", kContrastFile);
    constexpr std::array<const char*, 4> kColours{"#2158d6", "#d97706", "#0f8a6d", "#7c3aed"};
    for (std::size_t i = 0; i < record.scene.targets.size(); ++i)
        sketch.commands += fmt::format(", '' using 2:{} with linespoints lw 1.8 pt 7 ps 0.4 lc rgb '{}' title {}", 6 + i, kColours[i % kColours.size()],
                                       quote_for_gnuplot(record.scene.targets[i].name));
    return sketch;
}

bool has_contrast(const RunRecord& record) { return record.xrays != nullptr && !record.xrays->contrast_curve().empty(); }

bool has_route(const RunRecord& record) {
    const std::vector<InstrumentModel>& instruments = record.prepared.model.instruments;
    return std::any_of(instruments.begin(), instruments.end(), [](const InstrumentModel& m) { return m.route.has_value(); });
}

/// Planned ways, mm.
std::string route_text(const SceneModel& model) {
    std::string text;
    for (const InstrumentModel& instrument : model.instruments) {
        if (!instrument.route) continue;
        for (const Vec3& p : instrument.route->points)
            fmt::format_to(std::back_inserter(text), "{:.5g} {:.5g} {:.5g}\n", 1e3 * p.x(), 1e3 * p.y(), 1e3 * p.z());
        text += "\n";
    }
    return text.empty() ? "NaN NaN NaN\n" : text;
}

Sketch sketch_volume() {
    Sketch sketch;
    sketch.plot = {
        "volume", "Smallest volume of a tetrahedron", "Relative to rest, over the whole tissue; at 0 an element is inverted.", {}};
    sketch.commands = fmt::format("set ylabel 'volume / volume at rest' textcolor rgb '#4b5563' offset 1,0\nset yrange [0:1.05]\nunset key\n"
                                  "plot file using {}:{} with lines lw 1.6 lc rgb '#0f8a6d'",
                                  int{kTime}, int{kVolume});
    return sketch;
}

/// Outlines of all bodies as gnuplot's lines with breaks, mm.
std::string outline_text(const SceneModel& model, const Vec3& direction, bool hollow) {
    std::string text;
    for (const BodyModel& body : model.bodies) {
        if (body.hollow != hollow || body.is_free_space) continue;
        for (const OutlineEdge& edge : find_outline(body.surface, direction))
            fmt::format_to(std::back_inserter(text), "{:.4g} {:.4g} {:.4g}\n{:.4g} {:.4g} {:.4g}\n\n", 1e3 * edge.a.x(), 1e3 * edge.a.y(),
                           1e3 * edge.a.z(), 1e3 * edge.b.x(), 1e3 * edge.b.y(), 1e3 * edge.b.z());
    }
    return text.empty() ? "NaN NaN NaN\n" : text;
}

/// What a projection shows, mm: all bodies at rest, the way of the tip.
struct Frame {
    double lo[2], hi[2]; // across, up
    [[nodiscard]] double size(int axis) const { return hi[axis] - lo[axis]; }
};

Frame frame_of(const RunRecord& record, int across) {
    Box3 box;
    for (const BodyModel& body : record.prepared.model.bodies)
        if (!body.is_free_space) box.add(body.surface.bounds());
    for (const CurvePoint& point : record.statistics.curve.points()) box.add(point.tip);
    Frame frame{};
    for (int axis = 0; axis < 2; ++axis) {
        const int from = axis == 0 ? across : 2;
        const double room = 0.03 * (box.hi - box.lo).maxCoeff();
        frame.lo[axis] = 1e3 * (box.lo[from] - room);
        frame.hi[axis] = 1e3 * (box.hi[from] + room);
    }
    return frame;
}

/// The distance of tics that puts about `count` of them on a length: 1, 2 or 5 times a power of ten.
double tic_distance(double length, double count) {
    const double power = std::pow(10.0, std::floor(std::log10(length / count)));
    for (const double step : {1.0, 2.0, 5.0})
        if (length <= step * power * count) return step * power;
    return 10.0 * power;
}

struct Projection {
    const char* name;
    const char* title;
    Vec3 direction;    // of view
    int across;        // axis, 0 x, 1 y
    const char* label; // of that axis
    bool mirrored;     // as in the pictures, x runs to the left
};

/// Beyond this ratio of height to width the axes get scales of their own.
constexpr double kLongestFrame = 4.0;

Sketch sketch_path(const RunRecord& record, const Projection& projection) {
    const Frame frame = frame_of(record, projection.across);
    const bool same_scale = frame.size(1) < kLongestFrame * frame.size(0);
    const double tics = tic_distance(frame.size(1), 9.0);
    Sketch sketch;
    sketch.plot = {projection.name,
                   projection.title,
                   same_scale ? "Way of the tip over the outlines of vessel and organ at rest; same scale on both axes."
                              : "Way of the tip over the outlines of vessel and organ at rest; each axis has a scale of its own.",
                   {}};
    sketch.height = 480;
    sketch.commands = fmt::format("{}set grid xtics ytics lc rgb '#eef0f3' lw 1 lt 1\nset key at graph 0, 1.065\n"
                                  "set xrange [{}:{}]\nset yrange [{}:{}]\nset xtics {}\nset ytics {}\n"
                                  "set xlabel '{}' offset 0,0.4\nset ylabel 'feet to head [mm]' textcolor rgb '#4b5563' offset 1,0\n",
                                  same_scale ? "set size ratio -1\n" : "", projection.mirrored ? frame.hi[0] : frame.lo[0],
                                  projection.mirrored ? frame.lo[0] : frame.hi[0], frame.lo[1], frame.hi[1],
                                  same_scale ? tics : tic_distance(frame.size(0), 7.0), tics, projection.label);
    sketch.commands += fmt::format("plot '{0}_organ.txt' using {1}:3 with lines lw 0.5 lc rgb '#e3b7a8' notitle, "
                                   "'{0}_vessel.txt' using {1}:3 with lines lw 0.6 lc rgb '#d88080' notitle, "
                                   "'{0}_route.txt' using {1}:3 with lines lw 1.2 lc rgb '#f0a63a' {2}, "
                                   "file using {3}:{4} with lines lw 2.2 lc rgb '#2158d6' title 'tip'",
                                   projection.name, projection.across + 1, has_route(record) ? "title 'route'" : "notitle",
                                   projection.across == 0 ? int{kTipX} : int{kTipY}, int{kTipZ});
    if (record.prepared.targets.empty()) return sketch;
    sketch.commands += fmt::format(", '{}_targets.txt' using {}:3 with points pt 6 ps 1.1 lw 2 lc rgb '#f59e0b' title 'target'",
                                   projection.name, projection.across + 1);
    return sketch;
}

void add_path_files(const RunRecord& record, const Projection& projection, std::vector<PlotData>& data) {
    std::string targets;
    for (const Place& target : record.prepared.targets)
        fmt::format_to(std::back_inserter(targets), "{} {} {}\n", 1e3 * target.position.x(), 1e3 * target.position.y(),
                       1e3 * target.position.z());
    const SceneModel& model = record.prepared.model;
    data.push_back({projection.name + std::string("_organ.txt"), outline_text(model, projection.direction, false)});
    data.push_back({projection.name + std::string("_vessel.txt"), outline_text(model, projection.direction, true)});
    data.push_back({projection.name + std::string("_route.txt"), route_text(model)});
    data.push_back({projection.name + std::string("_targets.txt"), targets});
}

const std::vector<Projection>& projections() {
    static const std::vector<Projection> kBoth{
        {"front", "Way of the tip, from the front", Vec3(0.0, -1.0, 0.0), 0, "right to left of the patient [mm]", true},
        {"side", "Way of the tip, from the side", Vec3(1.0, 0.0, 0.0), 1, "back to front [mm]", false}};
    return kBoth;
}

/// Does any of these numbers change in the run? A constant is a sentence, not a plot.
template <class... Values>
bool varies(const RunRecord& record, const Values&... values) {
    const std::vector<CurvePoint>& points = record.statistics.curve.points();
    const auto one = [&](const auto& value) {
        return std::any_of(points.begin(), points.end(), [&](const CurvePoint& p) { return value(p) != value(points.front()); });
    };
    return (one(values) || ...);
}

std::vector<Sketch> make_sketches(const RunRecord& record) {
    std::vector<Sketch> sketches{sketch_times(record)};
    if (!record.prepared.model.instruments.empty()) {
        if (varies(record, [](const CurvePoint& p) { return p.insertion_m.last; }, [](const CurvePoint& p) { return p.target_distance_m.last; }))
            sketches.push_back(sketch_advance(record));
        if (varies(record, [](const CurvePoint& p) { return p.tip.x(); }, [](const CurvePoint& p) { return p.tip.y(); },
                   [](const CurvePoint& p) { return p.tip.z(); }))
            for (const Projection& projection : projections()) sketches.push_back(sketch_path(record, projection));
        if (has_contrast(record)) sketches.push_back(sketch_contrast(record));
        if (varies(record, [](const CurvePoint& p) { return p.force_n.max; })) sketches.push_back(sketch_force());
    }
    if (record.prepared.model.effects.coarse_contact &&
        varies(record, [](const CurvePoint& p) { return p.level.min; },
               [](const CurvePoint& p) { return static_cast<double>(p.exact_steps) / static_cast<double>(p.steps); }))
        sketches.push_back(sketch_depth(record));
    if (varies(record, [](const CurvePoint& p) { return p.kinetic_j.max; }, [](const CurvePoint& p) { return p.elastic_j.max; }))
        sketches.push_back(sketch_energy());
    const std::vector<BodyModel>& bodies = record.prepared.model.bodies;
    if (std::any_of(bodies.begin(), bodies.end(), [](const BodyModel& body) { return body.tissue.has_value(); }) &&
        varies(record, [](const CurvePoint& p) { return p.volume_ratio.min; }))
        sketches.push_back(sketch_volume());
    return sketches;
}

} // namespace

Result<std::vector<Plot>> make_plots(const RunRecord& record) {
    if (record.statistics.steps == 0) return std::vector<Plot>{};
    const Curve& curve = record.statistics.curve;
    std::vector<PlotData> data{{kCurveFile, curve_text(curve), kCurveColumns}};
    if (!record.prepared.model.instruments.empty())
        for (const Projection& projection : projections()) add_path_files(record, projection, data);
    if (has_contrast(record)) {
        std::string columns = "step,time_s,injected_kg,in_vessels_kg,washed_out_kg";
        for (const SceneTarget& target : record.scene.targets) columns += fmt::format(",iodine_{}_kg_m3", target.name);
        data.push_back({kContrastFile, record.xrays->contrast_curve(), columns});
    }
    std::vector<Sketch> sketches = make_sketches(record);
    for (Sketch& sketch : sketches)
        sketch.commands = fmt::format("file = '{}'\nset xlabel 'time [s]' textcolor rgb '#4b5563' offset 0,0.4\nset xrange [0:{}]\n{}",
                                      kCurveFile, curve.points().back().time_s, sketch.commands);
    return draw_plots(sketches, data);
}

} // namespace trocar::engine
