#include "engine/episodes/task.hpp"
#include "engine/scene/nearest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace trocar::engine {

namespace {

constexpr double kMargin = 50e-3;   // m, around the lumen at rest: breathing, and what lies behind the port
constexpr double kLeastTimeLimit = 10.0, kTimesTheWay = 3.0;

Error bad_option(std::string key, std::string message) { return {ErrorCode::BadUsage, std::move(message), {}, 0, 0, std::move(key)}; }

Result<void> check_options(const TaskOptions& o, double step_s) {
    const auto within = [](double value, double least, double most) { return value >= least && value <= most; };
    const auto out = [](const char* key, double found, const std::string& expected) {
        return bad_option(key, fmt::format("found {:g}, expected {}", found, expected));
    };
    if (!within(o.hold_s, step_s, 60.0)) return out("hold", o.hold_s, fmt::format("{:g} s (a step) to 60 s", step_s));
    if (!within(o.points, 1, 100)) return out("points", o.points, "1 to 100");
    if (!within(o.spacing, 1e-4, 1.0)) return out("spacing", o.spacing, "0.0001 m to 1 m");
    if (!within(o.memory, 1, 100)) return out("memory", o.memory, "1 to 100");
    if (!within(o.tolerance, 1e-5, 1.0)) return out("tolerance", o.tolerance, "0.00001 m to 1 m");
    if (!within(o.time_limit_s, 0.0, 1e5)) return out("time_limit", o.time_limit_s, "0 (from the way's length) to 1e5 s");
    if (!within(o.start_poses, 1, 1000)) return out("start_poses", o.start_poses, "1 to 1000");
    if (!within(o.start_spread, 0.0, 0.2)) return out("start_spread", o.start_spread, "0 m to 0.2 m");
    for (const double weight : o.reward)
        if (!std::isfinite(weight)) return out("reward", weight, "finite weights");
    return {};
}

Index nearest_vertex(std::span<const Vec3> vertices, const Vec3& p) noexcept {
    Index nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (Index v = 0; v < vertices.size(); ++v)
        if (const double d = (vertices[v] - p).squaredNorm(); d < least) least = d, nearest = v;
    return nearest;
}

Index nearest_point(std::span<const Vec3> points, const Vec3& p) noexcept { return nearest_vertex(points, p); }

/// m, from every point of the tree to `from` along it.
std::vector<double> find_ways(const spheretree::CentrelineTree& tree, Index from) {
    const std::size_t n = tree.point_count();
    const auto edge = [&](std::size_t i) { return std::sqrt((tree.points[i] - tree.points[tree.parents[i]]).squaredNorm()); };
    std::vector<double> ways(n, std::numeric_limits<double>::infinity());
    ways[from] = 0.0;
    for (Index i = from; tree.parents[i] != kNoIndex; i = tree.parents[i]) ways[tree.parents[i]] = ways[i] + edge(i);
    for (std::size_t i = 0; i < n; ++i) // parents come first
        if (tree.parents[i] != kNoIndex && std::isinf(ways[i])) ways[i] = ways[tree.parents[i]] + edge(i);
    return ways;
}

Result<void> find_targets(const Scene& scene, Task& task) {
    const BodyModel& lumen = task.model().bodies[task.lumen];
    std::vector<std::string> known;
    for (const SceneTarget& target : scene.targets) known.push_back(target.name);
    for (const std::string& name : task.options.targets)
        if (std::find(known.begin(), known.end(), name) == known.end())
            return bad_option("targets", refuse_unknown("target", name, std::vector<std::string_view>(known.begin(), known.end())));
    for (std::size_t i = 0; i < known.size(); ++i) {
        const auto& wanted = task.options.targets;
        if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), known[i]) == wanted.end()) continue;
        const Vec3 position = task.prepared->targets[i].position;
        const Index point = nearest_point(task.tree.points, position);
        const double beside = std::sqrt((task.tree.points[point] - position).squaredNorm());
        if (beside > task.tree.radii[point] + task.options.tolerance) {
            if (wanted.empty()) continue; // cannot be reached from this entry
            return bad_option("targets", fmt::format("\"{}\" lies {:.3g} mm from the lumen's centreline; expected a target that can be "
                                                     "reached from the entry",
                                                     known[i], kMillimetre * beside));
        }
        task.targets.push_back({known[i], position, nearest_vertex(lumen.surface.vertices, position), find_ways(task.tree, point)});
    }
    if (task.targets.empty()) return bad_option("targets", "the scene has no target that can be reached from the entry; expected one");
    return {};
}

/// The scene's start, the handles turned and the instruments pushed a little: each by steps of the simulator.
Result<void> find_starts(Task& task, const Progress& progress) {
    const SceneModel& model = task.model();
    const auto prototype = std::make_shared<Simulator>(model, task.budget);
    task.prototype = prototype;
    Simulator& simulator = *prototype;
    const State start = simulator.state();
    for (unsigned pose = 0; pose < task.options.start_poses; ++pose) {
        if (progress) progress(fmt::format("start pose {}", pose + 1));
        if (const auto restored = simulator.restore(start); !restored.ok()) return restored;
        const double share = (pose + 0.5) / task.options.start_poses;
        const double turn = (pose == 0 ? 0.0 : 2.0 * share - 1.0) * std::numbers::pi;
        // insertions in an order that has nothing to do with the turns: bits of the number, reversed
        double push = 0.0, half = 0.5;
        for (unsigned bits = pose; bits > 0; bits >>= 1, half *= 0.5) push += (bits & 1u) * half;
        Inputs inputs;
        double time = 0.0;
        for (const InstrumentModel& instrument : model.instruments) {
            const double way = push * task.options.start_spread;
            inputs.drive.emplace_back(DriveCommand{instrument.inserted + way, turn});
            time = std::max({time, way / instrument.limits.speed, std::abs(turn) / instrument.limits.rotation});
        }
        const auto steps = static_cast<std::uint64_t>(std::ceil(time / model.step_s - 1e-9));
        for (std::uint64_t k = 0; k < steps; ++k) {
            if (const auto taken = simulator.step(inputs); !taken.ok()) return taken;
            if (!simulator.report().finite)
                return Error{ErrorCode::NotFinite, fmt::format("start pose {}: {}", pose + 1, simulator.report().failure), model.file};
        }
        if (!simulator.report().finite) return Error{ErrorCode::BadValue, simulator.report().failure, model.file};
        task.starts.push_back(simulator.state());
    }
    return {};
}

