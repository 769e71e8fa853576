#include "engine/io/csv.hpp"
#include "engine/experiments/sweep/draws.hpp"
#include "engine/experiments/sweep/reduction.hpp"
#include "engine/experiments/sweep/sweep_spec.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/report/episode_table.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/report/step_table.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/override.hpp"
#include "engine/scene/recipe.hpp"
#include "engine/scene/values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

constexpr std::size_t kMostPointers = 1000; // each is compared with each
constexpr double kLargestInteger = 9007199254740992.0; // 2^53

/// Of all pointers together; a run has one for each. Checked before they are made.
constexpr std::uint64_t kMostValues = 4'000'000;

TextPosition position_of(CsvPlace place) { return {place.line, place.column}; }

/// What the reading functions share.
class SweepReader {
public:
    SweepReader(const CheckContext& context, const JsonNode& root, SweepSpec& spec) : context_(context), root_(root), spec_(spec) {}

    std::optional<Error> read() {
        read_plain_keys();
        if (auto error = read_rows()) return error;
        if (auto error = read_vary()) return error;
        if (auto error = read_collect()) return error;
        return check_verify();
    }

private:
    Error fail(TextPosition at, std::string key, std::string message) const { return error_at(context_, at, std::move(key), std::move(message)); }

    void read_plain_keys() {
        const JsonNode& scene = *root_.find("scene");
        spec_.is_list = scene.type == JsonType::List;
        for (const JsonNode& one : spec_.is_list ? scene.children : std::vector<JsonNode>{scene}) {
            spec_.scenes.push_back(one.text);
            spec_.scene_at.push_back(one.at);
        }
        const Values values(&root_, sweep_table(), context_.units, "");
        for (const SweepCommand command : kSweepCommands)
            if (values.text("command") == command_name(command)) spec_.command = command;
        if (const JsonNode* options = root_.find("options")) {
            spec_.options_at = options->at;
            for (const JsonNode& word : options->children) spec_.options.push_back(word.text);
        }
        spec_.repeat = values.count<std::uint64_t>("repeat");
        spec_.keeps_folders = values.text("keep") == "folder";
        if (values.has("time_limit")) spec_.time_limit = values.number("time_limit");
    }

    std::optional<Error> add_pointer(SweepAxis& axis, const std::string& pointer, const std::string& file, TextPosition at, const std::string& key) {
        const Result<std::vector<std::string>> keys = is_option(pointer) ? std::vector<std::string>{pointer} : split_pointer(pointer);
        const auto refuse = [&](std::string message) { return Error{ErrorCode::BadValue, std::move(message), file, at.line, at.column, key}; };
        if (!keys) return refuse(keys.error().message);
        if (is_option(pointer) && pointer.find_first_of("= ") != std::string::npos)
            return refuse(fmt::format("found \"{:.60}\"; expected the name of an option alone, as in --budgets", pointer));
        if (known_.size() >= kMostPointers) return refuse(fmt::format("found more than {} pointers; expected fewer", kMostPointers));
        for (const auto& [known, name] : known_) {
            const std::size_t common = std::min(known.size(), keys->size());
            if (std::equal(known.begin(), known.begin() + static_cast<std::ptrdiff_t>(common), keys->begin()))
                return refuse(known.size() == keys->size() ? fmt::format("the pointer {} is varied twice; expected once", pointer)
                                                           : fmt::format("{} and {} are varied, and one is a part of the other", name, pointer));
        }
        known_.emplace_back(*keys, pointer);
        axis.pointers.push_back(pointer);
        axis.pointer_at.push_back(at);
        return std::nullopt;
    }

