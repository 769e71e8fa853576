#include "collision/coherent_search.hpp"

#include "collision/session_bounds.hpp"
#include "collision/session_cones.hpp"
#include "collision/swept_box.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <string>

namespace seldinger::collision {
namespace {

/// A sum of drifts, rounded up.
double add_drift(double sum, double drift) noexcept { return (sum + drift) * (1.0 + 0x1p-50); }

/// Share of the clusters beyond which a new session is cheaper than catching up with all that dangle.
constexpr std::size_t kMostDangling = 4;
/// Below this share of the clusters each is traversed alone.
constexpr std::size_t kFewDangling = 64;
/// A list of features must serve for that many steps to be worth its making.
constexpr double kListSteps = 2.0;

/// Nanoseconds or so: only their ratios count.
constexpr std::uint64_t kBoxTestWork = 30, kNewPairWork = 100, kGapWork = 100, kWaitingPairWork = 20;
constexpr float kListWork = 2200.0f, kCollectedWork = 45.0f, kLookWork = 150.0f, kListedWork = 1.5f, kBoundWork = 45.0f, kTestWork = 40.0f;
/// Of a pair of clusters that is looked at anew in a step: itself, and for each pair of features that would be collected for a list. A
/// list that costs more is given up.
constexpr float kAnewWork = 900.0f, kAnewCollectedWork = 8.0f;
/// Bounds of features that were close in the step before are computed anew in one of so many steps; in the others they are just tested.
constexpr unsigned kBoundTurn = 4;
/// Steps before a list is tried again.
constexpr std::uint8_t kPatience = 24;

Error bad_value(std::string message) { return {.code = ErrorCode::BadValue, .message = std::move(message)}; }

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

bool same_bits(std::span<const Vec3> a, std::span<const Vec3> b) noexcept {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec3)) == 0);
}

/// First vertex with a coordinate that is not finite, or the count.
std::size_t find_not_finite(std::span<const Vec3> positions) noexcept {
    double sum = 0.0;
    for (const Vec3& p : positions) sum += 0.0 * p[0] + 0.0 * p[1] + 0.0 * p[2];
    if (sum == 0.0) return positions.size();
    return static_cast<std::size_t>(std::find_if(positions.begin(), positions.end(), [](const Vec3& p) { return !is_finite(p); }) -
                                    positions.begin());
}

} // namespace

Result<void> CoherentSearch::build(std::span<const SurfaceTopology* const> surfaces, std::span<const std::span<const Vec3>> positions,
                                   const CoherentOptions& options) {
    assert(surfaces.size() == positions.size());
    if (options.tree.dop != 6 || options.tree.fine)
        return bad_value("sessions keep boxes: dop6 without fine is wanted, not dop" + std::to_string(options.tree.dop) +
                         (options.tree.fine ? " with fine" : ""));
    *this = CoherentSearch();
    options_ = options;
    contact_ = (options.distance + options.tolerance) * (1.0 + 0x1p-40);
    surfaces_.assign(surfaces.begin(), surfaces.end());
    for (BodyId s = 0; s < surfaces.size(); ++s) {
        triangles_.push_back(surfaces[s]->triangles);
        last_.emplace_back(positions[s].size());
        add_parts(s, *surfaces[s], positions[s], parts_);
    }
    build_trees(parts_, positions, options.tree);
    volumes_.build(parts_);
    features_.build(parts_);
    lengths_ = SessionLength(options.skipping ? options.session_length : 1);
    drifts_.resize(volumes_.cluster_count());
    strays_.resize(volumes_.cluster_count());
    predicted_.resize(volumes_.cluster_count());
    dangling_.assign(volumes_.cluster_count(), 0);
    no_trees_.resize(surfaces.size());
    for (BodyId a = 0; a < surfaces.size(); ++a)
        for (BodyId b = 0; b < surfaces.size(); ++b) jobs_.push_back({a, b, {}});
    return {};
}

Result<void> CoherentSearch::check(std::span<const SurfaceMotion> motions) const {
    if (motions.size() != surfaces_.size())
        return bad_value(std::to_string(motions.size()) + " surfaces move, " + std::to_string(surfaces_.size()) + " were built");
    for (std::size_t s = 0; s < motions.size(); ++s) {
        const SurfaceMotion& motion = motions[s];
        const std::string name = "surface " + std::to_string(s);
        if (motion.topology != surfaces_[s] || motion.topology->triangles != triangles_[s])
            return bad_value(name + ": its triangles are not those that the search was built for; build it anew");
        for (const auto& positions : {motion.t0, motion.t1}) {
            if (positions.size() != last_[s].size())
                return bad_value(name + ": " + std::to_string(positions.size()) + " vertices move, " + std::to_string(last_[s].size()) +
                                 " were built");
            if (const std::size_t v = find_not_finite(positions); v < positions.size())
                return Error{.code = ErrorCode::NotFinite, .message = name + ": vertex " + std::to_string(v) + " is not finite"};
        }
    }
    return {};
}

