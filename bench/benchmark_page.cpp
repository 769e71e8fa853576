#include "bench/benchmark_page.hpp"

#include "bench/bench.hpp"
#include "bench/headlines.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/time/date.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

/// Whose rows the page shows, all of them.
constexpr std::string_view kShownWhole = "literature";

using Measured = std::vector<BenchRow>; // in the order in which benches are listed

std::string text_of(const BenchRow& json, const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

double number_of(const BenchRow& json, const char* key) {
    const auto found = json.find(key);
    return found != json.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::filesystem::path file_of(const std::filesystem::path& docs, std::string_view name) {
    return docs / "measured" / (std::string(name) + ".json");
}

bool is_measured(const BenchRow& json, std::string_view name) {
    const auto is_list = [&](const char* key) {
        return json.contains(key) && json[key].is_array() &&
               std::all_of(json[key].begin(), json[key].end(), [](const BenchRow& one) { return one.is_object(); });
    };
    return json.is_object() && text_of(json, "bench") == name && !text_of(json, "date").empty() && json.contains("machine") &&
           json["machine"].is_object() && is_list("headlines") && (name != kShownWhole || is_list("rows"));
}

Result<Measured> read_measured(const std::filesystem::path& docs) {
    Measured measured;
    for (const Bench& bench : benches()) {
        const std::filesystem::path file = file_of(docs, bench.name);
        std::error_code none;
        if (!std::filesystem::exists(file, none)) continue;
        const auto bytes = read_file_bytes(file);
        if (!bytes) return bytes.error();
        BenchRow json = BenchRow::parse(*bytes, nullptr, false);
        if (!is_measured(json, bench.name))
            return Error{ErrorCode::BadSyntax, fmt::format("is not what `trocar bench {} --docs DIR` writes; expected that", bench.name), file.string()};
        measured.push_back(std::move(json));
    }
    return measured;
}

std::string headlines_table(const Measured& measured) {
    std::string page = "| `trocar bench` | what | here | beside it | factor |\n| --- | --- | --- | --- | --- |\n";
    for (const BenchRow& one : measured)
        for (const BenchRow& line : one["headlines"]) {
            const std::string beside = text_of(line, "beside"), remark = text_of(line, "remark"), between = beside.empty() || remark.empty() ? "" : "; ";
            page += fmt::format("| `{}` | {} | {} | {} | {} |\n", text_of(one, "bench"), markdown_cell(text_of(line, "what")),
                                markdown_cell(text_of(line, "here")), markdown_cell(beside + between + remark),
                                line.contains("factor") && line["factor"].is_number() ? fmt::format("{:.3g}", line["factor"].get<double>()) : "");
        }
    return page;
}

std::string machine_text(const BenchRow& machine) {
    std::string text = text_of(machine, "cpu");
    if (text.empty()) text = "not noted";
    if (number_of(machine, "cores") > 0.0) text += fmt::format(", {:g} cores", number_of(machine, "cores"));
    if (machine.contains("avx512")) text += machine["avx512"] == true ? ", AVX-512" : machine["avx2"] == true ? ", AVX2" : "";
    return text;
}

std::string runs_table(const Measured& measured) {
    std::string page = "| command | date | commit | machine |\n| --- | --- | --- | --- |\n";
    for (const BenchRow& one : measured)
        page += fmt::format("| `{}` | {} | {} | {} |\n", markdown_cell(text_of(one, "command")), markdown_cell(text_of(one, "date")),
                            markdown_cell(text_of(one, "commit")), markdown_cell(machine_text(one["machine"])));
    return page;
}

/// "8: 46.83, **32**: 47.13": every size and what was measured there, the stated one in bold.
std::string resolutions(const BenchRow& row) {
    std::string text;
    if (!row.contains("sizes") || !row.contains("measured")) return text;
    for (std::size_t k = 0; k < std::min(row["sizes"].size(), row["measured"].size()); ++k) {
        if (!row["sizes"][k].is_number() || !row["measured"][k].is_number()) continue;
        const double size = row["sizes"][k].get<double>();
        text += fmt::format("{}{}: {:.4g}", text.empty() ? "" : ", ", size == number_of(row, "stated_size") ? fmt::format("**{:g}**", size) : fmt::format("{:g}", size),
                            row["measured"][k].get<double>());
    }
    return text;
}

std::string literature_table(const Measured& measured) {
    std::string page = "| case | quantity | reference | measured | order | error | met |\n| --- | --- | --- | --- | --- | --- | --- |\n";
    for (const BenchRow& one : measured) {
        if (text_of(one, "bench") != kShownWhole) continue;
        std::string last;
        for (const BenchRow& row : one["rows"]) {
            const std::string name = fmt::format("{} ({})", text_of(row, "case"), text_of(row, "source"));
            const std::string why = text_of(row, "why_missed");
            page += fmt::format("| {} | {} | {:.4g}{} | {} | {} | {:.2g} | {} |\n", markdown_cell(name == last ? "" : name), markdown_cell(text_of(row, "quantity")),
                                number_of(row, "reference"), text_of(row, "reference_is") == "quoted" ? ", quoted" : "", resolutions(row),
                                row.contains("order") && row["order"].is_number() ? fmt::format("{:.1f}", row["order"].get<double>()) : "",
                                number_of(row, "error"), row.contains("met") && row["met"] == true ? "yes" : markdown_cell(why.empty() ? "no" : "no: " + why));
            last = name;
        }
    }
    return page;
}

struct Region {
    std::string_view name;
    std::string (*make)(const Measured&);
};
constexpr Region kRegions[] = {{"headlines", headlines_table}, {"runs", runs_table}, {"literature", literature_table}};

} // namespace

Result<void> keep_measured(const std::filesystem::path& docs, std::string_view name, const BenchTable& table) {
    if (table.quick) return Error{ErrorCode::BadUsage, "found --quick beside --docs, expected the whole table: the page shows what was measured", {}, 0, 0, "--docs"};
    BenchRow json = bench_json(name, table);
    BenchRow kept;
    kept["bench"] = name;
    for (const char* key : {"version", "commit"}) kept[key] = json[key];
    kept["date"] = today();
    for (const char* key : {"machine", "command"}) kept[key] = json[key];
    kept["headlines"] = BenchRow::array();
    for (const Headline& line : headlines_of(name, table)) {
        BenchRow one{{"what", line.what}, {"here", line.here}, {"beside", line.beside}, {"factor", nullptr}, {"remark", line.remark}};
        if (line.factor) one["factor"] = *line.factor;
        kept["headlines"].push_back(std::move(one));
    }
    if (name == kShownWhole) kept["rows"] = table.rows;
    std::error_code failed;
    std::filesystem::create_directories(docs / "measured", failed);
    if (failed) return Error{ErrorCode::CannotWrite, failed.message(), (docs / "measured").string()};
    return write_file_atomically(file_of(docs, name), kept.dump(1) + "\n");
}

Result<void> write_benchmark_page(const std::filesystem::path& docs) {
    const std::filesystem::path file = docs / "benchmarks.md";
    const auto old = read_file_bytes(file);
    if (!old) return old.error();
    const auto measured = read_measured(docs);
    if (!measured) return measured.error();
    std::string page(old->begin(), old->end());
    for (const Region& region : kRegions) {
        const std::string begin = fmt::format("<!-- {}: written by trocar bench --docs -->\n", region.name), end = fmt::format("<!-- end of {} -->\n", region.name);
        const std::size_t from = page.find(begin), to = page.find(end);
        if (from == std::string::npos || to == std::string::npos || to < from)
            return Error{ErrorCode::BadSyntax, fmt::format("found no {} table, expected \"{}\" and \"{}\" on lines of their own", region.name,
                                                           begin.substr(0, begin.size() - 1), end.substr(0, end.size() - 1)), file.string()};
        page.replace(from + begin.size(), to - from - begin.size(), region.make(*measured));
    }
    return write_file_atomically(file, page);
}

} // namespace trocar::engine
