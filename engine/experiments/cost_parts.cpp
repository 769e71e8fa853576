#include "engine/experiments/cost_parts.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/state/bit_hash.hpp"
#include "engine/state/byte_stream.hpp"
#include "engine/state/state_bytes.hpp"
#include "engine/step/model_hash.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <limits>

namespace trocar::engine {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view kMagic = "trocar exact run 1\n", kStartMagic = "trocar start of a comparison 1\n";

/// What stands in a file after its magic and its key; nothing where these are others.
std::optional<std::string> read_part(const std::filesystem::path& file, std::string_view magic, std::uint64_t key) {
    auto bytes = read_file_bytes(file);
    if (!bytes || !bytes->starts_with(magic)) return std::nullopt;
    std::uint64_t found = 0;
    ByteReader in(std::string_view(*bytes).substr(magic.size()));
    in.number(found);
    if (!in.ok() || found != key) return std::nullopt;
    return bytes->substr(magic.size() + sizeof(found));
}

/// Written and read by the same calls.
template <class Stream, class Run>
void describe(Stream& stream, Run& run) {
    const auto points = [&](auto& values) { stream.list(values, [&](auto& v) { stream.vector(v); }); };
    const auto lists = [&](auto& values) { stream.list(values, points); };
    stream.number(run.every);
    stream.number(run.steps);
    stream.number(run.busiest_step);
    stream.text(run.failure);
    lists(run.tips);
    stream.list(run.shapes, [&](auto& shape) {
        lists(shape.surfaces);
        lists(shape.skins);
    });
}

/// JSON has no infinity: what a state that is not finite came to is kept as text.
Json real(double value) { return std::isfinite(value) ? Json(value) : Json(fmt::format("{}", value)); }
double real(const Json& json) {
    if (json.is_number()) return json.get<double>();
    return json.get<std::string>() == "inf" ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
}

Json four_numbers(const Percentiles& p) { return {real(p.p50), real(p.p95), real(p.p99), real(p.max)}; }
Percentiles four_numbers(const Json& json) { return {real(json.at(0)), real(json.at(1)), real(json.at(2)), real(json.at(3))}; }

Json to_json(const CostOwnRun& run) {
    Json curve = Json::array();
    for (const CostPoint& p : run.curve)
        curve.push_back({real(p.time_s), real(p.level), real(p.pairs_open), real(p.tip_distance_m), real(p.step_ms), real(p.charged_ms)});
    return {{"steps", run.steps},
            {"failure", run.failure},
            {"step_ms", four_numbers(run.step_ms)},
            {"charged_ms", four_numbers(run.charged_ms)},
            {"budget_kept", run.budget_kept},
            {"realtime_kept", run.realtime_kept},
            {"exact_steps", run.exact_steps},
            {"lumen_exits", run.lumen_exits},
            {"dropped_steps", run.dropped_steps},
            {"trajectory", {real(run.trajectory.sum_sq), run.trajectory.vertices, real(run.trajectory.hausdorff)}},
            {"tip", {real(run.tip_distance_rms_m), real(run.tip_distance_max_m)}},
            {"state_hash", run.state_hash},
            {"curve", std::move(curve)}};
}

CostOwnRun from_json(const Json& json) {
    CostOwnRun run;
    run.steps = json.at("steps");
    run.failure = json.at("failure");
    run.step_ms = four_numbers(json.at("step_ms"));
    run.charged_ms = four_numbers(json.at("charged_ms"));
    run.budget_kept = json.at("budget_kept");
    run.realtime_kept = json.at("realtime_kept");
    run.exact_steps = json.at("exact_steps");
    run.lumen_exits = json.at("lumen_exits");
    run.dropped_steps = json.at("dropped_steps");
    const Json& trajectory = json.at("trajectory");
    run.trajectory = {real(trajectory.at(0)), trajectory.at(1), real(trajectory.at(2))};
    run.tip_distance_rms_m = real(json.at("tip").at(0));
    run.tip_distance_max_m = real(json.at("tip").at(1));
    run.state_hash = json.at("state_hash");
    for (const Json& p : json.at("curve"))
        run.curve.push_back({real(p.at(0)), real(p.at(1)), real(p.at(2)), real(p.at(3)), real(p.at(4)), real(p.at(5))});
    return run;
}

} // namespace

