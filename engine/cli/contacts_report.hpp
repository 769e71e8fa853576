// The statistics of `contacts`: counts and times of every stage, as JSON and as lines.
#pragma once

#include "collision/search/coherent_search.hpp"
#include "collision/search/contact_search.hpp"

#include <nlohmann/json_fwd.hpp>

#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

/// What one step cost and found.
struct ContactsStepRow {
    std::size_t frame = 0;
    collision::ExactStats stats;
    double refit_ms = 0.0, broad_ms = 0.0, cull_ms = 0.0, narrow_ms = 0.0;
    std::size_t near_pairs = 0, left_pairs = 0; // of triangles, before and after culling by sets
    collision::CoherenceStats coherence;        // with --coherent
    [[nodiscard]] double total_ms() const noexcept { return refit_ms + broad_ms + cull_ms + narrow_ms; }
};

struct ContactsReport {
    /// Of candidates that image-space culling tested.
    struct Culled {
        std::size_t colours = 0;
        std::string backend;
        std::vector<std::string> notes;
    };

    std::string method;
    double distance = 0.0;
    unsigned threads = 1;
    bool sequence = false, coherent = false;
    double build_ms = 0.0;
    std::size_t memory = 0; // bytes, of the trees or of what is kept
    std::optional<Culled> culled;
    std::vector<ContactsStepRow> rows; // at least one
};

/// Medians of the steps; of a sequence a row for every step as well.
[[nodiscard]] nlohmann::ordered_json contacts_report_json(const ContactsReport& report);

/// The same as readable text, with line ends.
[[nodiscard]] std::string contacts_report_text(const ContactsReport& report);

} // namespace trocar::engine
