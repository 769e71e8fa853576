#include "bench/headlines.hpp"

#include "bench/row_values.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

using Rows = std::span<const BenchRow>;

bool is(const BenchRow& row, const char* key, const nlohmann::ordered_json& value) { return row.contains(key) && row_value(row, key) == value; }

template <class Wanted>
const BenchRow* find(Rows rows, Wanted wanted) {
    const auto found = std::find_if(rows.begin(), rows.end(), wanted);
    return found != rows.end() ? &*found : nullptr;
}

std::optional<double> ratio(std::optional<double> theirs, std::optional<double> ours) {
    return theirs && ours && *ours > 0.0 ? std::optional(*theirs / *ours) : std::nullopt;
}

std::string list(const std::vector<std::string>& parts) { return fmt::format("{}", fmt::join(parts, " / ")); }

std::vector<Headline> of_deadline(Rows rows) {
    std::vector<Headline> lines;
    for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
        const std::string scene = row_text(rows[begin], "scene");
        std::vector<std::string> budgets, kept, late;
        for (end = begin; end < rows.size() && row_text(rows[end], "scene") == scene; ++end) {
            const BenchRow& row = rows[end];
            if (!row_number(row, "kept_where_it_fits")) continue;
            budgets.push_back(fmt::format("{:g}", *row_number(row, "budget_ms")));
            kept.push_back(fmt::format("{:.2f}", 100.0 * *row_number(row, "kept_where_it_fits")));
            late.push_back(fmt::format("{:.3g}", row_number(row, "own_ms_p999").value_or(0.0)));
        }
        if (budgets.empty()) continue;
        const std::string of = scene.empty() ? std::string() : scene + ": ";
        lines.push_back({of + "steps that end within budgets of " + list(budgets) + " ms, in % (of those whose mandatory part fits)",
                         list(kept),
                         "wanted: 99.9",
                         {},
                         {}});
        lines.push_back({of + "the same, 99.9th percentile of what a step used, ms", list(late), {}, {}, {}});
    }
    return lines;
}

/// The most accurate budget whose contact takes at most a quarter of the exact run's.
std::vector<Headline> of_price(Rows rows) {
    constexpr double kShare = 0.25;
    std::vector<Headline> lines;
    for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
        const std::string scene = row_text(rows[begin], "scene");
        for (end = begin; end < rows.size() && row_text(rows[end], "scene") == scene;) ++end;
        const Rows own = rows.subspan(begin, end - begin);
        const BenchRow* best = nullptr;
        for (const BenchRow& row : own)
            if (row_number(row, "charged_of_exact").value_or(1.0) <= kShare &&
                (best == nullptr || row_number(row, "run_rms_mm") < row_number(*best, "run_rms_mm")))
                best = &row;
        if (best == nullptr) continue;
        const double tightest = row_number(own.front(), "run_rms_mm").value_or(0.0), here = row_number(*best, "run_rms_mm").value_or(0.0);
        lines.push_back({fmt::format("{} under {}: share of the exact run's time for contact; error of what the tightest budget has", scene,
                                     row_text(*best, "budget")),
                         fmt::format("{:.0f} %; {:.0f} % ({:.3g} mm)", 100.0 * row_number(*best, "charged_of_exact").value_or(0.0),
                                     tightest > 0.0 ? 100.0 * here / tightest : 0.0, here),
                         {},
                         {},
                         {}});
    }
    return lines;
}

std::vector<Headline> of_effects(Rows rows) {
    std::vector<Headline> lines;
    for (std::size_t begin = 0; begin < rows.size();) {
        const std::string scene = row_text(rows[begin], "scene");
        std::vector<std::string> saved;
        std::size_t end = begin;
        for (; end < rows.size() && row_text(rows[end], "scene") == scene; ++end) {
            const bool is_measurable = std::abs(row_number(rows[end], "saved_ms").value_or(0.0)) > row_number(rows[end], "noise_ms").value_or(0.0);
            saved.push_back(row_text(rows[end], "effect") +
                            (is_measurable ? fmt::format(" {:.0f} %", 100.0 * row_number(rows[end], "saved_share").value_or(0.0))
                                           : std::string(" less than can be measured")));
        }
        lines.push_back(
            {scene + ": time of a step that leaving one effect out saves", fmt::format("{}", fmt::join(saved, ", ")), {}, {}, {}});
        begin = end;
    }
    return lines;
}

