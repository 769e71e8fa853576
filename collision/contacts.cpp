#include "collision/contacts.hpp"

#include <algorithm>

namespace seldinger::collision {
namespace {

bool holds(const Triangle& t, Index vertex) noexcept { return t[0] == vertex || t[1] == vertex || t[2] == vertex; }
bool share_vertex(const Edge& a, const Edge& b) noexcept { return a[0] == b[0] || a[0] == b[1] || a[1] == b[0] || a[1] == b[1]; }

SweptPoint swept(const SurfaceMotion& motion, Index vertex) noexcept { return {motion.t0[vertex], motion.t1[vertex]}; }
std::array<SweptPoint, 2> swept(const SurfaceMotion& motion, const Edge& e) noexcept {
    return {swept(motion, e[0]), swept(motion, e[1])};
}
std::array<SweptPoint, 3> swept(const SurfaceMotion& motion, const Triangle& t) noexcept {
    return {swept(motion, t[0]), swept(motion, t[1]), swept(motion, t[2])};
}
Vec3 at(const SweptPoint& p, double t) noexcept { return (1.0 - t) * p.t0 + t * p.t1; }

/// Candidates wait until this many are there, so that the batches of the elementary tests are full and the lists stay in cache.
constexpr std::size_t kFullList = 512;
/// What one more pair of clusters can add to a list that is not full.
constexpr std::size_t kLongestList = kFullList + BoxTree::kClusterFeatures * BoxTree::kClusterFeatures + 1;

/// Sum of the three edges: which of two boxes to open first.
float size_of(const SweptBox& box) noexcept {
    const Float4 minus_size = box.lo + box.minus_hi;
    return -(minus_size[0] + minus_size[1] + minus_size[2]);
}

/// Which of one cluster's features come near the other cluster.
struct NearFeatures {
    std::array<std::uint8_t, BoxTree::kClusterFeatures> ids;
    std::size_t count = 0;

    NearFeatures(std::span<const SweptBox> boxes, const SweptBox& other, float distance) noexcept {
        for (std::size_t k = 0; k < boxes.size(); ++k) {
            ids[count] = static_cast<std::uint8_t>(k);
            count += are_near(boxes[k], other, distance); // no branch: half of them are, at random
        }
    }
    [[nodiscard]] std::span<const std::uint8_t> all() const noexcept { return std::span(ids).first(count); }
};

/// Appends those of up to `most` pairs that are kept, without a branch.
class PairWriter {
public:
    PairWriter(std::vector<FeaturePair>& pairs, std::size_t most) : pairs_(pairs), count_(pairs.size()) { pairs.resize(count_ + most + 1); }
    ~PairWriter() { pairs_.resize(count_); }
    PairWriter(const PairWriter&) = delete;
    PairWriter& operator=(const PairWriter&) = delete;
    void add(FeaturePair pair, bool kept) noexcept {
        pairs_[count_] = pair;
        count_ += kept;
    }

private:
    std::vector<FeaturePair>& pairs_;
    std::size_t count_;
};

} // namespace

struct ContactFinder::Search {
    Side a, b;
    const ExactOptions& options;
    WorkBudget& budget;
    std::vector<Contact>& out;
    bool self;
    float distance = round_up(options.limits.distance);
    ExactStats stats = {};

