// The table of a sweep as a page that needs nothing else: curves and a heat map of any columns, chosen in the page.
#pragma once

#include "engine/experiments/sweep/collect.hpp"

#include <limits>
#include <string>
#include <vector>

namespace trocar::engine {

/// Takes the rows one by one. Memory is bounded whatever their number: totals of all, and some rows whole.
class SweepPage {
public:
    /// plan  outlives it
    SweepPage(std::vector<std::string> columns, const SweepPlan& plan);
    void add(std::uint64_t run, const std::vector<std::string>& row);

    /// table        of all rows
    /// page_folder  where the page will stand: links to kept reports are relative to it
    [[nodiscard]] std::string text(const std::string& title, const SweepTable& table, const std::filesystem::path& folder,
                                   const std::filesystem::path& page_folder) const;

private:
    /// Of a collected column's numbers.
    struct Total {
        std::uint64_t count = 0;
        double sum = 0.0, least = std::numeric_limits<double>::infinity(), most = -std::numeric_limits<double>::infinity();
    };
    [[nodiscard]] bool is_plotted(std::uint64_t run) const noexcept;
    [[nodiscard]] std::string totals_text() const;
    [[nodiscard]] std::string row_text(std::size_t index, const std::filesystem::path& folder, const std::filesystem::path& page_folder) const;

    std::vector<std::string> columns_;
    const SweepPlan& plan_;
    std::size_t varied_; // columns before "repeat"
    std::vector<std::vector<std::string>> listed_, plotted_;
    std::vector<Total> totals_; // [collected name]
};

} // namespace trocar::engine
