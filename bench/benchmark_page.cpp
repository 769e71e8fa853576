#include "bench/benchmark_page.hpp"

#include "bench/bench.hpp"
#include "bench/headlines.hpp"
#include "bench/row_values.hpp"
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

std::filesystem::path file_of(const std::filesystem::path& docs, std::string_view name) {
    return docs / "measured" / (std::string(name) + ".json");
}

bool is_list_of_objects(const BenchRow& value) {
    return value.is_array() && std::all_of(value.begin(), value.end(), [](const BenchRow& one) { return one.is_object(); });
}

bool is_measured(const BenchRow& json, std::string_view name) {
    return row_text(json, "bench") == name && !row_text(json, "date").empty() && row_value(json, "machine").is_object() &&
           is_list_of_objects(row_value(json, "headlines")) && (name != kShownWhole || is_list_of_objects(row_value(json, "rows")));
}

Result<Measured> read_measured(const std::filesystem::path& docs) {
    Measured measured;
    for (const Bench& bench : benches()) {
        const std::filesystem::path file = file_of(docs, bench.name);
        std::error_code failed;
        const auto status = std::filesystem::status(file, failed);
        if (status.type() == std::filesystem::file_type::not_found) continue;
        const auto bytes = read_file_bytes(file);
        if (!bytes) return bytes.error();
        BenchRow json = BenchRow::parse(*bytes, nullptr, false);
        if (!is_measured(json, bench.name))
            return Error{ErrorCode::BadSyntax, fmt::format("found another text, expected what `trocar bench {} --docs DIR` writes", bench.name), file.string()};
        measured.push_back(std::move(json));
    }
    return measured;
}

std::string headlines_table(const Measured& measured) {
    std::vector<BenchHeadlines> benches;
    for (const BenchRow& one : measured) {
        BenchHeadlines& own = benches.emplace_back(BenchHeadlines{row_text(one, "bench"), {}});
        for (const BenchRow& line : row_value(one, "headlines"))
            own.lines.push_back({row_text(line, "what"), row_text(line, "here"), row_text(line, "beside"), row_number(line, "factor"), row_text(line, "remark")});
    }
    return headlines_markdown(benches);
}

std::string machine_text(const BenchRow& machine) {
    const std::string cpu = row_text(machine, "cpu");
    std::string text = cpu.empty() ? "not noted" : cpu;
    if (const auto cores = row_number(machine, "cores")) text += fmt::format(", {:g} cores", *cores);
    for (const auto& [key, name] : {std::pair("avx512", "AVX-512"), std::pair("avx2", "AVX2")})
        if (row_value(machine, key) == true) return text + ", " + name;
    return text;
}

std::string runs_table(const Measured& measured) {
    std::string page = "| command | date | commit | machine |\n| --- | --- | --- | --- |\n";
    for (const BenchRow& one : measured)
        page += fmt::format("| `{}` | {} | {} | {} |\n", markdown_cell(row_text(one, "command")), markdown_cell(row_text(one, "date")),
                            markdown_cell(row_text(one, "commit")), markdown_cell(machine_text(row_value(one, "machine"))));
    return page;
}

/// "8: 46.83, **32**: 47.13": every size and what was measured there, the stated one in bold.
std::string resolutions(const BenchRow& row) {
    const BenchRow &sizes = row_value(row, "sizes"), &measured = row_value(row, "measured");
    std::string text;
    if (!sizes.is_array() || !measured.is_array()) return text;
    for (std::size_t k = 0; k < std::min(sizes.size(), measured.size()); ++k) {
        if (!sizes[k].is_number() || !measured[k].is_number()) continue;
        const char* bold = row_number(row, "stated_size") == sizes[k].get<double>() ? "**" : "";
        text += fmt::format("{}{}{:g}{}: {:.4g}", text.empty() ? "" : ", ", bold, sizes[k].get<double>(), bold, measured[k].get<double>());
    }
    return text;
}

std::string literature_row(const BenchRow& row, const std::string& name) {
    const auto order = row_number(row, "order");
    const std::string why = row_text(row, "why_missed"), missed = why.empty() ? "no" : "no: " + why;
    return fmt::format("| {} | {} | {:.4g}{} | {} | {} | {:.2g} | {} |\n", markdown_cell(name), markdown_cell(row_text(row, "quantity")),
                       row_number(row, "reference").value_or(0.0), row_text(row, "reference_is") == "quoted" ? ", quoted" : "", resolutions(row),
                       order ? fmt::format("{:.1f}", *order) : "", row_number(row, "error").value_or(0.0),
                       row_value(row, "met") == true ? "yes" : markdown_cell(missed));
}

std::string literature_table(const Measured& measured) {
    std::string page = "| case | quantity | reference | measured | order | error | met |\n| --- | --- | --- | --- | --- | --- | --- |\n";
    for (const BenchRow& one : measured) {
        if (row_text(one, "bench") != kShownWhole) continue;
        std::string last;
        for (const BenchRow& row : row_value(one, "rows")) {
            const std::string name = fmt::format("{} ({})", row_text(row, "case"), row_text(row, "source"));
            page += literature_row(row, name == last ? "" : name);
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

Result<std::string> make_benchmark_page(const std::filesystem::path& docs) {
    const std::filesystem::path file = docs / "benchmarks.md";
    const auto old = read_file_bytes(file);
    if (!old) return old.error();
    const auto measured = read_measured(docs);
    if (!measured) return measured.error();
    std::string page = *old;
    for (const Region& region : kRegions) {
        const std::string begin = fmt::format("<!-- {}: written by trocar bench --docs -->", region.name), end = fmt::format("<!-- end of {} -->", region.name);
        const std::size_t from = page.find(begin + "\n"), to = page.find(end + "\n");
        if (from == std::string::npos || to == std::string::npos || to < from)
            return Error{ErrorCode::BadSyntax, fmt::format("found no table \"{}\", expected \"{}\" and \"{}\" on lines of their own", region.name, begin, end),
                         file.string()};
        const std::size_t first = from + begin.size() + 1;
        page.replace(first, to - first, region.make(*measured));
    }
    return page;
}

Result<void> write_benchmark_page(const std::filesystem::path& docs) {
    const auto page = make_benchmark_page(docs);
    if (!page) return page.error();
    if (std::error_code none; std::filesystem::is_empty(docs / "measured", none) || none)
        return Error{ErrorCode::FileNotFound, "found nothing measured, expected what `trocar bench NAME --docs DIR` writes", (docs / "measured").string()};
    return write_file_atomically(docs / "benchmarks.md", *page);
}

} // namespace trocar::engine
