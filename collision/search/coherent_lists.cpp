// CoherentSearch: pairs of clusters that may be in contact in this step, and the pairs of features that are kept for them.
#include "collision/search/coherent_search.hpp"

#include "collision/search/session_bounds.hpp"
#include "collision/search/session_work.hpp"
#include "collision/swept_box.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

/// Bounds of features that were close in the step before are computed anew in one of so many steps; in the others they are just tested.
constexpr unsigned kBoundTurn = 4;
/// Steps before a list is tried again.
constexpr std::uint8_t kPatience = 24;

SweptBox box_of(const SurfaceMotion& motion, std::span<const Index> vertices) noexcept {
    SweptBox box = make_swept_box(motion.t0[vertices[0]], motion.t1[vertices[0]]);
    for (const Index v : vertices.subspan(1)) box.add(make_swept_box(motion.t0[v], motion.t1[v]));
    return box;
}

/// What the boxes of the hierarchy say of a pair, with their very bits.
bool boxes_are_near(PairKind kind, Index a, Index b, const SurfaceMotion& x, const SurfaceMotion& y, float distance) noexcept {
    if (kind == PairKind::EdgeEdge) return are_near(box_of(x, x.topology->edges[a]), box_of(y, y.topology->edges[b]), distance);
    const SurfaceMotion &vertices = kind == PairKind::VertexFace ? x : y, &faces = kind == PairKind::VertexFace ? y : x;
    return are_near(make_swept_box(vertices.t0[a], vertices.t1[a]), box_of(faces, faces.topology->triangles[b]), distance);
}

} // namespace

void CoherentSearch::look_at(KeptClusters& kept) {
    ++coherence_.awake;
    if (!options_.skipping) return test_anew(kept);
    const double drift = relative_drift(drifts_[kept.clusters.a], drifts_[kept.clusters.b]); // of this step
    if (!kept.sided && add_drift(kept.drift, drift) <= kept.complete) return test_list(kept, drift);
    if (kept.list_size > 0) give_list_up(kept);
    kept.sided = false;
    if (stays_beside(kept)) return;
    if (kept.patience > 0) {
        --kept.patience;
        return test_anew(kept);
    }
    const SurfacePart &a = parts_[volumes_.part_of(kept.clusters.a)], &b = parts_[volumes_.part_of(kept.clusters.b)];
    const double reach = options_.reach * 0.5 * (a.edge_length + b.edge_length);
    if (options_.list_steps * drift > reach || lists_left_ == 0) return test_anew(kept);
    --lists_left_;
    make_list(kept, drift, reach);
}

/// Clusters that cannot meet in this step, whatever their features; how long that lasts is seen by their drift along one direction.
bool CoherentSearch::stays_beside(KeptClusters& kept) {
    work_ += work::kGap;
    const ClusterPlace place_a = place_of(kept.clusters.a), place_b = place_of(kept.clusters.b);
    const ClusterDrift &drift_a = drifts_[kept.clusters.a], &drift_b = drifts_[kept.clusters.b];
    const auto sleeps = [&](const Vec3& side, double gap) {
        const double drift = drift_along(side, drift_a, drift_b);
        if (!(gap > 0.0 && gap > drift)) return false;
        pairs_.store(kept, {});
        kept.sided = true;
        kept.side = side;
        kept.drift = drift;
        kept.wake = kept.complete = gap;
        return true;
    };
    const SessionFeatures::Gap gap = features_.gap_at_start(place_a, place_b);
    if (sleeps(gap.side, gap.distance - contact_)) {
        ++coherence_.gaps;
        return true;
    }
    if (!options_.sides || sides_.are_neighbours(place_a, place_b)) return false;
    work_ += work::kSides;
    const SessionSides::Apart apart = sides_.apart(place_a, place_b, contact_);
    if (!apart.during_step && !(apart.at_start > 0.0)) return false;
    if (!sleeps(apart.side, apart.at_start)) {
        if (!apart.during_step) return false;
        pairs_.store(kept, {});
        kept.drift = 0.0;
        kept.wake = kept.complete = -1.0;
    }
    ++coherence_.sides;
    return true;
}

/// Into bounds_, for where the features are at the start of the step: what they are apart beyond the contact distance.
void CoherentSearch::find_bounds(const Job& job, PairKind kind, std::span<const FeaturePair> pairs) {
    coherence_.bounds += pairs.size();
    bounds_.resize(pairs.size());
    const SurfaceMotion &a = motions_[job.a], &b = motions_[job.b];
    if (kind == PairKind::VertexFace) bound_vertex_faces(a, b, pairs, bounds_);
    if (kind == PairKind::FaceVertex) bound_vertex_faces(b, a, pairs, bounds_);
    if (kind == PairKind::EdgeEdge) bound_edge_edges(a, b, pairs, bounds_);
    for (double& bound : bounds_) bound -= contact_;
}

