// The table of a sweep as a page that needs nothing else: curves and a heat map of any columns, chosen in the page.
#pragma once

#include "engine/experiments/sweep/collect.hpp"

#include <string>

namespace trocar::engine {

/// page_folder  where the page will stand: links to kept reports are relative to it
[[nodiscard]] std::string sweep_page(const std::string& title, const SweepTable& table, const SweepPlan& plan, const std::filesystem::path& folder,
                                     const std::filesystem::path& page_folder);

} // namespace trocar::engine
