#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/gzip.hpp"
#include "engine/experiments/regression.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace trocar::engine {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kFormat = "trocar-reference";
constexpr int kVersion = 1;

Json part_json(const TracePart& part) {
    Json json{{"name", part.name}, {"ids", part.ids}, {"points", Json::array()}};
    for (const Vec3& p : part.points)
        for (int axis = 0; axis < 3; ++axis) json["points"].push_back(p[axis]);
    return json;
}

Json sample_json(const TraceSample& sample) {
    Json json{{"step", sample.step},         {"kinetic_j", sample.kinetic_j},       {"elastic_j", sample.elastic_j},
              {"contacts", sample.contacts}, {"pairs_tested", sample.pairs_tested}, {"hands", sample.drive_positions},
              {"parts", Json::array()}};
    for (const TracePart& part : sample.parts) json["parts"].push_back(part_json(part));
    return json;
}

/// Reads with a check of every type; nlohmann's exceptions end here.
TracePart part_of(const Json& json) {
    TracePart part;
    part.name = json.at("name").get<std::string>();
    part.ids = json.at("ids").get<std::vector<Index>>();
    const auto numbers = json.at("points").get<std::vector<double>>();
    for (std::size_t k = 0; k + 2 < numbers.size(); k += 3) part.points.emplace_back(numbers[k], numbers[k + 1], numbers[k + 2]);
    if (3 * part.ids.size() != numbers.size()) throw std::length_error("expected as many points as ids");
    return part;
}

TraceSample sample_of(const Json& json) {
    TraceSample sample;
    sample.step = json.at("step").get<std::uint64_t>();
    sample.kinetic_j = json.at("kinetic_j").get<double>();
    sample.elastic_j = json.at("elastic_j").get<double>();
    sample.contacts = json.at("contacts").get<std::uint64_t>();
    sample.pairs_tested = json.at("pairs_tested").get<std::uint64_t>();
    sample.drive_positions = json.at("hands").get<std::vector<double>>();
    for (const Json& part : json.at("parts")) sample.parts.push_back(part_of(part));
    return sample;
}

std::uint64_t hash_of(const Json& json) {
    const auto text = json.get<std::string>();
    std::size_t used = 0;
    const std::uint64_t hash = std::stoull(text, &used, 16);
    if (used != text.size()) throw std::invalid_argument("expected a hash in hexadecimal digits");
    return hash;
}

Trace trace_of(const Json& json) {
    Trace trace;
    trace.scene = json.at("scene").get<std::string>();
    trace.model_hash = hash_of(json.at("model"));
    trace.state_hash = hash_of(json.at("state"));
    trace.steps = json.at("steps").get<std::uint64_t>();
    trace.budget = json.at("budget").get<std::string>();
    for (const Json& sample : json.at("samples")) trace.samples.push_back(sample_of(sample));
    return trace;
}

Error broken(const std::filesystem::path& file, std::string message) {
    return {ErrorCode::BadSyntax, std::move(message) + "; `trocar verify --write-references` writes it anew", file.string()};
}

} // namespace

std::string trace_text(const Trace& trace) {
    Json json{{"format", kFormat},
              {"version", kVersion},
              {"scene", trace.scene},
              {"model", fmt::format("{:016x}", trace.model_hash)},
              {"steps", trace.steps},
              {"budget", trace.budget},
              {"state", fmt::format("{:016x}", trace.state_hash)},
              {"samples", Json::array()}};
    for (const TraceSample& sample : trace.samples) json["samples"].push_back(sample_json(sample));
    return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<Trace> read_trace(const std::filesystem::path& file) {
    const auto text = read_file_bytes(file);
    if (!text.ok()) return text.error();
    const Json json = Json::parse(*text, nullptr, false);
    if (!json.is_object() || json.value("format", Json()) != kFormat)
        return broken(file, "this is no reference of a regression run, or it is damaged");
    if (json.value("version", Json()) != kVersion) return broken(file, fmt::format("another version of references; expected {}", kVersion));
    try {
        return trace_of(json);
    } catch (const std::exception& problem) { // nlohmann's own words name the key
        return broken(file, fmt::format("a damaged reference: {}", problem.what()));
    }
}

Result<void> write_trace(const std::filesystem::path& file, const Trace& trace) {
    std::error_code failed;
    std::filesystem::create_directories(file.parent_path(), failed);
    if (failed) return Error{ErrorCode::CannotWrite, "its folder cannot be made: " + failed.message(), file.string()};
    const auto packed = gzip_bytes(trace_text(trace));
    if (!packed.ok()) return packed.error();
    return write_file_atomically(file, *packed);
}

} // namespace trocar::engine
