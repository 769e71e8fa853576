#include "collision/search/coherent_search.hpp"

#include "collision/search/session_work.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <string>

namespace trocar::collision {
namespace {

/// Lists are made for one pair of clusters in so many a step, and a few more: the start-up cost of a session is spread over steps, while it
/// is measured whether it pays.
constexpr std::size_t kListShare = 6, kFewestLists = 64;
/// One cluster in so many must keep its shape.
constexpr std::size_t kCalmShare = 4;

Error bad_value(std::string message) { return {.code = ErrorCode::BadValue, .message = std::move(message)}; }

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
    for (SurfaceIndex s = 0; s < surfaces.size(); ++s) {
        triangles_.push_back(surfaces[s]->triangles);
        last_.emplace_back(positions[s].begin(), positions[s].end()); // until a step has ended: plain steps may go before it
        add_parts(s, *surfaces[s], positions[s], parts_);
    }
    build_trees(parts_, positions, options.tree);
    volumes_.build(parts_);
    shapes_.build(parts_);
    features_.build(parts_, shapes_.view());
    sides_.build(parts_, shapes_.view());
    lengths_ = SessionLength(options.skipping ? options.session_length : 1);
    choice_ = SessionChoice(options.falls_back && options.skipping);
    if (choice_.falls_back()) {
        SearchOptions plain;
        static_cast<PairOptions&>(plain) = options;
        plain.between = options.between;
        plain.within = options.within;
        plain.tree = options.tree;
        plain_.build(surfaces, positions, plain);
    }
    drifts_.resize(volumes_.cluster_count());
    strays_.resize(volumes_.cluster_count());
    predicted_.resize(volumes_.cluster_count());
    dangling_.assign(volumes_.cluster_count(), 0);
    no_trees_.resize(surfaces.size());
    for (SurfaceIndex a = 0; a < surfaces.size(); ++a)
        for (SurfaceIndex b = 0; b < surfaces.size(); ++b) jobs_.push_back({a, b, {}});
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

Result<void> CoherentSearch::start_step(std::span<const SurfaceMotion> motions) {
    if (auto checked = check(motions); !checked) return checked;
    motions_.assign(motions.begin(), motions.end());
    drifts_found_ = 0;
    plain_step_ = choice_.wants_plain();
    if (!plain_step_) find_drifts_of_step();
    plain_step_ = plain_step_ || (choice_.falls_back() && !is_calm());
    if (plain_step_) { // what is kept stays as it is: the next step with it begins with a jump
        ++plain_steps_;
        plain_.refit(motions);
        return {};
    }
    std::fill(dangling_.begin(), dangling_.end(), std::uint8_t{0});
    bool jumps = false;
    for (std::size_t s = 0; s < motions.size() && has_last_; ++s) jumps = jumps || !same_bits(motions[s].t0, last_[s]);
    if (jumps || plain_steps_ > 0) {
        jump();
        find_drifts_of_step();
    }
    plain_steps_ = 0;
    for (std::size_t s = 0; s < motions.size(); ++s) std::copy(motions[s].t1.begin(), motions[s].t1.end(), last_[s].begin());
    has_last_ = true;
    return {};
}

/// Do so many clusters keep their shapes that lists could serve for a step? Where few do, nothing that is kept will last.
bool CoherentSearch::is_calm() const noexcept {
    std::size_t calm = 0;
    for (std::size_t p = 0; p < parts_.size(); ++p) {
        const double most = 0.5 * options_.reach * parts_[p].edge_length;
        for (Index c = volumes_.first_cluster(p); c < volumes_.first_cluster(p + 1); ++c)
            calm += std::min(drifts_[c].spread, drifts_[c].residual) <= most;
    }
    return calm * kCalmShare >= volumes_.cluster_count();
}

/// Of this step, but for its candidates: all vertices and clusters are refitted, and neighbours always come near.
double CoherentSearch::least_plain_work() const noexcept {
    double vertices = 0.0;
    for (const auto& of_surface : last_) vertices += static_cast<double>(of_surface.size());
    return work::kRefitVertex * vertices + work::kRefitCluster * volumes_.cluster_count() +
           (options_.within ? work::kNeighbours * static_cast<double>(sides_.neighbour_pairs()) : 0.0);
}

ClusterPlace CoherentSearch::place_of(Index cluster) const noexcept {
    const std::size_t part = volumes_.part_of(cluster);
    return {part, cluster - volumes_.first_cluster(part)};
}

void CoherentSearch::find_candidates() {
    stats_ = {};
    coherence_ = {};
    work_ = 0.0;
    if (!plain_step_) find_coherently();
    if (plain_step_) find_plainly(); // or where the traversal was given up
    coherence_.work = work_;
}

double CoherentSearch::plain_work(const ContactSearch& search) const noexcept {
    const ExactStats& stats = search.stats();
    const double pairs = static_cast<double>(stats.cluster_pairs);
    const double neighbours = options_.within ? std::min(pairs, static_cast<double>(sides_.neighbour_pairs())) : 0.0;
    double work = work::kBoxTest * static_cast<double>(stats.box_tests) + work::kNeighbours * neighbours +
                  work::kClusterPair * (pairs - neighbours) +
                  work::kElementaryTest * static_cast<double>(stats.candidates_vf + stats.candidates_ee);
    for (const DopTree& tree : search.trees())
        if (!tree.empty())
            work += work::kRefitVertex * static_cast<double>(tree.topology().vertex_count()) +
                    work::kRefitCluster * static_cast<double>(tree.clusters().size());
    return work;
}

void CoherentSearch::find_plainly() {
    plain_.find_candidates();
    stats_ = plain_.stats();
    coherence_ = {.plain = true};
    const double work = plain_work(plain_);
    choice_.note_plain(work);
    work_ += work;
}

void CoherentSearch::find_coherently() {
    for (Job& job : jobs_) job.candidates.clear();
    features_.start_step();
    sides_.start_step(motions_);
    const std::uint64_t tests_before = volumes_.box_tests();
    if (!(session_step_ >= length_ ? start_session() : continue_session())) {
        pairs_.clear();
        session_step_ = length_; // the next one begins anew
        plain_step_ = true;
        plain_.refit(motions_);
        work_ += work::kBoxTest * static_cast<double>(volumes_.box_tests() - tests_before);
        choice_.note_lost(work_);
        return;
    }
    lists_left_ = choice_.falls_back() ? kFewestLists + pairs_.all().size() / kListShare : SIZE_MAX;
    for (KeptClusters& kept : pairs_.all()) {
        const double drift = drift_on(kept);
        kept.steps += kept.steps < UINT16_MAX;
        if (drift <= kept.wake)
            kept.drift = drift;
        else
            look_at(kept);
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
    const double session = work::kBoxTest * static_cast<double>(stats_.box_tests) +
                           work::kNewPair * static_cast<double>(coherence_.began_session ? coherence_.kept_clusters : 0) +
                           work::kWaitingPair * static_cast<double>(coherence_.kept_clusters);
    lengths_.note_step(static_cast<std::uint64_t>(session + work::kGap * static_cast<double>(coherence_.gaps)));
    const double tests = work::kElementaryTest * static_cast<double>(stats_.candidates_vf + stats_.candidates_ee);
    for (const SurfacePart& part : parts_) work_ += drifts_found_ * work::kDriftVertex * static_cast<double>(part.touched.size());
    work_ += work::kClusterBox * static_cast<double>(features_.boxes_made()) +
             work::kClusterBlocks * static_cast<double>(features_.blocks_made()) +
             work::kClusterHull * static_cast<double>(sides_.hulls_made());
    work_ += session + tests + (coherence_.began_session ? work::kVolume * volumes_.cluster_count() : 0.0);
    choice_.note_session(work_, least_plain_work() + tests);
}

void CoherentSearch::decide(std::vector<SearchContact>& contacts) {
    if (plain_step_) {
        plain_.decide(contacts);
        stats_ = plain_.stats();
        return;
    }
    contacts.clear();
    for (Job& job : jobs_) {
        if (job.candidates.size() == 0) continue;
        const SurfacePair pair({Thing::body(job.a), &no_trees_[job.a], motions_[job.a]}, {Thing::body(job.b), &no_trees_[job.b], motions_[job.b]},
                               options_);
        pair.decide(job.candidates, contacts, stats_);
    }
    std::sort(contacts.begin(), contacts.end(), comes_before);
}

std::size_t CoherentSearch::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    std::size_t sum = volumes_.memory() + features_.memory() + shapes_.memory() + sides_.memory() + pairs_.memory() + bytes(drifts_) +
                      bytes(strays_) + bytes(predicted_) + bytes(found_) + bytes(list_);
    for (const SurfacePart& part : parts_) sum += part.memory();
    for (const DopTree& tree : plain_.trees()) sum += tree.memory();
    for (const auto& list : last_) sum += bytes(list);
    for (const auto& list : triangles_) sum += bytes(list);
    const auto lists = [&](const CandidateLists& of) { return bytes(of.vertex_face) + bytes(of.face_vertex) + bytes(of.edge_edge); };
    sum += lists(collected_) + bytes(asked_) + bytes(asked_at_) + bytes(bounds_);
    for (const Job& job : jobs_) sum += lists(job.candidates);
    return sum;
}

} // namespace trocar::collision