    void count(const Sweep& sweep, std::vector<double>& safe_times) {
        if (sweep.outcome == SweepOutcome::Unresolved) ++stats.unresolved;
        stats.safe_fraction = std::min(stats.safe_fraction, sweep.safe_time);
        safe_times.push_back(sweep.safe_time);
    }
};

ExactStats ContactFinder::find(const SurfaceMotion& a, BoxTree& tree_a, const SurfaceMotion& b, BoxTree& tree_b,
                               const ExactOptions& options, WorkBudget& budget, std::vector<Contact>& out) {
    Search search{{a, tree_a, options.body_a}, {b, tree_b, options.body_b}, options, budget, out, false};
    traverse(search);
    return search.stats;
}

ExactStats ContactFinder::find_self(const SurfaceMotion& a, BoxTree& tree_a, const ExactOptions& options, WorkBudget& budget,
                                    std::vector<Contact>& out) {
    Search search{{a, tree_a, options.body_a}, {a, tree_a, options.body_a}, options, budget, out, true};
    traverse(search);
    return search.stats;
}

/// Entries that every list of the search holds without growing.
static constexpr std::size_t kReserved = 16384;

void ContactFinder::traverse(Search& search) {
    stack_.reserve(kReserved);
    for (auto* pairs : {&vertex_face_, &face_vertex_, &edge_edge_}) pairs->reserve(kReserved);
    safe_times_.reserve(kReserved);
    sweeps_.reserve(kReserved);
    safe_times_.clear();
    stack_.clear();
    for (auto* list : {&vertex_face_, &face_vertex_, &edge_edge_}) {
        list->clear();
        list->reserve(kLongestList);
    }
    if (search.a.tree.empty() || search.b.tree.empty()) return;
    const auto nodes_a = search.a.tree.nodes(), nodes_b = search.b.tree.nodes();
    stack_.push_back({0, 0});
    while (!stack_.empty()) {
        const NodePair pair = stack_.back();
        stack_.pop_back();
        const BoxTree::Node &a = nodes_a[pair.a], &b = nodes_b[pair.b];
        ++search.stats.box_pairs;
        if (!are_near(a.box, b.box, search.distance)) continue;
        const bool a_is_leaf = a.left == kNoIndex, b_is_leaf = b.left == kNoIndex;
        if (a_is_leaf && b_is_leaf) {
            if (collect_candidates(search, a.cluster, b.cluster)) continue;
            search.stats.finished = false;
            break;
        }
        if (search.self && pair.a == pair.b) {
            stack_.push_back({a.left + 1, a.left + 1});
            stack_.push_back({a.left, a.left + 1});
            stack_.push_back({a.left, a.left});
        } else if (b_is_leaf || (!a_is_leaf && size_of(a.box) >= size_of(b.box))) {
            stack_.push_back({a.left + 1, pair.b});
            stack_.push_back({a.left, pair.b});
        } else {
            stack_.push_back({pair.a, b.left + 1});
            stack_.push_back({pair.a, b.left});
        }
    }
    test_candidates(search);
    if (!search.stats.finished) search.stats.safe_fraction = 0.0;
}

void ContactFinder::collect_vertex_face(const Search& search, const Side& vertex_side, Index vertex_cluster,
                                        const Side& face_side, Index face_cluster, std::vector<FeaturePair>& pairs) {
    const auto& vertices = vertex_side.tree.clusters()[vertex_cluster];
    const auto& faces = face_side.tree.clusters()[face_cluster];
    const auto vertex_boxes = vertex_side.tree.feature_boxes(vertex_cluster).vertices;
    const auto face_boxes = face_side.tree.feature_boxes(face_cluster).triangles;
    const NearFeatures near_vertices(vertex_boxes, face_side.tree.nodes()[faces.node].box, search.distance);
    if (near_vertices.count == 0) return;
    const NearFeatures near_faces(face_boxes, vertex_side.tree.nodes()[vertices.node].box, search.distance);
    const auto vertex_ids = vertex_side.tree.vertex_ids().subspan(vertices.vertices.begin);
    const auto face_ids = face_side.tree.triangle_ids().subspan(faces.triangles.begin);
    PairWriter writer(pairs, near_vertices.count * near_faces.count);
    for (const std::size_t k : near_faces.all())
        for (const std::size_t i : near_vertices.all()) {
            const bool near = are_near(vertex_boxes[i], face_boxes[k], search.distance);
            const bool adjacent = search.self && holds(face_side.tree.topology().triangles[face_ids[k]], vertex_ids[i]);
            writer.add({vertex_ids[i], face_ids[k]}, near && !adjacent);
        }
}

void ContactFinder::collect_edge_edge(const Search& search, Index cluster_a, Index cluster_b) {
    const auto& a = search.a.tree.clusters()[cluster_a];
    const auto& b = search.b.tree.clusters()[cluster_b];
    const auto boxes_a = search.a.tree.feature_boxes(cluster_a).edges;
    const auto boxes_b = search.b.tree.feature_boxes(cluster_b).edges;
    const NearFeatures near_a(boxes_a, search.b.tree.nodes()[b.node].box, search.distance);
    if (near_a.count == 0) return;
    const NearFeatures near_b(boxes_b, search.a.tree.nodes()[a.node].box, search.distance);
    const bool same_cluster = search.self && cluster_a == cluster_b;
    const auto ids_a = search.a.tree.edge_ids().subspan(a.edges.begin), ids_b = search.b.tree.edge_ids().subspan(b.edges.begin);
    const auto& edges = search.a.tree.topology().edges;
    PairWriter writer(edge_edge_, near_a.count * near_b.count);
    for (const std::size_t i : near_a.all())
        for (const std::size_t k : near_b.all()) {
            const bool near = are_near(boxes_a[i], boxes_b[k], search.distance);
            const bool skipped = search.self && ((same_cluster && k <= i) || share_vertex(edges[ids_a[i]], edges[ids_b[k]]));
            writer.add({ids_a[i], ids_b[k]}, near && !skipped);
        }
}

/// What a cluster pair adds is paid for at once; unpaid candidates are taken back.
bool ContactFinder::collect_candidates(Search& search, Index cluster_a, Index cluster_b) {
    const std::size_t before_vf = vertex_face_.size(), before_fv = face_vertex_.size(), before_ee = edge_edge_.size();
    collect_vertex_face(search, search.a, cluster_a, search.b, cluster_b, vertex_face_);
    if (!search.self || cluster_a != cluster_b) collect_vertex_face(search, search.b, cluster_b, search.a, cluster_a, face_vertex_);
    collect_edge_edge(search, cluster_a, cluster_b);
    const std::size_t added = vertex_face_.size() + face_vertex_.size() + edge_edge_.size() - before_vf - before_fv - before_ee;
    if (!search.budget.spend(1 + added)) {
        vertex_face_.resize(before_vf);
        face_vertex_.resize(before_fv);
        edge_edge_.resize(before_ee);
        return false;
    }
    ++search.stats.cluster_pairs;
    if (std::max({vertex_face_.size(), face_vertex_.size(), edge_edge_.size()}) >= kFullList) test_candidates(search);
    return true;
}

void ContactFinder::test_candidates(Search& search) {
    test_vertex_face(search, search.a, search.b, vertex_face_);
    test_vertex_face(search, search.b, search.a, face_vertex_);
    test_edge_edge(search);
}

void ContactFinder::test_vertex_face(Search& search, const Side& vertex_side, const Side& face_side, std::vector<FeaturePair>& pairs) {
    search.stats.candidates_vf += pairs.size();
    if (sweeps_.size() < pairs.size()) sweeps_.resize(pairs.size());
    sweep_vertex_faces(vertex_side.motion, face_side.motion, pairs, search.options.limits, sweeps_);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const Sweep& sweep = sweeps_[i];
        if (!sweep.hit()) continue;
        const auto [vertex, face] = pairs[i];
        const Triangle& t = face_side.tree.topology().triangles[face];
        const SweptPoint point = swept(vertex_side.motion, vertex);
        const auto corners = swept(face_side.motion, t);
        Contact contact{.body_a = vertex_side.body, .body_b = face_side.body, .origin = ContactOrigin::ExactVF};
        contact.time = sweep.time;
        contact.normal = sweep.normal;
        contact.feature_a[0] = vertex;
        contact.point = Vec3::Zero();
        Vec3 end = Vec3::Zero(); // where the face's nearest point goes
        for (int k = 0; k < 3; ++k) {
            contact.feature_b[k] = t[k];
            contact.bary_b[k] = sweep.bary[k];
            contact.point += sweep.bary[k] * at(corners[k], sweep.time);
            end += sweep.bary[k] * corners[k].t1;
        }
        contact.gap = sweep.normal.dot(point.t1 - end);
        ++search.stats.hits_vf;
        search.count(sweep, safe_times_);
        search.out.push_back(contact);
    }
    pairs.clear();
}

