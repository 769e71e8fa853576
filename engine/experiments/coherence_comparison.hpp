// The price of a sequence's steps with what is kept from step to step, and without: both searches side by side, step by step.
#pragma once

#include "collision/search/coherent_search.hpp"

#include <nlohmann/json_fwd.hpp>

#include <functional>
#include <string>
#include <vector>

namespace trocar::engine {

struct CoherenceComparison {
    struct Step {
        double anew_ms = 0.0, coherent_ms = 0.0; // of the thread
        double anew_work = 0.0, coherent_work = 0.0; // as counted
        std::size_t contacts = 0;
        bool plain = false; // what is kept did not pay
    };
    std::vector<Step> steps;
    bool same = true; // every contact, bit for bit

    [[nodiscard]] std::size_t steps_with_contacts() const noexcept;
    /// Time with what is kept over time without, all steps' sum; of those with contacts alone on request. 0 where there are none.
    [[nodiscard]] double share(bool with_contacts_only = false) const noexcept;
    /// A sentence.
    [[nodiscard]] std::string text() const;
    [[nodiscard]] nlohmann::ordered_json json() const;
};

/// Builds both searches at the first step and runs all; who goes first changes from step to step.
/// motions   of step k; they must stay where they are until the next call
/// fails     as CoherentSearch does
[[nodiscard]] Result<CoherenceComparison> compare_coherence(std::size_t steps,
                                                            const std::function<std::vector<collision::SurfaceMotion>(std::size_t k)>& motions,
                                                            const collision::CoherentOptions& options);

} // namespace trocar::engine