void CoherentSearch::give(Job& job, PairKind kind, FeaturePair pair) {
    if (!boxes_are_near(kind, pair.a, pair.b, motions_[job.a], motions_[job.b], round_up(options_.distance))) return;
    list_of(job.candidates, kind).push_back(pair);
}

/// All pairs of features that are not farther apart than the reach.
void CoherentSearch::make_list(KeptClusters& kept, double drift, double reach) {
    ++coherence_.relisted;
    collected_.clear();
    features_.collect(place_of(kept.clusters.a), place_of(kept.clusters.b), BoxTime::Start, (contact_ + reach) * kDriftRounding,
                      options_.simd, collected_);
    Job& job = job_of(kept);
    list_.clear();
    double wake = reach;
    for (const PairKind kind : kPairKinds) {
        const std::vector<FeaturePair>& pairs = list_of(collected_, kind);
        if (options_.front_end) find_bounds(job, kind, pairs);
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            const float bound = options_.front_end ? round_down(bounds_[i]) : -SweptBox::kNothing;
            if (bound > reach) continue;
            list_.push_back({bound, pairs[i].a, pairs[i].b, kind});
            wake = std::min(wake, static_cast<double>(bound));
            if (bound <= drift) give(job, kind, pairs[i]);
        }
    }
    pairs_.store(kept, list_);
    kept.complete = reach;
    kept.wake = wake;
    kept.drift = drift;
    const auto collected = static_cast<double>(collected_.size());
    const double spent = work::kList + work::kCollected * collected;
    work_ += spent;
    kept.work = static_cast<float>(spent);
    kept.anew_work = static_cast<float>(work::kAnew + work::kAnewCollected * collected);
    kept.steps = 1;
}

/// Bounds that the drift has used up are computed anew.
void CoherentSearch::test_list(KeptClusters& kept, double drift) {
    Job& job = job_of(kept);
    const double now = kept.drift, end = add_drift(now, drift);
    kept.drift = end;
    kept.wake = kept.complete;
    const std::span<KeptFeatures> list = pairs_.features(kept);
    double spent = work::kLook + work::kListed * static_cast<double>(list.size());
    for (std::size_t i = 0; i < list.size();) {
        const PairKind kind = list[i].kind; // a list comes by kind
        asked_.clear();
        asked_at_.clear();
        for (; i < list.size() && list[i].kind == kind; ++i) {
            if (list[i].bound > end) {
                kept.wake = std::min(kept.wake, static_cast<double>(list[i].bound));
                continue;
            }
            if (list[i].bound <= now && kept.steps % kBoundTurn != 0) {
                give(job, kind, {list[i].a, list[i].b});
                kept.wake = std::min(kept.wake, static_cast<double>(list[i].bound));
                spent += work::kGiven;
                continue;
            }
            asked_.push_back({list[i].a, list[i].b});
            asked_at_.push_back(static_cast<Index>(i));
        }
        spent += work::kBound * static_cast<double>(asked_.size());
        if (options_.front_end) find_bounds(job, kind, asked_);
        for (std::size_t k = 0; k < asked_.size(); ++k) {
            KeptFeatures& pair = list[asked_at_[k]];
            if (options_.front_end) pair.bound = round_down(bounds_[k] + now);
            if (pair.bound <= end) give(job, kind, asked_[k]);
            kept.wake = std::min(kept.wake, static_cast<double>(pair.bound));
        }
    }
    kept.work += static_cast<float>(spent);
    work_ += spent;
}

/// A list at its end: did it save more than it cost?
void CoherentSearch::give_list_up(KeptClusters& kept) noexcept {
    if (kept.work > kept.anew_work * static_cast<float>(kept.steps)) kept.patience = kPatience;
}

/// Their boxes over this step, as every step does it where nothing is kept.
void CoherentSearch::test_anew(KeptClusters& kept) {
    ++coherence_.anew;
    work_ += work::kAnew;
    pairs_.store(kept, {});
    kept.drift = 0.0;
    kept.wake = kept.complete = -1.0;
    features_.collect(place_of(kept.clusters.a), place_of(kept.clusters.b), BoxTime::Step, options_.distance, options_.simd,
                      job_of(kept).candidates);
}

} // namespace trocar::collision