std::vector<Headline> of_fem(Rows rows) {
    std::vector<Headline> lines;
    for (const char* bar : {"bar_5k", "bar_50k", "bar_500k"}) {
        const auto elastic = [&](const BenchRow& row) {
            return is(row, "name", bar) && is(row, "law", "neo_hookean") && is(row, "viscous", false) &&
                   row_text(row, "integrator") == "none" && is(row, "threads", 1) && row_number(row, "ns_per_tet");
        };
        const BenchRow* ours = find(rows, [&](const BenchRow& row) {
            return elastic(row) && is(row, "peer", false) && row_text(row, "isa") != "portable" && is(row, "precision", "double");
        });
        const BenchRow* peer =
            find(rows, [&](const BenchRow& row) { return is(row, "name", bar) && is(row, "peer", true) && row_number(row, "ns_per_tet"); });
        if (ours == nullptr) continue;
        const auto theirs = peer != nullptr ? row_number(*peer, "ns_per_tet") : std::nullopt;
        lines.push_back({fmt::format("elastic forces of {}, neo-Hookean, double, {}, ns a tetrahedron", bar, row_text(*ours, "isa")),
                         fmt::format("{:.1f}", *row_number(*ours, "ns_per_tet")),
                         theirs ? fmt::format("Bullet, float, beside it: {:.1f}", *theirs) : std::string(),
                         ratio(theirs, row_number(*ours, "ns_per_tet")),
                         {}});
    }
    return lines;
}

std::vector<Headline> of_validation(Rows rows) {
    std::size_t bounds = 0, hold = 0;
    std::string missed;
    for (const BenchRow& row : rows) {
        if (!row.contains("holds")) continue;
        ++bounds;
        hold += is(row, "holds", true);
        if (!is(row, "holds", true)) missed += (missed.empty() ? "missed: " : "; ") + row_text(row, "what");
    }
    return {
        {"tissue against analytic answers, SOFA and CalculiX: bounds that hold", fmt::format("{} of {}", hold, bounds), {}, {}, missed}};
}

std::vector<Headline> of_spheretree(Rows rows) {
    std::vector<Headline> lines;
    const BenchRow* bunny =
        find(rows, [](const BenchRow& row) { return row_text(row, "mesh").starts_with("bunny") && row_text(row, "builder") == "medial"; });
    if (bunny != nullptr)
        lines.push_back({fmt::format("sphere tree of the {}: leaves; outside at levels 1 / 2 / 3, per mille; volume; uncovered; "
                                     "seconds on {:.0f} threads",
                                     row_text(*bunny, "mesh"), row_number(*bunny, "threads").value_or(1.0)),
                         fmt::format("{:.0f}; {:.0f} / {:.0f} / {:.1f}; {:.3f}; {:g} %; {:.1f}", row_number(*bunny, "leaves").value_or(0.0),
                                     row_number(*bunny, "outside_1_permille").value_or(0.0), row_number(*bunny, "outside_2_permille").value_or(0.0),
                                     row_number(*bunny, "outside_3_permille").value_or(0.0), row_number(*bunny, "volume_ratio").value_or(0.0),
                                     row_number(*bunny, "uncovered_percent").value_or(0.0), row_number(*bunny, "build_s").value_or(0.0)),
                         "Bradshaw's toolkit, quoted: " + row_text(*bunny, "toolkit"),
                         {},
                         "no factor: the toolkit was not run here, and neither its machine nor its threads are known"});
    for (const BenchRow& row : rows)
        if (const auto rate = row_number(row, "million_tests_per_s"); rate && *rate > 0.0) {
            lines.push_back({"sphere pairs tested, millions a second on one core", fmt::format("{:.0f}", *rate), "wanted: 100", {}, {}});
            break;
        }
    return lines;
}

