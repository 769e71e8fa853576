// What is kept from step to step: the pairs of clusters that a session's traversal found, and with each the pairs of features that may
// come into contact before the clusters have drifted past a reach. Of each feature pair a lower bound on its distance is known; until
// the drift since then uses it up, no elementary test can find anything.
// source   Wong (2009), "keep potentially colliding pairs", "front-end filtering". Deviates: a bound is not decreased pair by pair but
//          compared with one drift for all pairs of two clusters, so that sleeping pairs cost nothing.
#pragma once

#include "collision/search/session_features.hpp"
#include "collision/search/session_volumes.hpp"

#include <span>
#include <vector>

namespace trocar::collision {

/// A pair of features and the drift at which it must be tested: its distance less what counts as contact, never above the truth.
struct KeptFeatures {
    float bound; // m
    Index a, b;
    PairKind kind;
};

struct KeptClusters {
    SessionPair clusters{};
    double drift = 0.0;            // m, since the list was made
    double wake = -1.0;            // m, drift below which no kept pair can be in contact; negative: test it
    double complete = -1.0;        // m, drift up to which the list is complete; negative: there is none
    /// Where `sided`: a unit direction from a to b, along which drift and wake are meant; there is no list then.
    Vec3 side = Vec3::Zero();
    Index list = 0, list_size = 0; // in the pool
    bool sided = false;
    std::uint8_t capacity_class = 0;         // the list has a capacity of 2^(room + 2) pairs; 0: for none
    std::uint8_t patience = 0;     // steps still computed anew before a list is tried again
    std::uint16_t steps = 0;       // since the list was made
    float work = 0.0f;             // on the list, its making included
    float anew_work = 0.0f;        // what a step without a list would have taken, about
};

class SessionPairs {
public:
    void clear();

    [[nodiscard]] std::span<KeptClusters> all() noexcept { return kept_; }
    [[nodiscard]] std::span<const KeptClusters> all() const noexcept { return kept_; }
    [[nodiscard]] std::span<KeptFeatures> features(const KeptClusters& kept) noexcept {
        return std::span(pool_).subspan(kept.list, kept.list_size);
    }

    /// Pairs of a new session: those that were kept before bring their lists along, the others are dropped.
    void replace(std::span<const SessionPair> pairs);
    /// Pairs of clusters that came to be near within a session; those that are kept already stay as they are.
    void add(std::span<const SessionPair> pairs);
    /// A new list, with the drift at nought.
    void store(KeptClusters& kept, std::span<const KeptFeatures> list);

    [[nodiscard]] std::size_t feature_count() const noexcept { return feature_count_; } // in all lists
    [[nodiscard]] std::size_t memory() const noexcept;

private:
    [[nodiscard]] std::size_t slot_of(SessionPair pair) const noexcept; // where it stands in the table, or the free slot where it would
    void make_table(std::size_t count);
    void release(KeptClusters& kept);

    std::vector<KeptClusters> kept_, former_;
    std::vector<Index> table_; // [2^n] kept_'s places by a hash of the clusters, kNoIndex: free
    std::vector<KeptFeatures> pool_;
    std::array<std::vector<Index>, 32> free_; // [room] free lists in the pool
    std::array<std::size_t, 32> made_{};      // [room] lists in total
    std::size_t feature_count_ = 0;
};

} // namespace trocar::collision
