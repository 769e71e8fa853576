#include "engine/cli/contacts_report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <iterator>

namespace trocar::engine {

namespace {

/// Of one figure over the steps.
template <class Of>
auto median(const ContactsReport& report, const Of& of) {
    std::vector<decltype(of(report.rows[0]))> values;
    for (const ContactsStepRow& row : report.rows) values.push_back(of(row));
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

std::size_t session_count(const ContactsReport& report) {
    return static_cast<std::size_t>(
        std::count_if(report.rows.begin(), report.rows.end(), [](const ContactsStepRow& r) { return r.coherence.began_session; }));
}

/// The use that a step made of kept results.
nlohmann::ordered_json kept_json(const collision::CoherenceStats& kept) {
    return {{"plain", kept.plain},
            {"began_session", kept.began_session},
            {"session_length", kept.session_length},
            {"dangling_clusters", kept.dangling},
            {"cluster_pairs", kept.kept_clusters},
            {"feature_pairs", kept.kept_features},
            {"looked_at", kept.awake},
            {"gaps", kept.gaps},
            {"sides", kept.sides},
            {"lists_made", kept.relisted},
            {"anew", kept.anew},
            {"bounds", kept.bounds},
            {"work", kept.work}};
}

} // namespace

nlohmann::ordered_json contacts_report_json(const ContactsReport& report) {
    nlohmann::ordered_json json;
    const auto count = [&](auto member) { return median(report, [member](const ContactsStepRow& r) { return r.stats.*member; }); };
    using Stats = collision::ExactStats;
    json["method"] = report.method;
    json["candidates_vf"] = count(&Stats::candidates_vf);
    json["candidates_ee"] = count(&Stats::candidates_ee);
    json["hits_vf"] = count(&Stats::hits_vf);
    json["hits_ee"] = count(&Stats::hits_ee);
    json["unresolved"] = count(&Stats::unresolved);
    json["exact"] = count(&Stats::exact);
    json["cluster_pairs"] = count(&Stats::cluster_pairs);
    json["build_ms"] = report.build_ms;
    json["refit_ms"] = median(report, [](const ContactsStepRow& r) { return r.refit_ms; });
    json["broad_ms"] = median(report, [](const ContactsStepRow& r) { return r.broad_ms; });
    json["cull_ms"] = median(report, [](const ContactsStepRow& r) { return r.cull_ms; });
    json["narrow_ms"] = median(report, [](const ContactsStepRow& r) { return r.narrow_ms; });
    json["total_ms"] = median(report, [](const ContactsStepRow& r) { return r.total_ms(); });
    json["colours"] = report.culled ? report.culled->colours : 0;
    if (report.culled) {
        json["culler"] = report.culled->backend;
        json["near_pairs"] = median(report, [](const ContactsStepRow& r) { return r.near_pairs; });
        json["left_pairs"] = median(report, [](const ContactsStepRow& r) { return r.left_pairs; });
        json["notes"] = report.culled->notes;
    }
    json["distance"] = report.distance;
    json["threads"] = report.threads;
    if (report.coherent) {
        json["kept_cluster_pairs"] = median(report, [](const ContactsStepRow& r) { return r.coherence.kept_clusters; });
        json["kept_feature_pairs"] = median(report, [](const ContactsStepRow& r) { return r.coherence.kept_features; });
        json["looked_at"] = median(report, [](const ContactsStepRow& r) { return r.coherence.awake; });
        json["sessions"] = session_count(report);
    }
    json["tree_bytes"] = report.memory;
    if (!report.sequence) return json;
    for (const ContactsStepRow& r : report.rows) {
        auto& step = json["steps"].emplace_back(nlohmann::ordered_json{{"frame", r.frame},
                                                                       {"box_tests", r.stats.box_tests},
                                                                       {"cluster_pairs", r.stats.cluster_pairs},
                                                                       {"candidates_vf", r.stats.candidates_vf},
                                                                       {"candidates_ee", r.stats.candidates_ee},
                                                                       {"hits_vf", r.stats.hits_vf},
                                                                       {"hits_ee", r.stats.hits_ee},
                                                                       {"unresolved", r.stats.unresolved},
                                                                       {"exact", r.stats.exact},
                                                                       {"refit_ms", r.refit_ms},
                                                                       {"broad_ms", r.broad_ms},
                                                                       {"cull_ms", r.cull_ms},
                                                                       {"narrow_ms", r.narrow_ms},
                                                                       {"total_ms", r.total_ms()}});
        if (report.coherent) step["kept"] = kept_json(r.coherence);
    }
    return json;
}

std::string contacts_report_text(const ContactsReport& report) {
    std::string text;
    const auto out = std::back_inserter(text);
    std::uint64_t vf = 0, ee = 0, unresolved = 0, exact = 0;
    for (const ContactsStepRow& r : report.rows) {
        vf += r.stats.hits_vf;
        ee += r.stats.hits_ee;
        unresolved += r.stats.unresolved;
        exact += r.stats.exact;
    }
    const char* per_step = report.rows.size() > 1 ? ", medians of a step" : "";
    const auto json = contacts_report_json(report);
    fmt::format_to(out, "{}: {} candidates VF, {} EE{}\n", report.method, json["candidates_vf"].get<std::uint64_t>(),
                   json["candidates_ee"].get<std::uint64_t>(), per_step);
    fmt::format_to(out, "build {:.2f} ms, refit {:.2f}, broad {:.2f}, narrow {:.2f}, total {:.2f} ms without the build{}\n",
                   report.build_ms, json["refit_ms"].get<double>(), json["broad_ms"].get<double>(), json["narrow_ms"].get<double>(),
                   json["total_ms"].get<double>(), per_step);
    if (report.culled) {
        fmt::format_to(out, "{} sets; pairs of triangles that are near: {}, left after culling by {}: {}, in {:.2f} ms{}\n",
                       report.culled->colours, json["near_pairs"].get<std::size_t>(), report.culled->backend,
                       json["left_pairs"].get<std::size_t>(), json["cull_ms"].get<double>(), per_step);
        for (const std::string& note : report.culled->notes) fmt::format_to(out, "note: {}\n", note);
    }
    if (report.coherent)
        fmt::format_to(out, "{} sessions; kept: {} pairs of clusters, {} of features{}; {:.1f} MB\n", session_count(report),
                       json["kept_cluster_pairs"].get<std::uint64_t>(), json["kept_feature_pairs"].get<std::uint64_t>(), per_step,
                       1e-6 * json["tree_bytes"].get<double>());
    fmt::format_to(out, "{} steps, {} contacts: {} VF, {} EE; {} candidates decided exactly, {} unresolved\n", report.rows.size(),
                   vf + ee, vf, ee, exact, unresolved);
    return text;
}

} // namespace trocar::engine
