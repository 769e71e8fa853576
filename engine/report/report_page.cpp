#include "engine/report/report_page.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/report/html.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/report/plot_html.hpp"
#include "engine/report/plots.hpp"
#include "engine/report/report_style.hpp"
#include "engine/report/verdict.hpp"
#include "engine/report/xray_frames.hpp"
#include "engine/step/model_hash.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

namespace trocar::engine {

namespace {

constexpr std::size_t kMaxPictures = 16; // inside the page; more are beside it

/// Appends formatted text; arguments that come from a scene or a file go through escape_html first.
class Page {
public:
    template <class... Arguments>
    void add(fmt::format_string<Arguments...> format, Arguments&&... arguments) {
        fmt::format_to(std::back_inserter(text_), format, std::forward<Arguments>(arguments)...);
    }
    [[nodiscard]] std::string take() && { return std::move(text_); }

private:
    std::string text_;
};

const char* mark_class(Mark mark) {
    if (mark == Mark::Good) return "good";
    return mark == Mark::Note ? "note" : "bad";
}

std::string view_title(PictureView view) {
    if (view == PictureView::Tip) return "The tip";
    return view == PictureView::Fluoroscopy ? "Fluoroscopy" : "Anatomy";
}

void add_head(const RunRecord& record, Page& page) {
    const Verdict verdict = make_verdict(record);
    page.add("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
             "content=\"width=device-width,initial-scale=1\">\n"
             "<title>{0}</title>\n<style>{1}</style></head>\n<body><main>\n<p class=\"over\">{0}</p>\n",
             escape_html(record.scene.name), kReportStyle);
    page.add("<div class=\"verdict {}\"><h1>{}</h1>\n<p class=\"lead\">{}</p></div>\n", mark_class(verdict.mark),
             escape_html(verdict.headline), escape_html(verdict.detail));
}

void add_losses(const RunRecord& record, Page& page) {
    const std::vector<Loss> losses = list_losses(record);
    const bool any = std::any_of(losses.begin(), losses.end(), [](const Loss& loss) { return loss.mark != Mark::Good; });
    page.add("<h2 style=\"margin-top:0\">What was given up</h2>\n");
    if (any) page.add("<table class=\"losses\">\n");
    for (const Loss& loss : losses)
        if (loss.mark != Mark::Good)
            page.add("<tr><td><i class=\"dot {}\"></i>{}</td><td>{}<span class=\"advice\">{}</span></td></tr>\n", mark_class(loss.mark),
                     escape_html(loss.name), escape_html(loss.amount), escape_html(loss.advice));
    if (any) page.add("</table>\n");
    page.add("<p class=\"nothing\"><b>{}</b>", any ? "None of these:" : "Nothing; none of these:");
    for (const Loss& loss : losses)
        if (loss.mark == Mark::Good) page.add("<span><i class=\"dot\"></i>{}</span>", escape_html(loss.name));
    page.add("</p>\n");
}

void add_figure(Page& page, const std::string& value, const char* unit, const char* name) {
    page.add("<div><b>{}<small> {}</small></b><span>{}</span></div>", value, unit, name);
}

void add_figures(const RunRecord& record, Page& page) {
    const RunSummary& s = record.summary;
    const RunStatistics& t = record.statistics;
    page.add("<div class=\"figures\">");
    add_figure(page, std::to_string(s.steps), "", "steps");
    add_figure(page, number_text(s.simulated_s), "s", "simulated");
    add_figure(page, fmt::format("{:.2f}", s.realtime_factor), "×", "real-time factor");
    add_figure(page, number_text(s.step_ms.p50), "ms", "step, median");
    add_figure(page, number_text(s.step_ms.p99), "ms", "step, 99 %");
    add_figure(page, number_text(s.step_ms.max), "ms", "step, slowest");
    add_figure(page, fmt::format("{:.4g}", percent_of(s.realtime_kept)), "%", "whole steps within real time");
    if (const BudgetSpec& budget = record.scene.budget; budget.limits.mode == BudgetMode::Wall)
        add_figure(page, fmt::format("{:.4g}", percent_of(s.budget_kept)), "%",
                   budget.scope == BudgetScope::Step ? "whole steps within the budget" : "collision detection within the budget");
    if (!record.prepared.model.instruments.empty()) add_figure(page, number_text(1e3 * t.insertion_m), "mm", "inserted");
    if (t.target_distance_m >= 0.0) add_figure(page, number_text(1e3 * t.target_distance_m), "mm", "tip to target");
    page.add("</div>\n");
    if (record.notices.empty()) return;
    page.add("<div class=\"notices\">");
    for (const std::string& notice : record.notices) page.add("<div>{}</div>", escape_html(notice));
    page.add("</div>\n");
}

/// The last picture of the whole comes first and large, then the others as they were taken.
std::vector<TakenPicture> in_order(std::vector<TakenPicture> pictures) {
    const auto last =
        std::find_if(pictures.rbegin(), pictures.rend(), [](const TakenPicture& p) { return p.view == PictureView::Anatomy; });
    if (last != pictures.rend()) std::rotate(pictures.begin(), last.base() - 1, last.base());
    return pictures;
}

const char* view_caption(PictureView view) {
    switch (view) {
    case PictureView::Anatomy:
        return "Dots mark contacts; the colour is their depth.";
    case PictureView::Tip:
        return "Seen across the vessel, from the front.";
    case PictureView::Fluoroscopy:
        return "X-ray through every body, by its thickness along the ray.";
    }
    return "";
}

/// A picture that cannot be read back is replaced by a sentence.
void add_pictures(const std::vector<TakenPicture>& taken, const std::filesystem::path& folder, Page& page) {
    if (taken.empty()) return;
    const std::vector<TakenPicture> pictures = in_order(taken);
    page.add("<h2>Pictures</h2>\n<div class=\"grid\">\n");
    for (std::size_t i = 0; i < std::min(pictures.size(), kMaxPictures); ++i) {
        const TakenPicture& picture = pictures[i];
        const Result<std::string> bytes = read_file_bytes(folder / picture.file);
        if (!bytes) {
            page.add("<p class=\"soft\">No picture: {}</p>\n", escape_html(bytes.error().to_string()));
            continue;
        }
        page.add("<figure{}><img alt=\"{} at {:.2f} s\" src=\"data:image/png;base64,{}\"><figcaption><b>{}</b>, {:.2f} s. "
                 "{}</figcaption></figure>\n",
                 i == 0 || (i + 1 == pictures.size() && i % 2 == 1) ? " class=\"wide\"" : "", view_title(picture.view), picture.time,
                 encode_base64(*bytes), view_title(picture.view), picture.time, view_caption(picture.view));
    }
    page.add("</div>\n");
    if (pictures.size() > kMaxPictures) page.add("<p class=\"soft\">{} more are beside this page.</p>\n", pictures.size() - kMaxPictures);
}

/// Films play by themselves in a browser.
void add_xrays(const RunRecord& record, const std::filesystem::path& folder, Page& page) {
    if (record.xrays == nullptr || record.xrays->shown().empty()) return;
    page.add("<h2>Fluoroscopy</h2>\n<div class=\"grid\">\n");
    for (const XrayFrames::Shown& view : record.xrays->shown()) {
        const Result<std::string> bytes = read_file_bytes(folder / view.file);
        if (!bytes) {
            page.add("<p class=\"soft\">No picture: {}</p>\n", escape_html(bytes.error().to_string()));
            continue;
        }
        page.add("<figure><img alt=\"X-ray view {0}\" src=\"data:image/png;base64,{1}\"><figcaption><b>{0}</b>, {2} frames. At 0/0 the patient's right "
                 "is on the left.</figcaption></figure>\n",
                 escape_html(view.title), encode_base64(*bytes), view.frames);
    }
    page.add("</div>\n");
}

/// Without gnuplot: the curve at a dozen times.
void add_curve_table(const RunRecord& record, Page& page) {
    const std::vector<CurvePoint>& points = record.statistics.curve.points();
    page.add("<div class=\"scroll\"><table><tr><th class=\"n\">time [s]</th><th class=\"n\">whole step [ms]</th><th class=\"n\">charged "
             "[ms]</th>"
             "<th class=\"n\">inserted [mm]</th><th class=\"n\">to target [mm]</th><th class=\"n\">force [N]</th><th "
             "class=\"n\">level</th></tr>\n");
    const std::size_t rows = std::min<std::size_t>(points.size(), 12);
    for (std::size_t i = 0; i < rows; ++i) {
        const CurvePoint& p = points[(i + 1) * points.size() / rows - 1];
        page.add("<tr><td class=\"n\">{:.3g}</td><td class=\"n\">{:.3g}</td><td class=\"n\">{:.3g}</td><td class=\"n\">{:.4g}</td>"
                 "<td class=\"n\">{}</td><td class=\"n\">{:.3g}</td><td class=\"n\">{}</td></tr>\n",
                 p.time_s, p.total_ms.max, p.charged_ms.max, 1e3 * p.insertion_m.last,
                 p.target_distance_m.last < 0.0 ? std::string("–") : fmt::format("{:.4g}", 1e3 * p.target_distance_m.last), p.force_n.max,
                 p.level.min);
    }
    page.add("</table></div>\n");
}

void add_plots(const RunRecord& record, Page& page, std::vector<std::string>& notices) {
    if (record.statistics.steps == 0) return;
    page.add("<h2>Over time</h2>\n");
    const Result<std::vector<Plot>> plots = make_plots(record);
    if (!plots) {
        notices.push_back("no plots: " + plots.error().to_string());
        page.add("<p class=\"soft\">No plots: {}</p>\n", escape_html(plots.error().to_string()));
        return add_curve_table(record, page);
    }
    page.add("{}", plots_html(*plots));
}

void add_stages(const RunRecord& record, Page& page) {
    constexpr const char* kMeaning[kStageCount] = {"drive commands", "tissue and rod",   "embedded surfaces, sphere trees brought up to date",
                                                   "traversal of sphere trees", "continuous tests", "contact response"};
    double sum = 0.0;
    for (const double p50 : record.stage_p50) sum += p50;
    if (!(sum > 0.0)) return;
    page.add("<h2>Where a step's time goes</h2>\n<table class=\"bars\">\n");
    for (std::size_t i = 0; i < kStageCount; ++i)
        page.add("<tr><td>{} <span class=\"soft\">{}</span></td><td class=\"n\">{:.3g} ms</td><td><div class=\"bar\" "
                 "style=\"width:{:.2f}%\"></div></td></tr>\n",
                 kStageNames[i], kMeaning[i], record.stage_p50[i], 100.0 * record.stage_p50[i] / sum);
    page.add("</table>\n<p class=\"soft\">Medians of each stage. Pictures, records and independent checks are outside the step: {:.3g} s "
             "in all.</p>\n",
             record.observe_s);
}

std::string body_role(const SceneModel& model, const BodyModel& body) {
    std::string role = body.motion == Motion::Deformable  ? "deformable"
                       : body.motion == Motion::Kinematic ? "moved by the scene"
                                                          : "static";
    if (body.is_free_space) return role + ", the free space around solids";
    if (body.hollow) role += ", hollow";
    if (body.hollow && body.tissue) role += ", with a wall of its own";
    else if (body.host_body) role += ", embedded in " + model.bodies[*body.host_body].name;
    return role;
}

void add_bodies(const RunRecord& record, Page& page) {
    const PreparedScene& prepared = record.prepared;
    const auto count = [](std::size_t n) { return n > 0 ? fmt::format("{}", n) : std::string("–"); };
    page.add("<h2>Bodies and instruments</h2>\n<div class=\"scroll\"><table><tr><th>body</th><th>role</th><th class=\"n\">triangles</th>"
             "<th class=\"n\">tetrahedra</th><th class=\"n\">links</th><th class=\"n\">spheres</th><th>notes</th></tr>\n");
    for (std::size_t i = 0; i < prepared.bodies.size(); ++i) {
        const BodySummary& b = prepared.bodies[i];
        page.add("<tr><td>{}</td><td>{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td class=\"n\">{}</td><td "
                 "class=\"n\">{}</td><td class=\"soft\">{}</td></tr>\n",
                 escape_html(b.name), escape_html(body_role(prepared.model, prepared.model.bodies[i])), count(b.triangles),
                 count(b.coarse_tets), count(b.links), count(b.tree_spheres + b.inscribed_spheres),
                 escape_html(fmt::format("{}", fmt::join(b.notes, "; "))));
    }
    for (const InstrumentModel& m : prepared.model.instruments)
        page.add(
            "<tr><td>{}</td><td>rod of {} nodes, {:.4g} mm long, radius {:.3g} mm, in {}</td><td class=\"n\">{}</td><td class=\"n\">–</td>"
            "<td class=\"n\">–</td><td class=\"n\">{}</td><td class=\"soft\">{}</td></tr>\n",
            escape_html(m.name), m.rod.node_count(), 1e3 * m.rod.design.length, 1e3 * m.rod.design.radius,
            escape_html(prepared.model.bodies[m.lumen].name), m.skin.triangles.size(), m.chain.capacity(),
            m.route && m.path.empty() ? fmt::format("driven along a route of {:.4g} mm", 1e3 * m.route->length.back())
                                      : fmt::format("path of {} rows", m.path.size()));
    page.add("</table></div>\n");
}

void add_effects(const RunRecord& record, Page& page) {
    constexpr const char* kEffects[] = {"elasticity", "gravity",   "damping", "coarse_contact", "self_contact", "instrument_contact", "exact_contact",
                                        "friction",   "breathing", "pulse",   "twist",          "blood_drag",   "contrast",     "fluoroscopy",
                                        "loads"};
    const std::vector<std::string> on = record.scene.effects.names();
    page.add("<h2>Simulated, and not</h2>\n<p class=\"tags\">");
    for (const char* effect : kEffects)
        page.add("<span{}>{}</span>", std::find(on.begin(), on.end(), effect) == on.end() ? " class=\"off\"" : "", effect);
    page.add("</p>\n");
}

void add_repeat(const RunRecord& record, Page& page) {
    const BudgetSpec& budget = record.scene.budget;
    page.add("<h2>To repeat it</h2>\n<pre>{}</pre>\n",
             escape_html(repeat_command(record.scene, record.resumed_step + record.summary.steps)));
    page.add("<p class=\"soft\">{}</p>\n", budget.limits.mode == BudgetMode::Wall
                                               ? "A deadline in milliseconds depends on the machine, and so does the end. With --budget "
                                                 "work:N or exact the same input gives the same bits."
                                               : "The same input gives the same bits: compare the state's hash.");
    page.add(
        "<dl><dt>Scene</dt><dd>{}</dd><dt>Step</dt><dd>{:.4g} ms, {} sub-steps of the tissue at most</dd><dt>Budget</dt><dd>{} for {}</dd>"
        "<dt>Scene's hash</dt><dd><code>{:016x}</code>, as it was prepared</dd><dt>State's hash</dt><dd><code>{}</code></dd>",
        escape_html(project_path(record.scene.file)), 1e3 * record.scene.time.step, record.statistics.substeps,
        escape_html(budget.to_string()), budget.scope == BudgetScope::Step ? "the whole step" : "collision detection",
        hash_model(record.prepared.model), record.summary.state_hash);
    page.add("{}", facts_html(record.machine));
    if (!record.gl.empty()) page.add("<dt>Pictures by</dt><dd>{}</dd>", escape_html(record.gl));
    page.add("<dt>Preparation</dt><dd>{:.3g} s</dd><dt>Run</dt><dd>{:.4g} s</dd></dl>\n", record.prepared.seconds, record.summary.wall_s);
    page.add("<footer>Every step is in {}, the numbers of this page in {}.</footer>\n</main></body></html>\n", output_name::kSteps,
             output_name::kSummary);
}

} // namespace

std::string make_report_page(const RunRecord& record, const std::vector<TakenPicture>& pictures, const std::filesystem::path& folder,
                             std::vector<std::string>& notices) {
    Page page;
    add_head(record, page);
    add_losses(record, page);
    add_figures(record, page);
    add_pictures(pictures, folder, page);
    add_xrays(record, folder, page);
    add_plots(record, page, notices);
    add_stages(record, page);
    add_bodies(record, page);
    add_effects(record, page);
    add_repeat(record, page);
    return std::move(page).take();
}

} // namespace trocar::engine