void ContactFinder::test_edge_edge(Search& search) {
    search.stats.candidates_ee += edge_edge_.size();
    if (sweeps_.size() < edge_edge_.size()) sweeps_.resize(edge_edge_.size());
    sweep_edge_edges(search.a.motion, search.b.motion, edge_edge_, search.options.limits, sweeps_);
    for (std::size_t i = 0; i < edge_edge_.size(); ++i) {
        const Sweep& sweep = sweeps_[i];
        if (!sweep.hit()) continue;
        const Edge &edge_a = search.a.tree.topology().edges[edge_edge_[i].a], &edge_b = search.b.tree.topology().edges[edge_edge_[i].b];
        const auto a = swept(search.a.motion, edge_a);
        const auto b = swept(search.b.motion, edge_b);
        Contact contact{.body_a = search.a.body, .body_b = search.b.body, .origin = ContactOrigin::ExactEE};
        contact.time = sweep.time;
        contact.normal = sweep.normal;
        contact.point = Vec3::Zero();
        contact.bary_b[2] = 0.0;
        Vec3 offset = Vec3::Zero(); // from b's nearest point to a's at t1
        for (int k = 0; k < 2; ++k) {
            contact.feature_a[k] = edge_a[k];
            contact.feature_b[k] = edge_b[k];
            contact.bary_a[k] = k == 0 ? 1.0 - sweep.bary[0] : sweep.bary[0];
            contact.bary_b[k] = k == 0 ? 1.0 - sweep.bary[1] : sweep.bary[1];
            contact.point += contact.bary_b[k] * at(b[k], sweep.time);
            offset += contact.bary_a[k] * a[k].t1 - contact.bary_b[k] * b[k].t1;
        }
        contact.gap = sweep.normal.dot(offset);
        ++search.stats.hits_ee;
        search.count(sweep, safe_times_);
        search.out.push_back(contact);
    }
    edge_edge_.clear();
}

} // namespace seldinger::collision
