#include "engine/experiments/sweep/sweep_page.hpp"

#include "engine/experiments/sweep/page_script.hpp"
#include "engine/report/html.hpp"
#include "engine/report/report_style.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>

namespace trocar::engine {
namespace {

using Json = nlohmann::ordered_json;

/// Rows that the page's plots and its table hold; the CSV holds all.
constexpr std::size_t kMostPlotted = 20'000, kMostListed = 500;

/// JSON inside a script element: nothing in it ends the element or begins a comment.
std::string script_json(const Json& json) {
    std::string text = json.dump(-1, ' ', false, Json::error_handler_t::replace), safe;
    for (const char c : text) {
        if (c == '<')
            safe += "\\u003c";
        else
            safe += c;
    }
    return safe;
}

const char* cell_class(const SweepTable& table, std::size_t column, const std::string& cell) {
    if (column != table.varied + 1 || cell == "done") return "";
    return cell == "missing" ? " class=\"missing\"" : " class=\"bad\"";
}

} // namespace

std::string sweep_page(const std::string& title, const SweepTable& table, const SweepPlan& plan, const std::filesystem::path& folder,
                       const std::filesystem::path& page_folder) {
    std::string page = fmt::format("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
                                   "content=\"width=device-width,initial-scale=1\">\n<title>{0}</title>\n<style>{1}{2}</style></head>\n<body><main>\n"
                                   "<p class=\"over\">sweep</p><h1>{0}</h1>\n",
                                   escape_html(title), kReportStyle, kSweepStyle);
    page += fmt::format("<p class=\"lead\">{} runs of <code>trocar {}</code>: {} done, {} failed, {} missing.</p>\n", table.rows.size(),
                        command_name(plan.command), table.done, table.failed, table.missing);
    page += "<p class=\"soft\">Points are means over what is not chosen, repetitions included; the band and the tool tip show the least and the greatest.</p>\n"
            "<div class=\"choose\"></div><div class=\"plots\"></div>\n";
    if (table.rows.size() > kMostPlotted) page += fmt::format("<p class=\"soft\">The plots show the first {} rows.</p>\n", kMostPlotted);
    page += "<h2>Rows</h2>\n<div class=\"scroll\"><table><tr>";
    for (const std::string& name : table.columns) page += fmt::format("<th>{}</th>", escape_html(name));
    page += "</tr>\n";
    for (std::size_t k = 0; k < std::min(table.rows.size(), kMostListed); ++k) {
        page += "<tr>";
        for (std::size_t i = 0; i < table.rows[k].size(); ++i) {
            const std::string& cell = table.rows[k][i];
            const bool links = plan.keeps_folders && i == table.varied + 1 && cell == "done";
            const std::filesystem::path report = folder / sweep_name::kRuns / plan.run(k).key / "report.html";
            page += fmt::format("<td{}>{}</td>", cell_class(table, i, cell),
                                links ? fmt::format("<a href=\"{}\">{}</a>", escape_html(report.lexically_relative(page_folder).generic_string()), escape_html(cell))
                                      : escape_html(cell));
        }
        page += "</tr>\n";
    }
    page += "</table></div>\n";
    if (table.rows.size() > kMostListed) page += fmt::format("<p class=\"soft\">{} more rows are in the CSV file.</p>\n", table.rows.size() - kMostListed);
    Json rows = Json::array();
    for (std::size_t k = 0; k < std::min(table.rows.size(), kMostPlotted); ++k) rows.push_back(table.rows[k]);
    const Json data{{"columns", table.columns}, {"varied", table.varied}, {"rows", std::move(rows)}};
    return page + "<script>\nconst data=" + script_json(data) + ";\n" + kSweepScript + "</script>\n</main></body></html>\n";
}

} // namespace trocar::engine