/// The work budget that leaves about as much open as the paper's last row.
std::vector<Headline> of_interruptible(Rows rows) {
    const BenchRow* row =
        find(rows, [](const BenchRow& r) { return row_text(r, "order") == "breadth" && row_text(r, "paper").starts_with("1 s:"); });
    if (row == nullptr) return {};
    std::vector<Headline> lines{{fmt::format("{}, descent interrupted at {:.0f} open pairs: microseconds; contacts missed", row_text(*row, "bodies"),
                         row_number(*row, "open").value_or(0.0)),
             fmt::format("{:.3g}; {:.0f}", row_number(*row, "us").value_or(0.0), row_number(*row, "missed").value_or(0.0)),
             "Mendoza & O'Sullivan 2005, quoted: " + row_text(*row, "paper"),
             {},
             "the paper's table contradicts itself (1 s of critical time at 25 frames a second): work budgets stand for its rows; its frames "
             "have response and rendering in them, this time is the descent's alone"}};
    std::vector<std::string> budgets, rates;
    for (const BenchRow& r : rows) {
        if (!row_number(r, "steps_per_s")) continue;
        budgets.push_back(row_text(r, "budget"));
        rates.push_back(fmt::format("{:.0f}", *row_number(r, "steps_per_s")));
    }
    if (!budgets.empty())
        lines.push_back({"spikes.json, whole steps a second (tissue, contact and response; nothing is drawn) under " + list(budgets), list(rates),
                         "Mendoza & O'Sullivan 2005, quoted: 60 / 60 / 42 / 35 / 25 frames a second, drawn, at 0.1 ms / 1 ms / 10 ms / 100 ms / 1 s",
                         {},
                         {}});
    return lines;
}

std::vector<Headline> of_contacts(Rows rows) {
    std::vector<Headline> lines;
    for (const BenchRow& row : rows) {
        if (!row_text(row, "method").ends_with("(default)") || !is(row, "threads", 1) || row_text(row, "workload") == "growth") continue;
        const std::string workload = row_text(row, "workload");
        if (std::any_of(lines.begin(), lines.end(), [&](const Headline& l) { return l.what.starts_with(workload); })) continue;
        const BenchRow* peer = find(rows, [&](const BenchRow& r) {
            return row_text(r, "workload") == workload && is(r, "peer", true) && row_text(r, "method").find("embree") != std::string::npos;
        });
        const auto theirs = peer != nullptr ? row_number(*peer, "broad_ms") : std::nullopt;
        lines.push_back(
            {fmt::format("{} of {:.0f} triangles: broad phase / whole exact step, ms", workload, row_number(row, "triangles").value_or(0.0)),
             fmt::format("{:.1f} / {:.1f}", row_number(row, "refit_and_broad_ms").value_or(0.0), row_number(row, "total_ms").value_or(0.0)),
             theirs ? fmt::format("Embree's broad phase beside it: {:.1f}", *theirs) : std::string(),
             ratio(theirs, row_number(row, "refit_and_broad_ms")),
             {}});
    }
    return lines;
}

std::string chromatic_remark(std::optional<double> sets, const BenchRow* aabb, const BenchRow* plain) {
    std::string remark;
    if (aabb != nullptr && sets > row_number(*aabb, "total_ms")) remark = "I and II do not beat the AABB tree here, as they did in the paper";
    if (plain != nullptr && sets > row_number(*plain, "total_ms"))
        remark += std::string(remark.empty() ? "" : "; ") +
                  "a hierarchy with SIMD beats the sets: an elementary test costs nanoseconds, and most of what II spares are those";
    return remark;
}

std::string ms_of(const BenchRow* row) { return row != nullptr ? fmt::format("{:.1f}", row_number(*row, "total_ms").value_or(0.0)) : "-"; }