std::uint64_t CostParts::key_of(const SceneModel& model, const CostOptions& options) {
    BitHash hash;
    hash.add(hash_model(model));
    hash.add(options.steps);
    hash.add(options.from);
    for (const NamedBudget& budget : options.budgets) hash.add_text(budget.name);
    for (const CostVariant& variant : options.variants) {
        hash.add_text(variant.name);
        hash.add(hash_model(*variant.model));
    }
    return hash.value();
}

std::filesystem::path CostParts::row_file(std::size_t row) const { return folder_ / fmt::format("row_{}.json", row); }

Result<void> CostParts::make_folder() const {
    std::error_code failed;
    std::filesystem::create_directories(folder_, failed);
    if (failed) return Error{ErrorCode::CannotWrite, failed.message(), folder_.string()};
    return {};
}

std::optional<State> CostParts::start(const SceneModel& model) const {
    const std::optional<std::string> bytes = read_part(start_file(), kStartMagic, key_);
    if (!bytes) return std::nullopt;
    auto state = read_state(model, *bytes);
    return state ? std::optional(std::move(*state)) : std::nullopt;
}

Result<void> CostParts::keep_start(const State& state) const {
    if (auto made = make_folder(); !made) return made;
    std::string bytes(kStartMagic);
    ByteWriter(bytes).number(key_);
    append_state(state, bytes);
    return write_file_atomically(start_file(), bytes);
}

std::optional<ExactRun> CostParts::exact_run() const {
    const std::optional<std::string> bytes = read_part(exact_file(), kMagic, key_);
    if (!bytes) return std::nullopt;
    ByteReader in(*bytes);
    ExactRun run;
    describe(in, run);
    if (!in.ok() || !in.at_end() || run.every == 0 || run.tips.size() != run.steps) return std::nullopt;
    return run;
}

Result<void> CostParts::keep(const ExactRun& run) const {
    if (auto made = make_folder(); !made) return made;
    std::string bytes(kMagic);
    ByteWriter out(bytes);
    out.number(key_);
    describe(out, run);
    return write_file_atomically(exact_file(), bytes);
}

std::optional<CostOwnRun> CostParts::own_run(std::size_t row) const {
    const auto bytes = read_file_bytes(row_file(row));
    if (!bytes) return std::nullopt;
    const Json json = Json::parse(*bytes, nullptr, false);
    try {
        if (json.at("key").get<std::uint64_t>() != key_) return std::nullopt;
        return from_json(json.at("run"));
    } catch (const Json::exception&) { // damaged, or not ours: measured anew
        return std::nullopt;
    }
}

Result<void> CostParts::keep(std::size_t row, const CostOwnRun& run) const {
    if (auto made = make_folder(); !made) return made;
    const Json json{{"key", key_}, {"run", to_json(run)}};
    return write_file_atomically(row_file(row), json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

std::size_t CostParts::count(std::size_t rows) const {
    std::size_t there = exact_run().has_value();
    for (std::size_t row = 0; row < rows; ++row) there += own_run(row).has_value();
    return there;
}

void CostParts::remove(std::size_t rows) const {
    std::error_code ignored;
    std::filesystem::remove(start_file(), ignored);
    std::filesystem::remove(exact_file(), ignored);
    for (std::size_t row = 0; row < rows; ++row) std::filesystem::remove(row_file(row), ignored);
    std::filesystem::remove(folder_, ignored); // stays where it is not empty
}

} // namespace trocar::engine
