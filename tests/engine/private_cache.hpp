#pragma once

#include "engine/prepare/process.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace trocar::engine {

/// Sends the cache to an empty folder for as long as it lives.
class PrivateCache {
public:
    PrivateCache() : folder_(std::move(TemporaryFolder::make()).value()) {
        if (const char* before = std::getenv("TROCAR_CACHE")) before_ = before;
        setenv("TROCAR_CACHE", folder_.path().c_str(), 1);
    }
    ~PrivateCache() {
        if (before_.empty())
            unsetenv("TROCAR_CACHE");
        else
            setenv("TROCAR_CACHE", before_.c_str(), 1);
    }
    PrivateCache(const PrivateCache&) = delete;
    PrivateCache& operator=(const PrivateCache&) = delete;
    [[nodiscard]] std::filesystem::path only_entry() const { return *std::filesystem::directory_iterator(folder_.path()); }
    /// Sorted.
    [[nodiscard]] std::vector<std::filesystem::path> entries() const {
        std::vector<std::filesystem::path> list;
        for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) list.push_back(entry.path());
        std::sort(list.begin(), list.end());
        return list;
    }

private:
    TemporaryFolder folder_;
    std::string before_;
};

} // namespace trocar::engine