/// What the paper's stage II leaves of its colliding set: its cloth of 12,296 triangles.
constexpr const char* kPaperReduction = "Govindaraju et al. 2005, quoted: 6442 / 524 (12.3 times fewer), a cloth of 12,296 triangles";

std::vector<Headline> of_chromatic(Rows rows) {
    std::vector<Headline> lines;
    for (const BenchRow& row : rows) {
        if (row_text(row, "method") != "sets, II where it pays") continue;
        const auto beside = [&](std::string_view method) {
            return find(rows, [&](const BenchRow& r) {
                return row_text(r, "scene") == row_text(row, "scene") && row_text(r, "looked_for") == row_text(row, "looked_for") &&
                       row_text(r, "method").starts_with(method);
            });
        };
        const BenchRow *plain = beside("this library's hierarchy"), *aabb = beside("AABB");
        const BenchRow* forced = find(rows, [&](const BenchRow& r) {
            return row_text(r, "scene") == row_text(row, "scene") && row_text(r, "looked_for") == row_text(row, "looked_for") && row_text(r, "method") == "sets, I and II";
        });
        const std::string paper = row_text(row, "paper_ms");
        const std::string subject =
            row_text(row, "scene") + (row_text(row, "looked_for").empty() ? std::string() : ", contacts with " + row_text(row, "looked_for"));
        lines.push_back(
            {subject + ": AABB tree / sets, I and II / sets, II where it pays (steps in which it ran) / this library's hierarchy, ms",
             fmt::format("{} / {} / {} ({:.0f} of {:.0f}) / {}", ms_of(aabb), ms_of(forced), ms_of(&row), row_number(row, "steps_with_II").value_or(0.0),
                         row_number(row, "steps").value_or(0.0), ms_of(plain)),
             paper.empty() ? std::string() : "Govindaraju et al. 2005, quoted: " + paper + " ms with sets, I and II",
             {},
             chromatic_remark(forced != nullptr ? row_number(*forced, "total_ms") : std::nullopt, aabb, plain)});
        if (forced == nullptr || !row_number(*forced, "pcs_after_I")) continue;
        const double before = *row_number(*forced, "pcs_after_I"), after = row_number(*forced, "pcs_after_II").value_or(0.0);
        lines.push_back({subject + ": triangles of the colliding set after stage I / after I and II",
                         fmt::format("{:.0f} / {:.0f}{}", before, after, after > 0.0 ? fmt::format(" ({:.1f} times fewer)", before / after) : ""),
                         paper.empty() || row_text(row, "looked_for") != "self" ? std::string() : kPaperReduction,
                         {},
                         "the paper's cloth has other folds: a bound proves fewer triangles apart where pleats press on each other"});
    }
    return lines;
}

std::vector<Headline> of_seed001(Rows rows) {
    std::vector<Headline> lines;
    for (const BenchRow& row : rows)
        if (const auto paper = row_number(row, "paper_total_s"))
            lines.push_back({row_text(row, "setup") + ": refit / test / total, s",
                             fmt::format("{:.3g} / {:.3g} / {:.3g}", row_number(row, "refit_s").value_or(0.0),
                                         row_number(row, "test_s").value_or(0.0), row_number(row, "total_s").value_or(0.0)),
                             fmt::format("Mezger et al. 2003, quoted: {:g} / {:g} / {:g}", row_number(row, "paper_refit_s").value_or(0.0),
                                         row_number(row, "paper_test_s").value_or(0.0), *paper),
                             ratio(paper, row_number(row, "total_s")),
                             {}});
    if (!lines.empty())
        lines.front().remark = "refitting is the smaller part here: memory is read in order, and faces are tested in batches";
    return lines;
}

std::string ms_and_crossings(const BenchRow& row) {
    return fmt::format("{:.0f} ({:.0f})", *row_number(row, "total_ms"), row_number(row, "crossings").value_or(0.0));
}

