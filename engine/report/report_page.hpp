// report.html: one page without any other file, for a screen or a phone.
#pragma once

#include "engine/report/photographer.hpp"
#include "engine/report/summary.hpp"

namespace trocar::engine {

/// Reads the pictures back from `folder`. What could not be made (plots without gnuplot) adds a notice, and has a sentence in its place.
[[nodiscard]] std::string make_report_page(const RunRecord& record, const std::vector<TakenPicture>& pictures,
                                           const std::filesystem::path& folder, std::vector<std::string>& notices);

} // namespace trocar::engine
