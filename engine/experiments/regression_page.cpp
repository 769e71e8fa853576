#include "engine/experiments/regression_page.hpp"

#include "engine/report/gnuplot.hpp"
#include "engine/report/html.hpp"
#include "engine/report/plot_html.hpp"
#include "engine/report/report_style.hpp"
#include "engine/report/verdict.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace trocar::engine {

namespace {

/// m; what is the same to the last bit has no place on a logarithmic axis: it is drawn here.
constexpr double kNothing = 1e-16;
constexpr std::size_t kMostCurves = 12; // of a plot

double distance_of(const Vec3& a, const Vec3& b) {
    const double distance = (a - b).norm();
    return std::isfinite(distance) ? distance : std::numeric_limits<double>::infinity();
}

/// Points of one sample against the reference's.
void add_sample(const TracePart& was, const TracePart& is, std::uint64_t step, double tolerance, PartDrift& drift) {
    double farthest = 0.0;
    for (std::size_t k = 0; k < is.points.size(); ++k) {
        const double distance = distance_of(is.points[k], was.points[k]);
        farthest = std::max(farthest, distance);
        if (distance <= drift.worst_m) continue;
        drift.worst_m = distance;
        drift.worst_step = step;
        drift.worst_node = is.ids[k];
    }
    if (drift.first_step == 0 && farthest > tolerance) drift.first_step = step;
    drift.curve.emplace_back(step, farthest);
}

struct Curves {
    std::vector<Sketch> sketches;
    std::vector<PlotData> data;
};

void add_curves(std::size_t scene, const RegressionOutcome& outcome, Curves& curves) {
    const std::vector<PartDrift> drifts = measure_drift(outcome.reference, outcome.now, outcome.entry.tolerance);
    Sketch sketch;
    sketch.plot = {"scene" + std::string(1, static_cast<char>('a' + scene % 26)) + std::string(scene / 26, 'z'),
                   outcome.entry.name,
                   fmt::format("Farthest of the kept points from the reference; the tolerance is {:g} m. What is the same to the last bit "
                               "stands at 10^-16.",
                               outcome.entry.tolerance),
                   {}};
    sketch.commands = "set logscale y\nset format y '10^{%L}'\nset xlabel 'step' textcolor rgb '#4b5563' offset 0,0.4\n"
                      "set ylabel 'distance [m]' textcolor rgb '#4b5563' offset 1,0\nplot ";
    for (std::size_t k = 0; k < std::min(drifts.size(), kMostCurves); ++k) {
        const std::string file = fmt::format("drift_{}_{}.tsv", scene, k);
        std::string rows;
        for (const auto& [step, distance] : drifts[k].curve)
            if (std::isfinite(distance)) fmt::format_to(std::back_inserter(rows), "{}\t{:.6g}\n", step, std::max(distance, kNothing));
        curves.data.push_back({file, rows.empty() ? "NaN NaN\n" : rows});
        sketch.commands +=
            fmt::format("'{}' using 1:2 with linespoints pt 7 ps 0.4 lw 1.5 title {}, ", file, quote_for_gnuplot(drifts[k].part));
    }
    if (drifts.empty()) return;
    if (outcome.entry.tolerance > 0.0)
        sketch.commands += fmt::format("{} with lines dt (6,4) lc rgb '#9aa3ad' title 'tolerance'", outcome.entry.tolerance);
    curves.sketches.push_back(std::move(sketch));
}

std::string curves_html(std::span<const RegressionOutcome> outcomes) {
    Curves curves;
    for (std::size_t k = 0; k < outcomes.size(); ++k)
        if (!outcomes[k].difference.empty()) add_curves(k, outcomes[k], curves);
    if (curves.sketches.empty()) return {};
    const auto plots = draw_plots(curves.sketches, curves.data);
    if (!plots) return fmt::format("<p class=\"soft\">No plots: {}</p>\n", escape_html(plots.error().to_string()));
    return "<h2>How they went apart</h2>\n" + plots_html(*plots);
}

std::string parts_html(const RegressionOutcome& outcome) {
    std::string page;
    for (const PartDrift& drift : measure_drift(outcome.reference, outcome.now, outcome.entry.tolerance))
        if (drift.first_step > 0)
            fmt::format_to(std::back_inserter(page), "<br>{}: beyond the tolerance from step {} on, at most {} m, node {} in step {}",
                           escape_html(drift.part), drift.first_step, number_text(drift.worst_m), drift.worst_node, drift.worst_step);
    return page;
}

} // namespace

std::vector<PartDrift> measure_drift(const Trace& reference, const Trace& now, double tolerance) {
    std::vector<PartDrift> drifts;
    for (std::size_t s = 0; s < std::min(reference.samples.size(), now.samples.size()); ++s) {
        const TraceSample &was = reference.samples[s], &is = now.samples[s];
        for (std::size_t i = 0; i < std::min(was.parts.size(), is.parts.size()); ++i) {
            const bool same_mesh = was.parts[i].name == is.parts[i].name && was.parts[i].ids == is.parts[i].ids;
            if (was.step != is.step || !same_mesh) continue;
            auto drift = std::find_if(drifts.begin(), drifts.end(), [&](const PartDrift& d) { return d.part == is.parts[i].name; });
            if (drift == drifts.end()) {
                drifts.emplace_back().part = is.parts[i].name;
                drift = std::prev(drifts.end());
            }
            add_sample(was.parts[i], is.parts[i], is.step, tolerance, *drift);
        }
    }
    return drifts;
}

std::string regression_page(std::span<const RegressionOutcome> outcomes) {
    const auto differ =
        std::count_if(outcomes.begin(), outcomes.end(), [](const RegressionOutcome& outcome) { return !outcome.difference.empty(); });
    std::string page =
        fmt::format("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
                    "content=\"width=device-width,initial-scale=1\">\n<title>Regression</title>\n<style>{}</style></head>\n<body><main>\n"
                    "<p class=\"over\">regression</p>\n<div class=\"verdict {}\"><h1>{}</h1></div>\n"
                    "<div class=\"scroll\"><table><tr><th>scene</th><th class=\"n\">steps</th><th class=\"n\">tolerance [m]</th><th>came "
                    "to</th></tr>\n",
                    kReportStyle, differ > 0 ? "bad" : "",
                    differ > 0 ? fmt::format("{} of {} scenes differ from their references", differ, outcomes.size())
                               : fmt::format("All {} scenes are as they were", outcomes.size()));
    for (const RegressionOutcome& outcome : outcomes) {
        const bool same_bits = outcome.reference.state_hash == outcome.now.state_hash;
        const std::string result = !outcome.difference.empty() ? escape_html(outcome.difference) + parts_html(outcome)
                                   : same_bits                 ? "the same bits"
                                                               : "within the tolerance";
        fmt::format_to(std::back_inserter(page),
                       "<tr><td><i class=\"dot{}\"></i>{}</td><td class=\"n\">{}</td><td class=\"n\">{:g}</td><td>{}</td></tr>\n",
                       outcome.difference.empty() ? "" : " bad", escape_html(outcome.entry.name), outcome.now.steps,
                       outcome.entry.tolerance, result);
    }
    return page + "</table></div>\n" + curves_html(outcomes) + "</main></body></html>\n";
}

} // namespace trocar::engine