/// A line per mesh: the fastest of the conservative forms, and of the paper's.
std::vector<Headline> of_image_space(Rows rows) {
    std::vector<Headline> lines;
    for (std::size_t begin = 0; begin < rows.size();) {
        const auto is_of_paper = [](const BenchRow& row) { return row_text(row, "culler").starts_with("as the paper"); };
        const BenchRow* fastest[2] = {}; // of the safe ones, of the paper's
        std::size_t end = begin;
        for (; end < rows.size() && row_text(rows[end], "mesh") == row_text(rows[begin], "mesh"); ++end) {
            const BenchRow*& best = fastest[is_of_paper(rows[end]) ? 1 : 0];
            if (row_number(rows[end], "total_ms") && (best == nullptr || *row_number(rows[end], "total_ms") < *row_number(*best, "total_ms")))
                best = &rows[end];
        }
        const auto& [safe, paper] = fastest;
        if (safe != nullptr)
            lines.push_back({fmt::format("{} of {:.0f} triangles, {}{}: ms (crossings found)", row_text(*safe, "mesh"),
                                         row_number(*safe, "triangles").value_or(0.0), row_text(*safe, "culler"),
                                         paper != nullptr ? " / " + row_text(*paper, "culler") : std::string()),
                             ms_and_crossings(*safe) + (paper != nullptr ? " / " + ms_and_crossings(*paper) : std::string()),
                             "image-space paper, quoted: " + row_text(*safe, "paper"),
                             {},
                             paper != nullptr && row_number(*paper, "crossings") < row_number(*safe, "crossings")
                                 ? "the paper's form prunes by pixel centres and loses crossings"
                                 : ""});
        begin = end;
    }
    return lines;
}

std::vector<Headline> of_seed004(Rows rows) {
    std::vector<Headline> lines;
    for (const BenchRow& row : rows) {
        const auto paper = row_number(row, "paper_s");
        const auto share = row_number(row, "percent_of_rtri"), paper_share = row_number(row, "paper_percent");
        if (!paper || row_text(row, "method") != "with skipping") continue;
        const auto anew = row_number(row, "percent_of_clusters_anew");
        lines.push_back({fmt::format("{} {:.0f} + {:.0f} triangles, with skipping, s per step (share of clusters, anew; of representative triangles')",
                                     row_text(row, "animation"), row_number(row, "rigid").value_or(0.0), row_number(row, "cloth").value_or(0.0)),
                         fmt::format("{:.3g} ({}; {:.0f} %)", row_number(row, "s_per_step").value_or(0.0), anew ? fmt::format("{:.0f} %", *anew) : "-",
                                     share.value_or(0.0)),
                         fmt::format("Wong 2009, quoted: {:g} (-; {:.0f} %)", *paper, paper_share.value_or(0.0)),
                         ratio(paper, row_number(row, "s_per_step")),
                         share && paper_share && *share < 0.67 * *paper_share
                             ? "most of the gain over representative triangles is that of clusters over single ones: the share of clusters, anew is what skipping saves"
                             : ""});
    }
    return lines;
}

/// Of each scene its parts of a tenth of the step and more, largest first, and what tissue reaches of its roof.
std::vector<Headline> of_step(Rows rows) {
    constexpr double kWorthNaming = 0.1;
    std::vector<Headline> lines;
    for (std::size_t begin = 0, end = 0; begin < rows.size(); begin = end) {
        const std::string scene = row_text(rows[begin], "scene");
        for (end = begin; end < rows.size() && row_text(rows[end], "scene") == scene;) ++end;
        const BenchRow* step = find(rows.subspan(begin, end - begin), [](const BenchRow& row) { return row_text(row, "part") == "step"; });
        if (step == nullptr) continue;
        std::vector<std::pair<double, std::string>> shares;
        for (const BenchRow& row : rows.subspan(begin, end - begin)) {
            const double share = row_number(row, "of_step").value_or(0.0);
            if (&row == step || !row_text(row, "within").empty() || share < kWorthNaming) continue;
            const auto roof = row_number(row, "of_roof");
            shares.emplace_back(-share, fmt::format("{} {:.0f} %{}", row_text(row, "part"), 100.0 * share, roof ? fmt::format(" ({:.0f} % of its roof)", 100.0 * *roof) : ""));
        }
        std::sort(shares.begin(), shares.end());
        std::vector<std::string> named;
        for (const auto& [share, text] : shares) named.push_back(text);
        lines.push_back({scene + ": a step's median / 99th percentile, ms; its parts of a tenth and more",
                         fmt::format("{:.2f} / {:.2f}; {}", row_number(*step, "ms_p50").value_or(0.0), row_number(*step, "ms_p99").value_or(0.0), fmt::join(named, ", ")),
                         {},
                         {},
                         {}});
    }
    return lines;
}