void CoherentSearch::find_drifts(std::span<const std::span<const Vec3>> from, std::span<const std::span<const Vec3>> to) {
    for (std::size_t p = 0; p < parts_.size(); ++p) {
        const SurfacePart& part = parts_[p];
        const Index first = volumes_.first_cluster(p), count = volumes_.first_cluster(p + 1) - first;
        for (Index c = 0; c < count; ++c) drifts_[first + c] = find_drift(from[part.surface], to[part.surface], part.touched_by(c));
    }
}

/// The step begins elsewhere than the last one ended: everything has drifted there meanwhile.
void CoherentSearch::jump(std::span<const SurfaceMotion> motions) {
    from_.assign(last_.begin(), last_.end());
    to_.clear();
    for (const SurfaceMotion& motion : motions) to_.push_back(motion.t0);
    find_drifts(from_, to_);
    for (KeptClusters& kept : pairs_.all())
        kept.drift = add_drift(kept.drift, relative_drift(drifts_[kept.clusters.a], drifts_[kept.clusters.b]));
    for (std::size_t c = 0; c < strays_.size(); ++c) {
        strays_[c].move += drifts_[c].move;
        strays_[c].spread += drifts_[c].spread;
        dangling_[c] = left_volume(static_cast<Index>(c));
    }
}

Result<void> CoherentSearch::start_step(std::span<const SurfaceMotion> motions) {
    if (auto checked = check(motions); !checked) return checked;
    motions_.assign(motions.begin(), motions.end());
    std::fill(dangling_.begin(), dangling_.end(), std::uint8_t{0});
    bool jumps = false;
    for (std::size_t s = 0; s < motions.size() && has_last_; ++s) jumps = jumps || !same_bits(motions[s].t0, last_[s]);
    if (jumps) jump(motions);
    from_.clear();
    to_.clear();
    for (std::size_t s = 0; s < motions.size(); ++s) {
        from_.push_back(motions[s].t0);
        to_.push_back(motions[s].t1);
        std::copy(motions[s].t1.begin(), motions[s].t1.end(), last_[s].begin());
    }
    find_drifts(from_, to_);
    has_last_ = true;
    return {};
}