    std::optional<Error> read_rows() {
        const JsonNode* node = root_.find("rows");
        if (node == nullptr) return std::nullopt;
        const auto path = resolve_file(node->text, context_.folder);
        if (!path) return fail(node->at, "rows", path.error().message);
        const auto bytes = read_file_bytes(*path);
        if (!bytes) return bytes.error();
        const auto rows = read_csv(*bytes, *path);
        if (!rows) return rows.error();
        const std::vector<CsvRow>& table = *rows;
        SweepAxis axis;
        axis.file = path->string();
        const auto refuse = [&](CsvPlace at, std::string message, std::string pointer = {}) {
            return Error{ErrorCode::BadValue, std::move(message), axis.file, at.line, at.column, std::move(pointer)};
        };
        if (table.size() < 2) return refuse({1, 1}, "found no rows; expected a header of pointers and a row or more");
        if (table.size() - 1 > kMostRuns)
            return refuse(table[kMostRuns + 1].places.front(), fmt::format("found {} rows; expected at most {}", table.size() - 1, kMostRuns));
        const CsvRow& header = table.front();
        for (std::size_t p = 0; p < header.cells.size(); ++p)
            if (auto error = add_pointer(axis, header.cells[p], axis.file, position_of(header.places[p]), "")) return error;
        for (std::size_t i = 1; i < table.size(); ++i) {
            const auto& [line, cells, places] = table[i];
            if (cells.size() != axis.pointers.size())
                return refuse(places[std::min(axis.pointers.size(), cells.size() - 1)],
                              fmt::format("found {} cells; expected {}, as in the header", cells.size(), axis.pointers.size()));
            std::vector<std::string>& row = axis.values.emplace_back();
            for (std::size_t p = 0; p < cells.size(); ++p) {
                const auto override = parse_override("/x=" + cells[p]);
                if (!override) return refuse(places[p], override.error().message, axis.pointers[p]);
                row.push_back(json_text(override->value));
                axis.value_at.push_back(position_of(places[p]));
            }
        }
        spec_.axes.push_back(std::move(axis));
        return std::nullopt;
    }

    std::optional<Error> read_vary() {
        const JsonNode* vary = root_.find("vary");
        const JsonNode* draws = root_.find("draws");
        if (vary != nullptr)
            for (const JsonNode& one : vary->children)
                if (auto error = read_axis(one, draws)) return error;
        if (draws != nullptr && drawn_ == kNone) return fail(draws->key_at, "draws", "nothing is drawn; expected it left out, or a random value in vary");
        return std::nullopt;
    }

    std::optional<Error> read_axis(const JsonNode& node, const JsonNode* draws) {
        const std::string key = join_key("vary", fmt::format("{:.200}", node.key));
        const bool is_draw = node.type == JsonType::Object && node.find("from") == nullptr;
        if (!is_draw) {
            SweepAxis axis;
            axis.file = context_.file_name;
            if (auto error = add_pointer(axis, node.key, axis.file, node.key_at, "vary")) return error;
            if (auto error = node.type == JsonType::List ? read_list(node, axis) : read_range(node, axis, key)) return error;
            spec_.axes.push_back(std::move(axis));
            return std::nullopt;
        }
        if (draws == nullptr) return fail(node.at, key, "is drawn; expected the sweep to say how often, as in \"draws\": {\"count\": 100, \"seed\": 1}");
        const auto count = static_cast<std::size_t>(draws->find("count")->number);
        const JsonNode* seed = draws->find("seed");
        if (auto error = count_values(node.at, key, count)) return error;
        if (drawn_ == kNone) {
            drawn_ = spec_.axes.size();
            spec_.axes.emplace_back().file = context_.file_name;
            spec_.axes.back().values.resize(count);
        }
        if (auto error = add_pointer(spec_.axes[drawn_], node.key, context_.file_name, node.key_at, "vary")) return error;
        return draw(node, DrawStream(seed != nullptr ? static_cast<std::uint64_t>(seed->number) : 0, node.key), spec_.axes[drawn_], key);
    }

    static std::optional<Error> read_list(const JsonNode& node, SweepAxis& axis) {
        for (const JsonNode& value : node.children) {
            axis.values.push_back({json_text(value)});
            axis.value_at.push_back(value.at);
        }
        return std::nullopt;
    }