std::vector<Headline> of_growth(Rows rows) {
    std::vector<Headline> lines;
    for (const BenchRow& row : rows) {
        const auto exponent = row_number(row, "exponent"), bytes = row_number(row, "bytes_per_element");
        if (!exponent) continue;
        lines.push_back({fmt::format("{}, {:.0f} to {:.0f}: exponent of a step's time; memory per {}", row_text(row, "curve"), row_number(row, "smallest").value_or(0.0),
                                     row_number(row, "elements").value_or(0.0), row_text(row, "element")),
                         fmt::format("{:.2f}{}", *exponent, bytes ? fmt::format("; {:.4g} kB", 1e-3 * *bytes) : ""),
                         fmt::format("wanted: at most {:g}, {}", row_number(row, "wanted").value_or(0.0), is(row, "met", true) ? "met" : "missed"),
                         {},
                         is(row, "met", true) ? std::string()
                                              : fmt::format("of the largest {:.0f} % are {}, exponent {:.2f}", 100.0 * row_number(row, "of_step").value_or(0.0),
                                                            row_text(row, "largest_part"), row_number(row, "its_exponent").value_or(0.0))});
    }
    return lines;
}

struct Maker {
    std::string_view bench;
    std::vector<Headline> (*make)(Rows);
};
constexpr Maker kMakers[] = {{"deadline", of_deadline},       {"price", of_price},           {"effects", of_effects},       {"fem", of_fem},
                             {"validation", of_validation},   {"spheretree", of_spheretree}, {"interruptible", of_interruptible},
                             {"contacts", of_contacts},       {"chromatic", of_chromatic},   {"seed001", of_seed001},
                             {"image-space", of_image_space}, {"seed004", of_seed004},       {"step", of_step},
                             {"growth", of_growth}};

} // namespace

std::vector<Headline> headlines_of(std::string_view bench, const BenchTable& table) {
    for (const Maker& maker : kMakers)
        if (maker.bench == bench) {
            std::vector<Headline> lines = maker.make(table.rows);
            for (Headline& line : lines)
                if (table.quick && line.beside.find(", quoted: ") != std::string::npos) line.factor.reset(); // not of the same size
            return lines;
        }
    return {};
}

std::string markdown_cell(const std::string& words) {
    std::string safe;
    for (const char c : words) safe += c == '|' ? std::string("\\|") : c == '\n' ? std::string(" ") : std::string(1, c);
    return safe;
}

std::string headlines_markdown(std::span<const BenchHeadlines> benches) {
    std::string page = "| `trocar bench` | what | here | beside it | factor |\n| --- | --- | --- | --- | --- |\n";
    for (const BenchHeadlines& bench : benches)
        for (const Headline& line : bench.lines)
            page += fmt::format("| `{}` | {} | {} | {}{}{} | {} |\n", bench.bench, markdown_cell(line.what), markdown_cell(line.here),
                                markdown_cell(line.beside), line.remark.empty() || line.beside.empty() ? "" : "; ", markdown_cell(line.remark),
                                line.factor ? fmt::format("{:.3g}", *line.factor) : "");
    return page;
}

std::string headlines_markdown(std::span<const MeasuredBench> measured) {
    std::vector<BenchHeadlines> benches;
    for (const MeasuredBench& one : measured) benches.push_back({std::string(one.bench->name), headlines_of(one.bench->name, one.table)});
    return headlines_markdown(benches);
}

} // namespace trocar::engine
