// CoherentSearch: how the clusters move, the volumes that are predicted for a session, and the pairs of clusters that it keeps.
#include "collision/search/coherent_search.hpp"

#include "collision/search/session_cones.hpp"
#include "collision/search/session_work.hpp"

#include <algorithm>
#include <limits>

namespace trocar::collision {
namespace {

/// Share of the clusters beyond which a new session is cheaper than re-traversing all that dangle.
constexpr std::size_t kMostDangling = 4;
/// Below this share of the clusters each is traversed alone.
constexpr std::size_t kFewDangling = 64;

/// A traversal that takes more than so many plain steps is given up; a session of half the length is tried, once.
constexpr double kMostTraversal = 0.6;
/// The same as long as no plain step was measured, of what one takes at least.
constexpr double kMostAtFirst = 2.0;

} // namespace

void CoherentSearch::find_drifts(std::span<const std::span<const Vec3>> from, std::span<const std::span<const Vec3>> to) {
    ++drifts_found_;
    shapes_.gather(from, to);
    for (Index c = 0; c < volumes_.cluster_count(); ++c) drifts_[c] = find_drift(shapes_.view().of(place_of(c)));
}

/// Drift of a pair after the motion that drifts_ tell of.
double CoherentSearch::drift_on(const KeptClusters& kept) const noexcept {
    const ClusterDrift &a = drifts_[kept.clusters.a], &b = drifts_[kept.clusters.b];
    return kept.sided ? add_signed_drift(kept.drift, drift_along(kept.side, a, b)) : add_drift(kept.drift, relative_drift(a, b));
}

void CoherentSearch::find_drifts_of_step() {
    from_.clear();
    to_.clear();
    for (const SurfaceMotion& motion : motions_) {
        from_.push_back(motion.t0);
        to_.push_back(motion.t1);
    }
    find_drifts(from_, to_);
}

/// The step begins elsewhere than the last one that was done with what is kept ended: everything has drifted there meanwhile, and plain
/// steps may have gone by.
void CoherentSearch::jump() {
    from_.assign(last_.begin(), last_.end());
    to_.clear();
    for (const SurfaceMotion& motion : motions_) to_.push_back(motion.t0);
    find_drifts(from_, to_);
    for (KeptClusters& kept : pairs_.all()) kept.drift = drift_on(kept);
    for (std::size_t c = 0; c < strays_.size(); ++c) {
        strays_[c].move += drifts_[c].move - static_cast<double>(plain_steps_) * predicted_[c].speed;
        strays_[c].spread += drifts_[c].spread;
        dangling_[c] = left_volume(static_cast<Index>(c));
    }
    session_step_ += plain_steps_;
}

/// Volume of a cluster from the step under way on.
void CoherentSearch::predict(Index cluster, double begin) noexcept {
    const ClusterDrift& drift = drifts_[cluster];
    const SurfacePart& part = parts_[volumes_.part_of(cluster)];
    const double steps = static_cast<double>(length_) - begin;
    const bool paper = options_.inflation == VolumeInflation::Paper;
    PredictedMotion& motion = predicted_[cluster];
    motion.speed = paper ? Vec3(Vec3::Zero()) : drift.move;
    const double speed = drift.spread + (paper ? drift.move.norm() * kDriftRounding : 0.0) + options_.speed_slack;
    motion.inflation = steps * speed * kDriftRounding + (options_.skipping ? options_.slack * part.edge_length : 0.0);
    strays_[cluster] = {Vec3::Zero(), 0.0};
    volumes_.set_volume(cluster, motions_[part.surface].t0, motion, begin, length_);
}

bool CoherentSearch::left_volume(Index cluster) const noexcept {
    const ClusterDrift& stray = strays_[cluster];
    return !((stray.move.norm() + stray.spread) * kDriftRounding <= predicted_[cluster].inflation); // infinite: left
}

/// False: what moves would come near so much that nothing could be saved; there is no session then.
bool CoherentSearch::start_session() {
    coherence_.began_session = true;
    length_ = lengths_.start_session();
    session_step_ = 1;
    bool found = find_session_pairs();
    if (const unsigned before = length_; !found && (length_ = lengths_.halve()) < before) found = find_session_pairs();
    if (!found) return false;
    if (options_.normal_cones) leave_out_flat_regions();
    pairs_.replace(found_);
    return true;
}

/// Pairs of clusters that come near in a session of length_ steps, which begins now. False: they would be too many.
bool CoherentSearch::find_session_pairs() {
    for (Index c = 0; c < volumes_.cluster_count(); ++c) {
        predict(c, 0.0);
        strays_[c] = {drifts_[c].move - predicted_[c].speed, drifts_[c].spread};
    }
    volumes_.refit_nodes();
    found_.clear();
    const double least = least_plain_work(), plain = choice_.plain_work();
    const double bearable = plain > 0.0 ? kMostTraversal * std::max(plain, least) : kMostAtFirst * least;
    const double most = choice_.falls_back() ? bearable : std::numeric_limits<double>::infinity();
    return volumes_.traverse(contact_, options_.within, options_.between, {}, most, found_);
}

/// Of the pairs that were found, those of two clusters in one region.
void CoherentSearch::leave_out_flat_regions() {
    if (session_step_ == 1) {
        Index next = 0;
        regions_.resize(volumes_.cluster_count());
        for (std::size_t p = 0; p < parts_.size(); ++p) {
            const Index first = volumes_.first_cluster(p), count = volumes_.first_cluster(p + 1) - first;
            next = find_flat_regions(parts_[p], motions_[parts_[p].surface], next, std::span(regions_).subspan(first, count));
        }
    }
    std::erase_if(found_, [&](const SessionPair& pair) { return regions_[pair.a] != kNoIndex && regions_[pair.a] == regions_[pair.b]; });
}

/// One step more. A cluster that has left its volume, at the step's start or end, gets a new one for the rest of the session.
bool CoherentSearch::continue_session() {
    ++session_step_;
    dangling_list_.clear();
    for (Index c = 0; c < volumes_.cluster_count(); ++c) {
        strays_[c].move += drifts_[c].move - predicted_[c].speed;
        strays_[c].spread += drifts_[c].spread;
        dangling_[c] = dangling_[c] || left_volume(c);
        if (dangling_[c]) dangling_list_.push_back(c);
    }
    coherence_.dangling = dangling_list_.size();
    if (dangling_list_.empty()) return true;
    if (dangling_list_.size() * kMostDangling > volumes_.cluster_count()) return start_session();
    for (const Index c : dangling_list_) {
        predict(c, session_step_ - 1.0);
        strays_[c] = {drifts_[c].move - predicted_[c].speed, drifts_[c].spread};
    }
    volumes_.refit_nodes();
    found_.clear();
    const bool alone = options_.dangling == DanglingTraversal::Alone || (options_.dangling == DanglingTraversal::Adaptive &&
                                                                         dangling_list_.size() * kFewDangling < volumes_.cluster_count());
    if (alone)
        for (const Index c : dangling_list_) volumes_.traverse_alone(c, contact_, options_.within, options_.between, found_);
    else
        static_cast<void>(
            volumes_.traverse(contact_, options_.within, options_.between, dangling_, std::numeric_limits<double>::infinity(), found_));
    if (options_.normal_cones) leave_out_flat_regions();
    pairs_.add(found_);
    return true;
}

} // namespace trocar::collision
