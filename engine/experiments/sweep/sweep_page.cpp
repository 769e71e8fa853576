#include "engine/experiments/sweep/sweep_page.hpp"

#include "assets/anatomy/random.hpp"
#include "engine/experiments/sweep/page_script.hpp"
#include "engine/report/html.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/report/report_style.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <optional>

namespace trocar::engine {
namespace {

using Json = nlohmann::ordered_json;

/// Rows that the page's plots and its table hold; the CSV holds all.
constexpr std::uint64_t kMostPlotted = 20'000;
constexpr std::size_t kMostListed = 500;

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

const char* status_class(const std::string& status) {
    if (status == "done") return "";
    return status == "missing" ? " class=\"missing\"" : " class=\"bad\"";
}

/// What is true counts as 1: the mean is the share of it.
std::optional<double> number_of(const std::string& cell) {
    if (cell == "true" || cell == "false") return cell == "true" ? 1.0 : 0.0;
    double value = 0.0;
    const auto read = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    return read.ec == std::errc() && read.ptr == cell.data() + cell.size() && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// The first collected pointer that has one of these in its name, the first of them before the others.
std::optional<std::size_t> find_collected(const SweepPlan& plan, std::initializer_list<std::string_view> pieces) {
    for (const std::string_view piece : pieces)
        for (std::size_t i = 0; i < plan.collect.size(); ++i)
            if (plan.collect[i].pointer.find(piece) != std::string::npos) return i;
    return std::nullopt;
}

} // namespace

SweepPage::SweepPage(std::vector<std::string> columns, const SweepPlan& plan)
    : columns_(std::move(columns)), plan_(plan), varied_(columns_.size() - plan.collect.size() - 2), totals_(plan.collect.size()) {}

/// All, or as many as there is room for, drawn by their numbers: any regular choice would miss whole values of a pointer.
bool SweepPage::is_plotted(std::uint64_t run) const noexcept {
    const std::uint64_t all = plan_.run_count();
    return all <= kMostPlotted || anatomy::Random(run).next() % all < kMostPlotted;
}

void SweepPage::add(std::uint64_t run, const std::vector<std::string>& row) {
    if (listed_.size() < kMostListed) listed_.push_back(row);
    if (is_plotted(run)) plotted_.push_back(row);
    if (row[varied_ + 1] != "done") return;
    for (std::size_t i = 0; i < totals_.size(); ++i)
        if (const auto value = number_of(row[varied_ + 2 + i])) {
            Total& total = totals_[i];
            ++total.count;
            total.sum += *value;
            total.least = std::min(total.least, *value), total.most = std::max(total.most, *value);
        }
}

std::string SweepPage::totals_text() const {
    std::string text;
    for (std::size_t i = 0; i < totals_.size(); ++i) {
        const Total& total = totals_[i];
        if (total.count > 0)
            text += fmt::format("<tr><td>{}</td><td>{}</td><td>{:.6g}</td><td>{:.6g}</td><td>{:.6g}</td></tr>\n", escape_html(columns_[varied_ + 2 + i]), total.count,
                                total.sum / static_cast<double>(total.count), total.least, total.most);
    }
    if (text.empty()) return text;
    return "<h2>All runs</h2>\n<div class=\"scroll\"><table><tr><th>value</th><th>runs</th><th>mean</th><th>least</th><th>greatest</th></tr>\n" + text + "</table></div>\n";
}

std::string SweepPage::row_text(std::size_t index, const std::filesystem::path& folder, const std::filesystem::path& page_folder) const {
    std::string text = "<tr>";
    for (std::size_t i = 0; i < listed_[index].size(); ++i) {
        const std::string& cell = listed_[index][i];
        const bool is_status = i == varied_ + 1;
        std::string content = escape_html(cell);
        if (is_status && plan_.keeps_folders && cell == "done") {
            const char* file = plan_.command == SweepCommand::Episode ? output_name::kSummary : output_name::kReport;
            const std::filesystem::path kept = folder / sweep_name::kRuns / plan_.run(index).key / file;
            content = fmt::format("<a href=\"{}\">{}</a>", escape_html(kept.lexically_relative(page_folder).generic_string()), content);
        }
        text += fmt::format("<td{}>{}</td>", is_status ? status_class(cell) : "", content);
    }
    return text + "</tr>\n";
}

std::string SweepPage::text(const std::string& title, const SweepTable& table, const std::filesystem::path& folder, const std::filesystem::path& page_folder) const {
    std::string page = fmt::format("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
                                   "content=\"width=device-width,initial-scale=1\">\n<title>{0}</title>\n<style>{1}{2}</style></head>\n<body><main>\n"
                                   "<p class=\"over\">sweep</p><h1>{0}</h1>\n",
                                   escape_html(title), kReportStyle, kSweepStyle);
    page += fmt::format("<p class=\"lead\">{} runs of <code>trocar {}</code>: {} done, {} failed, {} missing.</p>\n", table.rows, command_name(plan_.command),
                        table.done, table.failed, table.missing);
    page += "<p class=\"soft\">Points are means over what is not chosen, repetitions included; the band and the tool tip show the least and the greatest.</p>\n"
            "<div class=\"choose\"></div><div class=\"plots\"></div>\n";
    if (table.rows > kMostPlotted) page += fmt::format("<p class=\"soft\">The plots show {} rows, drawn at random from all.</p>\n", plotted_.size());
    page += totals_text() + "<h2>Rows</h2>\n<div class=\"scroll\"><table><tr>";
    for (const std::string& name : columns_) page += fmt::format("<th>{}</th>", escape_html(name));
    page += "</tr>\n";
    for (std::size_t k = 0; k < listed_.size(); ++k) page += row_text(k, folder, page_folder);
    page += "</table></div>\n";
    if (table.rows > kMostListed) page += fmt::format("<p class=\"soft\">{} more rows are in the CSV file.</p>\n", table.rows - kMostListed);
    Json data{{"columns", columns_}, {"varied", varied_}, {"rows", plotted_}};
    if (plan_.command == SweepCommand::Cost) { // error against time comes first
        const auto column = [&](std::optional<std::size_t> item) { return item ? Json(varied_ + 2 + *item) : Json(); };
        data["time"] = column(find_collected(plan_, {"/charged_ms/", "/step_ms/"}));
        data["error"] = column(find_collected(plan_, {"error", "_rms_m", "missed"}));
    }
    return page + "<script>\nconst data=" + script_json(data) + ";\n" + kSweepScript + "</script>\n</main></body></html>\n";
}

} // namespace trocar::engine
