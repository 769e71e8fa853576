#include "bench/bench.hpp"

#include "bench/headlines.hpp"
#include "bench/tables.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/report/html.hpp"
#include "engine/report/plot_html.hpp"
#include "engine/report/places.hpp"
#include "engine/report/report_style.hpp"
#include "engine/step/model_hash.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

std::string cell(const BenchRow& value) {
    if (value.is_null()) return "-";
    if (value.is_string()) return value.get<std::string>();
    if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
    if (value.is_array()) {
        std::string text;
        for (const BenchRow& one : value) text += (text.empty() ? "" : " ") + cell(one);
        return text;
    }
    return value.dump();
}

std::vector<std::string> columns_of(const BenchTable& table) {
    std::vector<std::string> columns;
    for (const BenchRow& row : table.rows)
        for (const auto& [key, value] : row.items())
            if (std::find(columns.begin(), columns.end(), key) == columns.end()) columns.push_back(key);
    return columns;
}

} // namespace

std::string bench_command(std::string_view name, const BenchOptions& options) {
    return fmt::format("trocar bench {}{}{}{}{}", name, options.quick ? " --quick" : "", options.large ? " --large" : "",
                       options.threads > 0 ? fmt::format(" --threads {}", options.threads) : "",
                       options.scene.empty() ? "" : " --scene " + shell_quoted(project_path(options.scene)));
}

void note_scene(BenchTable& table, const Scene& scene, const SceneModel& model) {
    table.scenes.push_back({project_path(scene.file), hash_model(model)});
}

namespace {

std::string command_of(std::string_view name, const BenchTable& table) {
    return table.command.empty() ? bench_command(name, {.quick = table.quick}) : table.command;
}

} // namespace

nlohmann::ordered_json machine_json() {
    const Machine machine = describe_machine();
    nlohmann::ordered_json json;
    json["cpu"] = machine.processor;
    json["cores"] = machine.cores;
    json["memory_gib"] = machine.memory_gib;
    json["system"] = machine.system;
    json["avx2"] = static_cast<bool>(__builtin_cpu_supports("avx2"));
    json["avx512"] = static_cast<bool>(__builtin_cpu_supports("avx512f"));
    json["compiler"] = machine.compiler;
#ifdef __OPTIMIZE__
    json["build"] = "optimised";
#else
    json["build"] = "not optimised";
#endif
    return json;
}

nlohmann::ordered_json bench_json(std::string_view name, const BenchTable& table) {
    nlohmann::ordered_json json;
    json["bench"] = name;
    json["version"] = build_facts().version;
    json["commit"] = build_facts().commit;
    json["machine"] = machine_json();
    json["command"] = command_of(name, table);
    json["scenes"] = nlohmann::ordered_json::array();
    for (const BenchScene& scene : table.scenes) json["scenes"].push_back({{"file", scene.file}, {"model_hash", fmt::format("{:016x}", scene.model_hash)}});
    json["quick"] = table.quick;
    json["rows"] = table.rows;
    json["notes"] = table.notes;
    return json;
}

Result<ReadBench> read_bench(const std::filesystem::path& file) {
    const auto bytes = read_file_bytes(file);
    if (!bytes) return bytes.error();
    const auto json = BenchRow::parse(*bytes, nullptr, false);
    const auto is_bench = [](const BenchRow& b) {
        return b.is_object() && b.contains("bench") && b["bench"].is_string() && b.contains("rows") && b["rows"].is_array() &&
               std::all_of(b["rows"].begin(), b["rows"].end(), [](const BenchRow& row) { return row.is_object(); });
    };
    if (!is_bench(json)) return Error{ErrorCode::BadSyntax, "is not what `trocar bench NAME --json FILE` writes", file.string()};
    ReadBench read{json["bench"], {}};
    read.table.quick = json.contains("quick") && json["quick"] == true;
    read.table.rows.assign(json["rows"].begin(), json["rows"].end());
    if (json.contains("notes") && json["notes"].is_array())
        for (const BenchRow& note : json["notes"])
            if (note.is_string()) read.table.notes.push_back(note);
    return read;
}

std::string bench_text(const BenchTable& table) {
    const std::vector<std::string> columns = columns_of(table);
    std::vector<std::vector<std::string>> lines{columns};
    for (const BenchRow& row : table.rows) {
        std::vector<std::string>& line = lines.emplace_back();
        for (const std::string& column : columns) line.push_back(row.contains(column) ? cell(row[column]) : "");
    }
    std::string text;
    std::vector<std::size_t> width(columns.size(), 0);
    for (const auto& line : lines)
        for (std::size_t k = 0; k < line.size(); ++k) width[k] = std::max(width[k], line[k].size());
    for (const auto& line : lines) {
        for (std::size_t k = 0; k < line.size(); ++k) text += fmt::format("{:<{}}  ", line[k], width[k]);
        text.erase(text.find_last_not_of(' ') + 1);
        text += '\n';
    }
    for (const std::string& note : table.notes) text += "note: " + note + '\n';
    return text;
}