double longest_way(const Task& task) {
    double longest = 0.0;
    for (const TaskTarget& target : task.targets) longest = std::max(longest, target.remaining.front());
    return longest;
}

Vec3 displacement(const Task& task, Index wall, const State& state) noexcept {
    return state.bodies[task.lumen].surface[wall] - task.model().bodies[task.lumen].surface.vertices[wall];
}

} // namespace

Vec3 Task::target_now(std::size_t target, const State& state) const noexcept {
    const TaskTarget& own = targets[target];
    return moves ? Vec3(own.position + displacement(*this, own.wall, state)) : own.position;
}

WayPlace Task::find_place(const Vec3& tip, std::size_t target, const State& state) const noexcept {
    WayPlace place;
    double least = std::numeric_limits<double>::infinity();
    for (Index i = 0; i < tree.points.size(); ++i) {
        Vec3 point = tree.points[i];
        if (moves) point += displacement(*this, tree_wall[i], state);
        if (const double d = (point - tip).squaredNorm(); d < least) least = d, place.point = i;
    }
    place.remaining = targets[target].remaining[place.point];
    place.distance = std::sqrt((target_now(target, state) - tip).squaredNorm());
    return place;
}

Result<std::shared_ptr<const Task>> make_task(const Scene& scene, std::shared_ptr<const PreparedScene> prepared, TaskOptions options,
                                              const Progress& progress) {
    const SceneModel& model = prepared->model;
    if (model.instruments.empty())
        return Error{ErrorCode::BadUsage, "the scene has no instrument; expected one that can be driven to a target", scene.file.string(), 0, 0, "instruments"};
    if (const auto fine = check_options(options, model.step_s); !fine.ok()) return fine.error();
    auto task = std::make_shared<Task>();
    task->budget = options.budget.value_or(model.budget);
    task->options = std::move(options);
    task->lumen = model.instruments[kLeadInstrument].lumen;
    task->prepared = std::move(prepared);
    const BodyModel& lumen = model.bodies[task->lumen];
    task->moves = lumen.moves();
    if (progress) progress("centreline");
    auto tree = spheretree::find_centreline_tree(*lumen.lumen, model.instruments[kLeadInstrument].port.position);
    if (!tree.ok()) return tree.error();
    task->tree = std::move(*tree);
    if (task->moves)
        for (const Vec3& point : task->tree.points) task->tree_wall.push_back(nearest_vertex(lumen.surface.vertices, point));
    if (const auto found = find_targets(scene, *task); !found.ok()) return found.error();
    task->steps_per_action = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(task->options.hold_s / model.step_s)));
    const double limit = task->options.time_limit_s > 0.0
                             ? task->options.time_limit_s
                             : std::max(kLeastTimeLimit, kTimesTheWay * longest_way(*task) / model.instruments[kLeadInstrument].limits.speed);
    const double held = static_cast<double>(task->steps_per_action) * model.step_s;
    task->action_limit = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::llround(limit / held)));
    if (const auto found = find_starts(*task, progress); !found.ok()) return found.error();
    return std::shared_ptr<const Task>(std::move(task));
}

void find_observation_bounds(const Task& task, std::span<float> low, std::span<float> high) {
    const SceneModel& model = task.model();
    Vec3 least = Vec3::Constant(std::numeric_limits<double>::infinity()), most = -least;
    for (const Vec3& v : model.bodies[task.lumen].surface.vertices) least = least.cwiseMin(v), most = most.cwiseMax(v);
    double margin = kMargin + task.options.spacing * task.options.points;
    for (const InstrumentModel& instrument : model.instruments) {
        least = least.cwiseMin(instrument.port.position), most = most.cwiseMax(instrument.port.position);
    }
    std::size_t k = 0;
    const auto bound = [&](double l, double h) { low[k] = static_cast<float>(l), high[k] = static_cast<float>(h), ++k; };
    const std::size_t points = task.options.memory * task.devices() * task.options.points + 1;
    for (std::size_t p = 0; p < points; ++p)
        for (int axis = 0; axis < 3; ++axis) bound(kMillimetre * (least[axis] - margin), kMillimetre * (most[axis] + margin));
    for (const InstrumentModel& instrument : model.instruments) {
        bound(-kMillimetre * instrument.limits.speed, kMillimetre * instrument.limits.speed);
        bound(-instrument.limits.rotation, instrument.limits.rotation);
    }
    for (const InstrumentModel& instrument : model.instruments) {
        bound(0.0, kMillimetre * instrument.rod.design.length);
        bound(-4.0, 4.0); // a turn is told within -pi and pi
    }
}

} // namespace trocar::engine