    /// Before `more` values of one pointer are made.
    std::optional<Error> count_values(TextPosition at, const std::string& key, std::uint64_t more) {
        values_ += more;
        if (values_ <= kMostValues) return std::nullopt;
        return fail(at, key, fmt::format("found more than {0} values with those before; expected at most {0} in all", kMostValues));
    }

    std::optional<Error> read_range(const JsonNode& node, SweepAxis& axis, const std::string& key) {
        const double from = node.find("from")->number, to = node.find("to")->number;
        const auto count = static_cast<std::size_t>(node.find("count")->number);
        if (auto error = count_values(node.at, key, count)) return error;
        const JsonNode* scale = node.find("scale");
        const bool log = scale != nullptr && scale->text == "log";
        if (log && (from <= 0.0 || to <= 0.0)) return fail(node.at, key, fmt::format("a log range from {:g} to {:g}; expected both above 0", from, to));
        if (!std::isfinite(to - from)) return fail(node.at, key, fmt::format("a range from {:g} to {:g} is too long", from, to));
        if (from == to && count > 1)
            return fail(node.at, key, fmt::format("found {} times {:g}; expected a count of 1, and \"repeat\" for the same run again", count, from));
        for (std::string& value : range_values(from, to, count, log)) axis.values.push_back({std::move(value)});
        return std::nullopt;
    }

    std::optional<Error> draw(const JsonNode& node, DrawStream stream, SweepAxis& axis, const std::string& key) const {
        const JsonNode& what = node.children.front();
        const bool choice = what.key == "choice";
        const double a = choice ? 0.0 : what.children[0].number, b = choice ? 0.0 : what.children[1].number;
        const auto refuse = [&](const char* expected) { return fail(what.at, join_key(key, what.key), fmt::format("found [{:g}, {:g}]; expected {}", a, b, expected)); };
        if (what.key == "normal" ? b < 0.0 : a > b) return refuse(what.key == "normal" ? "a deviation of at least 0" : "the smaller bound first");
        if (what.key == "log_uniform" && a <= 0.0) return refuse("bounds above 0");
        if (!std::isfinite(b - a)) return refuse("bounds that are nearer");
        if (what.key == "integer" && (a != std::floor(a) || b != std::floor(b) || std::abs(a) > kLargestInteger || std::abs(b) > kLargestInteger))
            return refuse("integers");
        for (std::vector<std::string>& row : axis.values) {
            if (choice)
                row.push_back(json_text(what.children[stream.below(what.children.size())]));
            else if (what.key == "integer")
                row.push_back(fmt::format("{:.0f}", a + static_cast<double>(stream.below(static_cast<std::uint64_t>(b - a) + 1))));
            else if (what.key == "normal")
                row.push_back(number_json(a + b * stream.normal()));
            else if (what.key == "log_uniform")
                row.push_back(number_json(std::clamp(a * std::exp(stream.uniform() * std::log(b / a)), a, b)));
            else
                row.push_back(number_json(a + (b - a) * stream.uniform()));
        }
        return std::nullopt;
    }

    std::optional<Error> read_collect() {
        const JsonNode* collect = root_.find("collect");
        if (collect == nullptr) return std::nullopt;
        for (const JsonNode& member : collect->children) {
            CollectItem item{member.key, {}, {}, {}, member.at};
            const std::string key = join_key("collect", member.key);
            const bool is_varied = std::any_of(known_.begin(), known_.end(), [&](const auto& known) { return known.second == member.key; });
            if (is_varied || member.key == "repeat" || member.key == "status" || member.key == "scene")
                return fail(member.key_at, key, "the table has such a column already; expected another name");
            if (member.type == JsonType::Text) {
                item.pointer = member.text;
                if (const auto keys = split_pointer(item.pointer); !keys) return fail(member.at, key, keys.error().message);
            } else if (auto error = read_reduction(member, item, key))
                return error;
            spec_.collect.push_back(std::move(item));
        }
        return std::nullopt;
    }

