#include "collision/search/session_pairs.hpp"

#include <algorithm>
#include <bit>

namespace trocar::collision {
namespace {

/// Smallest capacity class that holds so many pairs.
std::uint8_t capacity_class_of(std::size_t count) noexcept {
    if (count == 0) return 0;
    return static_cast<std::uint8_t>(std::max(1, static_cast<int>(std::bit_width(count - 1)) - 2));
}

std::size_t capacity_of(std::uint8_t capacity_class) noexcept { return capacity_class == 0 ? 0 : std::size_t{1} << (capacity_class + 2); }

} // namespace

void SessionPairs::clear() {
    kept_.clear();
    table_.clear();
    pool_.clear();
    for (auto& list : free_) list.clear();
    made_.fill(0);
    feature_count_ = 0;
}

/// splitmix64's finaliser; open addressing, at most half full. No order follows from it.
std::size_t SessionPairs::slot_of(SessionPair pair) const noexcept {
    std::uint64_t z = std::uint64_t{pair.a} << 32 | pair.b;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
    const std::size_t mask = table_.size() - 1;
    for (std::size_t slot = (z ^ (z >> 31)) & mask;; slot = (slot + 1) & mask) {
        const Index at = table_[slot];
        if (at == kNoIndex || (kept_[at].clusters.a == pair.a && kept_[at].clusters.b == pair.b)) return slot;
    }
}

void SessionPairs::make_table(std::size_t count) {
    const std::size_t size = std::max(table_.size(), std::bit_ceil(2 * count + 64));
    table_.assign(size, kNoIndex);
    for (std::size_t i = 0; i < kept_.size(); ++i) table_[slot_of(kept_[i].clusters)] = static_cast<Index>(i);
}

void SessionPairs::release(KeptClusters& kept) {
    if (kept.capacity_class > 0) free_[kept.capacity_class].push_back(kept.list);
    feature_count_ -= kept.list_size;
    kept.capacity_class = 0;
    kept.list_size = 0;
}

void SessionPairs::replace(std::span<const SessionPair> pairs) {
    former_.clear();
    for (const SessionPair& pair : pairs) {
        former_.push_back({.clusters = pair});
        if (kept_.empty()) continue;
        const Index at = table_[slot_of(pair)];
        if (at == kNoIndex) continue;
        former_.back() = kept_[at];
        kept_[at].capacity_class = 0; // its list has a new owner
        kept_[at].list_size = 0;
    }
    for (KeptClusters& left : kept_) release(left);
    std::swap(kept_, former_);
    make_table(kept_.size());
}

void SessionPairs::add(std::span<const SessionPair> pairs) {
    if (2 * (kept_.size() + pairs.size()) > table_.size()) make_table(kept_.size() + pairs.size());
    for (const SessionPair& pair : pairs) {
        const std::size_t slot = slot_of(pair);
        if (table_[slot] != kNoIndex) continue;
        table_[slot] = static_cast<Index>(kept_.size());
        kept_.push_back({.clusters = pair});
    }
}

void SessionPairs::store(KeptClusters& kept, std::span<const KeptFeatures> list) {
    const std::uint8_t capacity_class = capacity_class_of(list.size());
    if (capacity_class > kept.capacity_class || capacity_class + 1 < kept.capacity_class) { // a list that shrank a little keeps its capacity
        release(kept);
        kept.capacity_class = capacity_class;
        if (capacity_class > 0 && !free_[capacity_class].empty()) {
            kept.list = free_[capacity_class].back();
            free_[capacity_class].pop_back();
        } else if (capacity_class > 0) {
            if (free_[capacity_class].capacity() < ++made_[capacity_class]) free_[capacity_class].reserve(2 * made_[capacity_class]); // releasing allocates nothing
            kept.list = static_cast<Index>(pool_.size());
            pool_.resize(pool_.size() + capacity_of(capacity_class));
        }
    }
    feature_count_ += list.size();
    feature_count_ -= kept.list_size;
    kept.list_size = static_cast<Index>(list.size());
    std::copy(list.begin(), list.end(), pool_.begin() + static_cast<std::ptrdiff_t>(kept.list));
}

std::size_t SessionPairs::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    std::size_t sum = bytes(kept_) + bytes(former_) + bytes(table_) + bytes(pool_);
    for (const auto& list : free_) sum += bytes(list);
    return sum;
}

} // namespace trocar::collision
