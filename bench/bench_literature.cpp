// The literature's cases: reference, what was measured at several resolutions, its order of convergence, and whether the target is met.
#include "bench/literature.hpp"
#include "bench/tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace trocar::engine {

double LiteratureRow::error(std::size_t at) const {
    return reference == 0.0 ? std::abs(measured[at]) : std::abs(measured[at] / reference - 1.0);
}

double LiteratureRow::stated_error() const {
    const auto found = std::find(sizes.begin(), sizes.end(), stated);
    return error(found == sizes.end() ? sizes.size() - 1 : static_cast<std::size_t>(found - sizes.begin()));
}

/// Of three sizes: the p with (m0 - m1) / (m1 - m2) = (h0^p - h1^p) / (h1^p - h2^p), h = 1 / size. It asks for no reference; 0 where values go
/// to and fro, or move within rounding.
double LiteratureRow::order() const {
    constexpr double kRounding = 1e-9, kLeast = 0.1, kMost = 8.0;
    if (sizes.size() < 3) return 0.0;
    const std::size_t last = sizes.size() - 1;
    const double before = measured[last - 2] - measured[last - 1], after = measured[last - 1] - measured[last];
    if (std::abs(after) < kRounding || !(before / after > 1.0)) return 0.0;
    const auto ratio = [&](double p) {
        const double h0 = std::pow(sizes[last - 2], -p), h1 = std::pow(sizes[last - 1], -p), h2 = std::pow(sizes[last], -p);
        return (h0 - h1) / (h1 - h2);
    };
    double low = kLeast, high = kMost;
    for (int round = 0; round < 50; ++round) {
        const double middle = 0.5 * (low + high);
        (ratio(middle) < before / after ? low : high) = middle;
    }
    return low < 1.01 * kLeast || high > 0.99 * kMost ? 0.0 : 0.5 * (low + high);
}

namespace {

BenchRow json_row(const LiteratureRow& row) {
    const double error = row.stated_error();
    BenchRow json{{"case", row.name},
                  {"quantity", row.quantity},
                  {"source", row.source},
                  {"reference", row.reference},
                  {"reference_is", row.kind == ReferenceKind::Quoted ? "quoted" : row.kind == ReferenceKind::Beside ? "run beside it" : "closed form"},
                  {"refined", row.size_name},
                  {"sizes", row.sizes},
                  {"measured", row.measured}};
    if (row.order() != 0.0)
        json["order"] = row.order();
    else
        json["order"] = nullptr;
    json["stated_size"] = row.stated;
    json["error"] = error;
    json["target"] = row.target;
    json["met"] = error <= row.target;
    json["bound"] = row.bound;
    json["holds"] = error <= row.bound;
    json["why_missed"] = error <= row.target ? std::string() : row.reason;
    return json;
}

/// In single quotes, for a text in which nothing is markup.
std::string quote_plain(const std::string& text) {
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("\'\'") : std::string(1, c);
    return quoted + '\'';
}

constexpr double kNoError = 1e-17; // drawn where there is none: the axis is logarithmic

/// All rows of one case in one figure: errors over what is refined, the target as a line. None where only one size was run: the table has it.
void add_figure(std::span<const LiteratureRow> rows, std::size_t number, BenchTable& table) {
    if (rows.front().sizes.size() < 2) return;
    std::string name = "case";
    name += static_cast<char>('a' + number / 26);
    name += static_cast<char>('a' + number % 26);
    Sketch sketch;
    sketch.plot = {name, rows.front().name, fmt::format("Relative error over the number of {}; dashed: the target at {:g}.", rows.front().size_name, rows.front().stated), {}};
    double least = rows.front().target, most = least;
    for (const LiteratureRow& row : rows)
        for (std::size_t at = 0; at < row.sizes.size(); ++at) {
            const double error = std::max(row.error(at), kNoError);
            least = std::min(least, error), most = std::max(most, error);
        }
    std::string ticks;
    for (const double size : rows.front().sizes) fmt::format_to(std::back_inserter(ticks), "{}{:g}", ticks.empty() ? "" : ",", size);
    sketch.commands = fmt::format("set ylabel 'relative error [-]' textcolor rgb '#4b5563' offset 1,0\nset xlabel {} textcolor rgb '#4b5563' offset 0,0.4\n"
                                  "set logscale xy\nset format y '10^{{%L}}'\nset xtics ({})\nset xrange [{:g}:{:g}]\nset yrange [1e{:.0f}:1e{:.0f}]\nset key outside top center maxcols 1 noenhanced\nset tmargin {:g}\nplot {:g} with lines lw 1.2 "
                                  "dt (6,4) lc rgb '#9aa3ad' notitle",
                                  quote_for_gnuplot("number of " + rows.front().size_name), ticks, 0.8 * rows.front().sizes.front(), 1.25 * rows.front().sizes.back(),
                                  std::floor(std::log10(0.9 * least)), std::ceil(std::log10(1.1 * most)),
                                  1.0 + 1.25 * static_cast<double>(rows.size()), rows.front().target);
    sketch.height += 17 * static_cast<int>(rows.size());
    constexpr const char* kColours[] = {"#2158d6", "#d97706", "#0f9d76", "#d64545", "#7c4dbd", "#5a6570"};
    for (std::size_t k = 0; k < rows.size(); ++k) {
        std::string text;
        for (std::size_t at = 0; at < rows[k].sizes.size(); ++at)
            fmt::format_to(std::back_inserter(text), "{:g} {:.6g}\n", rows[k].sizes[at], std::max(rows[k].error(at), kNoError));
        const std::string file = fmt::format("{}_{}.tsv", name, k);
        sketch.commands += fmt::format(", '{}' using 1:2 with linespoints pt 7 ps 0.7 lw 1.6 lc rgb '{}' title {}", file, kColours[k % std::size(kColours)],
                                       quote_plain(rows[k].quantity));
        table.plot_data.push_back({file, text});
    }
    table.sketches.push_back(std::move(sketch));
}

void add_figures(std::span<const LiteratureRow> rows, BenchTable& table) {
    std::size_t number = 0;
    for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
        while (end < rows.size() && rows[end].name == rows[begin].name) ++end;
        add_figure(rows.subspan(begin, end - begin), number++, table);
    }
}

} // namespace

Result<BenchTable> bench_literature(const BenchOptions& options) {
    BenchTable table;
    table.quick = options.quick;
    options.progress("rods");
    std::vector<LiteratureRow> rows = measure_rod_literature(options.quick);
    options.progress("tissue");
    for (LiteratureRow& row : measure_tissue_literature(options.quick)) rows.push_back(std::move(row));
    std::size_t met = 0;
    for (const LiteratureRow& row : rows) {
        table.rows.push_back(json_row(row));
        met += row.stated_error() <= row.target;
    }
    add_figures(rows, table);
    table.notes.push_back(fmt::format("{} of {} figures meet their target", met, rows.size()));
    table.notes.push_back("order: of convergence, by the three finest, whatever they come to; - where they go to and fro or are rounding, or there are fewer");
    table.notes.push_back("references are closed forms, numbers quoted from the papers, or for a pressed wall a finer mesh of other elements: no other solver runs beside these");
    return table;
}

} // namespace trocar::engine