    std::optional<Error> read_reduction(const JsonNode& node, CollectItem& item, const std::string& key) const {
        item.column = node.find("column")->text;
        item.take = node.find("take")->text;
        if (table_file(spec_.command) == nullptr)
            return fail(node.at, key, fmt::format("{} writes no steps.csv; expected a pointer into its figures", command_name(spec_.command)));
        const std::string header = spec_.command == SweepCommand::Episode ? action_table_header() : step_table_header();
        std::vector<std::string_view> columns;
        for (std::string_view rest = header; !rest.empty();) {
            const std::size_t comma = rest.find(',');
            columns.push_back(rest.substr(0, comma));
            rest.remove_prefix(comma == std::string_view::npos ? rest.size() : comma + 1);
        }
        if (std::find(columns.begin(), columns.end(), item.column) == columns.end())
            return fail(node.find("column")->at, join_key(key, "column"), refuse_unknown("column", item.column, columns));
        return std::nullopt;
    }

    /// A list of scenes is no scene: nothing in it can be varied, and its figures are an exit code.
    std::optional<Error> check_verify() const {
        if (spec_.command != SweepCommand::Verify) return std::nullopt;
        for (const char* key : {"vary", "rows", "collect"})
            if (const JsonNode* node = root_.find(key))
                return fail(node->key_at, key, "verify reads a list of scenes, and its answer is the row's status; expected the key left out");
        return std::nullopt;
    }

    static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    const CheckContext& context_;
    const JsonNode& root_;
    SweepSpec& spec_;
    std::size_t drawn_ = kNone; // the axis of drawn pointers
    std::uint64_t values_ = 0;  // of ranges and draws
    std::vector<std::pair<std::vector<std::string>, std::string>> known_;
};

/// How many runs all of it comes to.
std::optional<Error> check_count(const SweepSpec& spec) {
    std::uint64_t runs = spec.scenes.size() * spec.repeat; // at most 5e5 * 1e6
    for (const SweepAxis& axis : spec.axes) runs = std::min(runs, kMostRuns + 1) * axis.values.size();
    if (runs <= kMostRuns) return std::nullopt;
    return Error{ErrorCode::BadValue, fmt::format("found more than {0} runs, with all combinations; expected at most {0}", kMostRuns), spec.file.string()};
}

} // namespace

const char* command_name(SweepCommand command) noexcept {
    constexpr const char* kNames[] = {"run", "cost", "plan", "verify", "episode"};
    return kNames[static_cast<std::size_t>(command)];
}

const char* figures_file(SweepCommand command) noexcept {
    constexpr const char* kNames[] = {"summary.json", "cost.json", "plan.json", nullptr, "summary.json"};
    return kNames[static_cast<std::size_t>(command)];
}

const char* table_file(SweepCommand command) noexcept {
    if (command == SweepCommand::Episode) return output_name::kActions;
    return command == SweepCommand::Run ? output_name::kSteps : nullptr;
}

std::filesystem::path SweepSpec::folder() const {
    std::error_code failed;
    const std::filesystem::path whole = std::filesystem::absolute(file, failed);
    return (failed ? file : whole).lexically_normal().parent_path();
}

Result<SweepSpec> read_sweep(const std::filesystem::path& file) {
    const auto text = read_json_file(file);
    if (!text) return text.error();
    return parse_sweep(*text, file);
}

Result<SweepSpec> parse_sweep(std::string_view text, const std::filesystem::path& file) {
    const auto tree = parse_json_tree(text, file.string());
    if (!tree) return tree.error();
    CheckContext context{file.string(), file.parent_path(), {}, {}, {}};
    if (auto error = check_object(*tree, sweep_table(), "", context)) return *error;
    SweepSpec spec;
    spec.file = file;
    if (auto error = SweepReader(context, *tree, spec).read()) return *error;
    if (auto error = check_count(spec)) return *error;
    return spec;
}

} // namespace trocar::engine
