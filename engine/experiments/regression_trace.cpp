// Runs a scene, and keeps the values that tell whether its result is unchanged.
#include "engine/experiments/regression.hpp"
#include "engine/step/model_hash.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kSamples = 20;
/// Points of every part in a sample, and in the last one.
constexpr std::size_t kPoints = 6, kLastPoints = 48;
/// Energies differ by the slope of what stores them: a share of this many tolerances over the scene's size is allowed.
constexpr double kEnergySlope = 1000.0;
/// Below this share of the largest energy, energies are compared as if they were it.
constexpr double kSmallEnergy = 1e-3;
/// With a tolerance, contacts may come and go at its edge: this many, or this share of them.
constexpr double kContactSlack = 3.0, kContactShare = 0.05;

TracePart make_part(const std::string& name, const std::vector<Vec3>& points, std::size_t wanted) {
    TracePart part;
    part.name = name;
    const std::size_t count = std::min(wanted, points.size());
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t id = count == 1 ? 0 : k * (points.size() - 1) / (count - 1); // the last one is the tip of a rod
        part.ids.push_back(static_cast<Index>(id));
        part.points.push_back(points[id]);
    }
    return part;
}

TraceSample take_sample(const SceneModel& model, Simulator& simulator, std::size_t points) {
    TraceSample sample;
    const State& state = simulator.state();
    sample.step = state.step;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        if (body.moves())
            sample.parts.push_back(make_part(body.name, body.tissue ? state.bodies[i].tissue.position : state.bodies[i].surface, points));
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        sample.parts.push_back(make_part(model.instruments[i].name, state.instruments[i].rod.position, points));
        sample.drive_positions.push_back(state.instruments[i].rod.insertion);
        sample.drive_positions.push_back(state.instruments[i].rod.rotation);
    }
    sample.kinetic_j = simulator.report().kinetic_j;
    sample.elastic_j = simulator.report().elastic_j;
    return sample;
}

double size_of(const Trace& trace) {
    Box3 box;
    for (const TraceSample& sample : trace.samples)
        for (const TracePart& part : sample.parts)
            for (const Vec3& p : part.points) box.add(p);
    return box.empty() || box.longest_edge() <= 0.0 ? 1.0 : box.longest_edge();
}

double largest_energy(const Trace& trace) {
    double largest = 0.0;
    for (const TraceSample& sample : trace.samples) largest = std::max({largest, sample.kinetic_j, sample.elastic_j});
    return largest;
}

std::string compare_parts(const TraceSample& reference, const TraceSample& now, double tolerance) {
    if (reference.parts.size() != now.parts.size())
        return fmt::format("{} parts move, {} in the reference", now.parts.size(), reference.parts.size());
    for (std::size_t i = 0; i < now.parts.size(); ++i) {
        const TracePart &was = reference.parts[i], &is = now.parts[i];
        if (was.name != is.name || was.ids != is.ids) return fmt::format("{} is another mesh than in the reference", is.name);
        for (std::size_t k = 0; k < is.points.size(); ++k) {
            const double distance = (is.points[k] - was.points[k]).norm();
            if (!(distance <= tolerance))
                return fmt::format("{}, node {}: {:.3g} m away (tolerance {:.3g} m)", is.name, is.ids[k], distance, tolerance);
        }
    }
    for (std::size_t k = 0; k < std::min(reference.drive_positions.size(), now.drive_positions.size()); ++k)
        if (!(std::abs(now.drive_positions[k] - reference.drive_positions[k]) <= tolerance))
            return fmt::format("{} {}, {} in the reference", k % 2 == 0 ? "insertion" : "rotation", now.drive_positions[k], reference.drive_positions[k]);
    return {};
}

std::string compare_energy(const char* name, double reference, double now, double allowed) {
    if (std::abs(now - reference) <= allowed) return {};
    return fmt::format("{} energy {:.9g} J, {:.9g} J in the reference (tolerance {:.3g} J)", name, now, reference, allowed);
}

std::string compare_count(const char* name, std::uint64_t reference, std::uint64_t now, double tolerance) {
    const double difference = std::abs(static_cast<double>(now) - static_cast<double>(reference));
    const double allowed = tolerance > 0.0 ? std::max(kContactSlack, kContactShare * static_cast<double>(reference)) : 0.0;
    return difference <= allowed ? std::string() : fmt::format("{} {}, {} in the reference", name, now, reference);
}

struct Scale {
    double tolerance, energy_share, energy;
};

std::string compare_sample(const TraceSample& reference, const TraceSample& now, const Scale& scale) {
    if (std::string problem = compare_parts(reference, now, scale.tolerance); !problem.empty()) return problem;
    const auto allowed = [&](double energy) { return scale.energy_share * std::max(energy, kSmallEnergy * scale.energy); };
    if (std::string p = compare_energy("kinetic", reference.kinetic_j, now.kinetic_j, allowed(reference.kinetic_j)); !p.empty()) return p;
    if (std::string p = compare_energy("elastic", reference.elastic_j, now.elastic_j, allowed(reference.elastic_j)); !p.empty()) return p;
    if (std::string p = compare_count("contacts", reference.contacts, now.contacts, scale.tolerance); !p.empty()) return p;
    return scale.tolerance > 0.0 ? std::string() : compare_count("pairs tested", reference.pairs_tested, now.pairs_tested, 0.0);
}

} // namespace

Trace run_trace(const SceneModel& model, const RegressionEntry& entry, const std::function<void(std::uint64_t)>& progress) {
    Trace trace;
    trace.scene = entry.name;
    trace.model_hash = hash_model(model);
    trace.budget = BudgetSpec{entry.budget}.to_string();
    Simulator simulator(model, entry.budget);
    std::uint64_t contacts = 0, pairs = 0;
    for (std::uint64_t k = 1; k <= entry.steps; ++k) {
        const StepReport& report = simulator.step();
        if (progress) progress(k);
        if (!report.finite) {
            trace.failure = report.failure;
            break;
        }
        trace.steps = k;
        contacts += report.exact_ran ? report.pressing_contacts : report.leaf_contacts;
        pairs += report.pairs_tested;
        if (k * kSamples / entry.steps == (k - 1) * kSamples / entry.steps && k != entry.steps) continue;
        TraceSample& sample = trace.samples.emplace_back(take_sample(model, simulator, k == entry.steps ? kLastPoints : kPoints));
        sample.contacts = contacts;
        sample.pairs_tested = pairs;
        contacts = pairs = 0;
    }
    trace.state_hash = hash_state(simulator.state());
    return trace;
}

std::string first_difference(const Trace& reference, const Trace& now, double tolerance) {
    const Scale scale{tolerance, tolerance * kEnergySlope / size_of(reference), largest_energy(reference)};
    for (std::size_t k = 0; k < std::min(reference.samples.size(), now.samples.size()); ++k) {
        const TraceSample &was = reference.samples[k], &is = now.samples[k];
        if (was.step != is.step) return fmt::format("step {} stands where the reference has step {}", is.step, was.step);
        if (const std::string problem = compare_sample(was, is, scale); !problem.empty())
            return fmt::format("step {}, {}", is.step, problem);
    }
    if (!now.failure.empty()) return fmt::format("stopped in step {}: {}", now.steps + 1, now.failure);
    if (now.steps != reference.steps) return fmt::format("{} steps, {} in the reference", now.steps, reference.steps);
    if (tolerance == 0.0 && now.state_hash != reference.state_hash)
        return fmt::format("state {:016x} after step {}, {:016x} in the reference", now.state_hash, now.steps, reference.state_hash);
    return {};
}

} // namespace trocar::engine