namespace {

std::string page_head(const std::string& title, const std::string& lead) {
    return fmt::format("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
                       "content=\"width=device-width,initial-scale=1\">\n<title>{0}</title>\n<style>{1}</style></head>\n<body><main class=\"broad\">\n"
                       "<p class=\"over\">trocar {0}</p>\n<p class=\"lead\">{2}</p>\n",
                       escape_html(title), kReportStyle, escape_html(lead));
}

/// command  that measures the page anew
std::string page_foot(const std::string& command, const std::string& scenes) {
    return fmt::format("<h2>To repeat it</h2>\n<pre>{}</pre>\n<dl>{}{}</dl>\n</main></body></html>\n", escape_html(command), scenes, facts_html(describe_machine()));
}

std::string scenes_html(const BenchTable& table) {
    std::string page;
    for (const BenchScene& scene : table.scenes)
        page += fmt::format("<dt>Scene</dt><dd>{}, hash <code>{:016x}</code> as it was prepared</dd>", escape_html(scene.file), scene.model_hash);
    return page;
}

std::string plots_html(const BenchTable& table) {
    if (table.sketches.empty()) return {};
    const Result<std::vector<Plot>> plots = draw_plots(table.sketches, table.plot_data);
    if (!plots) return fmt::format("<p class=\"soft\">No plots: {}</p>\n", escape_html(plots.error().to_string()));
    return plots_html(*plots);
}

/// A key may go on in a new line after each "_": of a dozen columns the last would lie beyond a laptop's edge.
std::string breakable(const std::string& key) {
    std::string text;
    for (const char c : key) text.append(1, c).append(c == '_' ? "<wbr>" : "");
    return text;
}

/// A long name of joined words, before each of them.
std::string breakable_words(const std::string& name) {
    constexpr std::size_t kLong = 30;
    if (name.size() < kLong || name.find(' ') != std::string::npos) return name;
    std::string text;
    for (const char c : name) {
        if (c >= 'A' && c <= 'Z' && !text.empty() && text.back() >= 'a' && text.back() <= 'z') text += "<wbr>";
        text += c;
    }
    return text;
}

/// A verdict as a dot and a word: the one that does not hold among fifty that do.
std::string verdict_html(bool holds) { return fmt::format("<span class=\"verdict-word\"><span class=\"dot{}\"></span>{}</span>", holds ? "" : " bad", holds ? "yes" : "no"); }

std::string cell_html(const std::string& column, const BenchRow& value) {
    if ((column == "holds" || column == "met") && value.is_boolean()) return verdict_html(value.get<bool>());
    return breakable_words(escape_html(cell(value)));
}

std::string rows_html(const BenchTable& table) {
    const std::vector<std::string> columns = columns_of(table);
    constexpr std::size_t kMany = 12;
    std::string page = fmt::format("<div class=\"scroll\"><table{}><tr>", columns.size() > kMany ? " class=\"many\"" : "");
    for (const std::string& column : columns) page += fmt::format("<th class=\"wrap\">{}</th>", breakable(escape_html(column)));
    page += "</tr>\n";
    for (const BenchRow& row : table.rows) {
        page += "<tr>";
        for (const std::string& column : columns)
            page += fmt::format("<td>{}</td>", row.contains(column) ? cell_html(column, row[column]) : "");
        page += "</tr>\n";
    }
    page += "</table></div>\n";
    for (const std::string& note : table.notes) page += fmt::format("<p class=\"soft\">{}</p>\n", escape_html(note));
    return page;
}

std::string headlines_html(std::span<const MeasuredBench> measured) {
    std::string page = "<div class=\"scroll\"><table><tr><th>bench</th><th>what</th><th>here</th><th>beside it</th>"
                       "<th class=\"n\">factor</th><th>where it differs</th></tr>\n";
    for (const MeasuredBench& one : measured)
        for (const Headline& line : headlines_of(one.bench->name, one.table))
            page += fmt::format("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"n\">{}</td><td>{}</td></tr>\n",
                                escape_html(one.bench->name), escape_html(line.what), escape_html(line.here), escape_html(line.beside),
                                line.factor ? fmt::format("{:.3g}", *line.factor) : "", escape_html(line.remark));
    return page + "</table></div>\n";
}

} // namespace

std::string bench_page(const Bench& bench, const BenchTable& table) {
    return page_head("bench " + std::string(bench.name), std::string(bench.what)) + plots_html(table) + "<h2>Figures</h2>\n" +
           rows_html(table) + page_foot(command_of(bench.name, table) + " --page FILE", scenes_html(table));
}

std::string all_benches_page(std::span<const MeasuredBench> measured) {
    const bool quick = std::any_of(measured.begin(), measured.end(), [](const MeasuredBench& one) { return one.table.quick; });
    std::string page =
        page_head("bench",
                  std::string("The papers' and the peers' tables, measured on this machine, with theirs beside ours.") +
                      (quick ? " A quick run: a small part of each, on smaller models, without factors against the papers." : "")) +
        headlines_html(measured);
    std::string scenes;
    for (const MeasuredBench& one : measured) scenes += scenes_html(one.table);
    for (const MeasuredBench& one : measured)
        page += fmt::format("<h2>{}</h2>\n<p>{}</p>\n", escape_html(one.bench->name), escape_html(one.bench->what)) +
                plots_html(one.table) + rows_html(one.table);
    return page + page_foot(std::string("trocar bench all") + (quick ? " --quick" : "") + " --page FILE", scenes);
}

std::optional<std::filesystem::path> find_peer(std::string_view name) {
    std::error_code failed;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", failed);
    if (failed) return std::nullopt;
    const auto peer = self.parent_path() / "peers" / name;
    return std::filesystem::is_regular_file(peer, failed) ? std::optional(peer) : std::nullopt;
}

std::span<const Bench> benches() { return kBenches; }

} // namespace trocar::engine
