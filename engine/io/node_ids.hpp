// Node numbers of mesh files are names: any integers, in any order. This maps a number to its index.
#pragma once

#include "base/vec.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace trocar::engine {

class NodeIds {
public:
    void reserve(std::size_t count) { entries_.reserve(count); }
    void add(std::int64_t id) {
        constexpr std::int64_t kLargest = std::numeric_limits<std::int64_t>::max();
        if (!entries_.empty() && (entries_.back().first == kLargest || id != entries_.back().first + 1)) consecutive_ = false;
        entries_.emplace_back(id, static_cast<Index>(entries_.size()));
    }
    [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }

    /// Call once, after the last add. Returns a number that two nodes have.
    [[nodiscard]] std::optional<std::int64_t> find_duplicate() {
        if (consecutive_) return std::nullopt;
        std::sort(entries_.begin(), entries_.end());
        const auto same = [](const auto& a, const auto& b) { return a.first == b.first; };
        const auto found = std::adjacent_find(entries_.begin(), entries_.end(), same);
        if (found == entries_.end()) return std::nullopt;
        return found->first;
    }

    /// The node's place in the file, or kNoIndex.
    [[nodiscard]] Index find(std::int64_t id) const noexcept {
        if (entries_.empty()) return kNoIndex;
        if (consecutive_) {
            const std::int64_t first = entries_.front().first, last = entries_.back().first;
            return id < first || id > last ? kNoIndex : static_cast<Index>(id - first);
        }
        const auto found = std::lower_bound(entries_.begin(), entries_.end(), std::pair<std::int64_t, Index>(id, 0));
        return found == entries_.end() || found->first != id ? kNoIndex : found->second;
    }

private:
    std::vector<std::pair<std::int64_t, Index>> entries_; // number, place; sorted by number after find_duplicate
    bool consecutive_ = true;                             // then no search is needed
};

} // namespace trocar::engine