SessionFeatures::Place CoherentSearch::place_of(Index cluster) const noexcept {
    const std::size_t part = volumes_.part_of(cluster);
    return {part, cluster - volumes_.first_cluster(part)};
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

void CoherentSearch::start_session() {
    coherence_.began_session = true;
    length_ = lengths_.start_session();
    session_step_ = 1;
    for (Index c = 0; c < volumes_.cluster_count(); ++c) {
        predict(c, 0.0);
        strays_[c] = {drifts_[c].move - predicted_[c].speed, drifts_[c].spread};
    }
    volumes_.refit_nodes();
    found_.clear();
    volumes_.traverse(contact_, options_.within, options_.between, {}, found_);
    if (options_.normal_cones) leave_out_flat_regions();
    pairs_.replace(found_);
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

/// One step more. Who has left its volume, at the beginning of the step or at its end, gets a new one for the rest of the session.
void CoherentSearch::continue_session() {
    ++session_step_;
    dangling_list_.clear();
    for (Index c = 0; c < volumes_.cluster_count(); ++c) {
        strays_[c].move += drifts_[c].move - predicted_[c].speed;
        strays_[c].spread += drifts_[c].spread;
        dangling_[c] = dangling_[c] || left_volume(c);
        if (dangling_[c]) dangling_list_.push_back(c);
    }
    coherence_.dangling = dangling_list_.size();
    if (dangling_list_.empty()) return;
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
        volumes_.traverse(contact_, options_.within, options_.between, dangling_, found_);
    if (options_.normal_cones) leave_out_flat_regions();
    pairs_.add(found_);
}

void CoherentSearch::find_candidates() {
    stats_ = {};
    coherence_ = {};
    for (Job& job : jobs_) job.candidates.clear();
    features_.start_step(motions_);
    const std::uint64_t tests_before = volumes_.box_tests();
    if (session_step_ >= length_)
        start_session();
    else
        continue_session();
    for (KeptClusters& kept : pairs_.all()) {
        const double step = relative_drift(drifts_[kept.clusters.a], drifts_[kept.clusters.b]), drift = add_drift(kept.drift, step);
        kept.steps += kept.steps < UINT16_MAX;
        if (drift <= kept.wake)
            kept.drift = drift;
        else
            look_at(kept, step);
    }
    coherence_.session_length = length_;
    coherence_.kept_clusters = pairs_.all().size();
    coherence_.kept_features = pairs_.feature_count();
    stats_.box_tests = volumes_.box_tests() - tests_before;
    stats_.cluster_pairs = coherence_.awake;
    for (const Job& job : jobs_) {
        stats_.candidates_vf += job.candidates.vertex_face.size() + job.candidates.face_vertex.size();
        stats_.candidates_ee += job.candidates.edge_edge.size();
    }
    lengths_.note_step(kBoxTestWork * stats_.box_tests + kNewPairWork * (coherence_.began_session ? coherence_.kept_clusters : 0) +
                       kGapWork * coherence_.gaps + kWaitingPairWork * coherence_.kept_clusters);
}

/// drift   m, of this step
void CoherentSearch::look_at(KeptClusters& kept, double drift) {
    ++coherence_.awake;
    if (!options_.skipping) return look_anew(kept);
    if (add_drift(kept.drift, drift) <= kept.complete) return look_at_list(kept, drift);
    if (kept.list_size > 0) give_list_up(kept);
    if (kept.patience > 0) {
        --kept.patience;
        return look_anew(kept);
    }
    const double gap = features_.gap_at_start(place_of(kept.clusters.a), place_of(kept.clusters.b)) - contact_;
    if (gap > drift) { // none of their features can meet before they have drifted that far
        ++coherence_.gaps;
        pairs_.store(kept, {});
        kept.wake = kept.complete = gap;
        kept.drift = drift;
        return;
    }
    const SurfacePart &a = parts_[volumes_.part_of(kept.clusters.a)], &b = parts_[volumes_.part_of(kept.clusters.b)];
    const double reach = options_.reach * 0.5 * (a.edge_length + b.edge_length);
    if (kListSteps * drift > reach) return look_anew(kept);
    make_list(kept, drift, reach);
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
    kept.work = kListWork + kCollectedWork * static_cast<float>(collected_.size());
    kept.anew_work = kAnewWork + kAnewCollectedWork * static_cast<float>(collected_.size());
    kept.steps = 1;
}

/// Bounds that the drift has used up are computed anew.
void CoherentSearch::look_at_list(KeptClusters& kept, double drift) {
    Job& job = job_of(kept);
    const double now = kept.drift, end = add_drift(now, drift);
    kept.drift = end;
    kept.wake = kept.complete;
    const std::span<KeptFeatures> list = pairs_.features(kept);
    kept.work += kLookWork + kListedWork * static_cast<float>(list.size());
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
                kept.work += kTestWork;
                continue;
            }
            asked_.push_back({list[i].a, list[i].b});
            asked_at_.push_back(static_cast<Index>(i));
        }
        kept.work += kBoundWork * static_cast<float>(asked_.size());
        if (options_.front_end) find_bounds(job, kind, asked_);
        for (std::size_t k = 0; k < asked_.size(); ++k) {
            KeptFeatures& pair = list[asked_at_[k]];
            if (options_.front_end) pair.bound = round_down(bounds_[k] + now);
            if (pair.bound <= end) give(job, kind, asked_[k]);
            kept.wake = std::min(kept.wake, static_cast<double>(pair.bound));
        }
    }
}

/// A list that has served its time: was it worth it?
void CoherentSearch::give_list_up(KeptClusters& kept) noexcept {
    if (kept.work > kept.anew_work * static_cast<float>(kept.steps)) kept.patience = kPatience;
}

/// Their boxes over this step, as every step does it where nothing is kept.
void CoherentSearch::look_anew(KeptClusters& kept) {
    ++coherence_.anew;
    pairs_.store(kept, {});
    kept.drift = 0.0;
    kept.wake = kept.complete = -1.0;
    features_.collect(place_of(kept.clusters.a), place_of(kept.clusters.b), BoxTime::Step, options_.distance, options_.simd,
                      job_of(kept).candidates);
}

void CoherentSearch::decide(std::vector<SearchContact>& contacts) {
    contacts.clear();
    for (Job& job : jobs_) {
        if (job.candidates.size() == 0) continue;
        const SurfacePair pair({job.a, &no_trees_[job.a], motions_[job.a]}, {job.b, &no_trees_[job.b], motions_[job.b]}, options_);
        pair.decide(job.candidates, contacts, stats_);
    }
    std::sort(contacts.begin(), contacts.end(), comes_before);
}

std::size_t CoherentSearch::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    std::size_t sum = volumes_.memory() + features_.memory() + pairs_.memory() + bytes(drifts_) + bytes(strays_) + bytes(predicted_) +
                      bytes(found_) + bytes(list_);
    for (const SurfacePart& part : parts_) sum += part.memory();
    for (const auto& list : last_) sum += bytes(list);
    for (const auto& list : triangles_) sum += bytes(list);
    const auto lists = [&](const CandidateLists& of) { return bytes(of.vertex_face) + bytes(of.face_vertex) + bytes(of.edge_edge); };
    sum += lists(collected_) + bytes(asked_) + bytes(asked_at_) + bytes(bounds_);
    for (const Job& job : jobs_) sum += lists(job.candidates);
    return sum;
}

} // namespace seldinger::collision
