#include "collision/search/session_features.hpp"

#include "collision/clones.hpp"
#include "collision/lanes.hpp"
#include "collision/swept_box.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

constexpr std::size_t kBlock = DopTree::kLanes;
constexpr std::size_t kRow = 6;                                                             // lo, then minus_hi
constexpr std::size_t kMostPairs = 9 * DopTree::kMaxClusterSize * DopTree::kMaxClusterSize; // all edges of two clusters

bool boxes_near(const std::array<float, 6>& a, const std::array<float, 6>& b, float reach) noexcept {
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (a[axis] + b[axis + 3] > reach || a[axis + 3] + b[axis] > reach) return false;
    return true;
}

Float4 load_four(const float* from) noexcept {
    Float4 four;
    std::memcpy(&four, from, sizeof four);
    return four;
}

using FloatLanes = float __attribute__((vector_size(4 * kLanes)));

/// round_down, lane by lane.
TROCAR_LANES_INLINE FloatLanes round_down(Lanes x) noexcept {
    return __builtin_convertvector(x - 0x1p-23 * magnitude(x) - 0x1p-148, FloatLanes);
}

/// The boxes of some vertices, four at a time, and the one around all: make_swept_box's numbers.
/// groups   their shape        end_row   3 for boxes over the step, 0 for boxes at its start        places   of the rows
TROCAR_CLONES
void box_vertices(std::span<const double> groups, std::size_t end_row, std::span<const Index> places, std::span<float> rows,
                  std::array<float, kRow>& all_of_them) noexcept {
    std::array<float, kRow> joined;
    joined.fill(SweptBox::kNothing);
    for (std::size_t first = 0; first < places.size(); first += kLanes) {
        const std::size_t count = std::min<std::size_t>(kLanes, places.size() - first);
        const double* from = groups.data() + first / kLanes * kShapeGroup;
        Lanes start[3], end[3];
        for (std::size_t axis = 0; axis < 3; ++axis) {
            start[axis] = load_lanes(from + axis * kLanes);
            end[axis] = load_lanes(from + (axis + end_row) * kLanes);
        }
        FloatLanes row[kRow];
        Mask fits = {-1, -1, -1, -1};
        for (std::size_t axis = 0; axis < 3; ++axis) {
            const Mask rises = start[axis] < end[axis];
            row[axis] = round_down(rises ? start[axis] : end[axis]);
            row[axis + 3] = round_down(rises ? -end[axis] : -start[axis]);
            fits &= (magnitude(start[axis]) <= kLargestCoordinate) & (magnitude(end[axis]) <= kLargestCoordinate);
        }
        float numbers[kRow][kLanes];
        for (std::size_t r = 0; r < kRow; ++r)
            for (int lane = 0; lane < kLanes; ++lane) {
                numbers[r][lane] = fits[lane] != 0 ? row[r][lane] : -SweptBox::kNothing;
                joined[r] = numbers[r][lane] < joined[r] ? numbers[r][lane] : joined[r];
            }
        for (std::size_t k = 0; k < count; ++k)
            for (std::size_t r = 0; r < kRow; ++r) rows[places[first + k] * kRow + r] = numbers[r][k];
    }
    all_of_them = joined;
}

} // namespace

void SessionFeatures::build(std::span<const SurfacePart> parts, const ShapeView& shapes) {
    parts_ = parts;
    shapes_ = shapes;
    step_ = 0;
    found_.resize(kMostPairs);
    boxes_.assign(parts.size(), {});
    local_.assign(parts.size(), {});
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const SurfacePart& part = parts[p];
        std::size_t blocks = 0;
        for (const DopTree::Cluster& c : part.tree.clusters())
            blocks = std::max({blocks, std::size_t{c.faces.end}, std::size_t{c.edges.end}, std::size_t{c.vertices.end}});
        for (Boxes& boxes : boxes_[p].at) {
            boxes.vertices.assign(part.vertex_of.size() * kRow, SweptBox::kNothing);
            boxes.blocks.assign(blocks * kRow * kBlock, SweptBox::kNothing);
            boxes.clusters.resize(part.tree.clusters().size());
            boxes.boxed.assign(part.tree.clusters().size(), 0);
            boxes.filled.assign(part.tree.clusters().size(), 0);
        }
        for (const Index v : part.touched)
            local_[p].push_back(
                static_cast<Index>(std::lower_bound(part.vertex_of.begin(), part.vertex_of.end(), v) - part.vertex_of.begin()));
    }
}

void SessionFeatures::start_step() noexcept {
    ++step_;
    boxes_made_ = blocks_made_ = 0;
}

void SessionFeatures::fill_vertices(ClusterPlace place, BoxTime time, Boxes& boxes) const noexcept {
    const SurfacePart& part = parts_[place.part];
    const auto places = std::span(local_[place.part]).subspan(part.touched_begin[place.cluster], part.touched_by(place.cluster).size());
    box_vertices(shapes_.of(place), time == BoxTime::Start ? 0 : 3, places, boxes.vertices, boxes.clusters[place.cluster]);
}

template <std::size_t Corners>
void SessionFeatures::fill_blocks(const DopTree& tree, const DopTree::BlockRange& range, Boxes& boxes) const noexcept {
    for (Index i = 0; i < range.count; ++i) {
        const std::size_t block = range.begin + i / kBlock, lane = i % kBlock;
        const Index* corner = tree.block_corners(static_cast<Index>(block)) + lane;
        const auto row_of = [&](std::size_t k) { return boxes.vertices.data() + corner[k * kBlock] * kRow; };
        Float4 head = load_four(row_of(0)), tail = load_four(row_of(0) + 2); // a row of six
        for (std::size_t k = 1; k < Corners; ++k) {
            const Float4 other_head = load_four(row_of(k)), other_tail = load_four(row_of(k) + 2);
            head = other_head < head ? other_head : head;
            tail = other_tail < tail ? other_tail : tail;
        }
        float* out = boxes.blocks.data() + block * kRow * kBlock + lane;
        for (std::size_t r = 0; r < 4; ++r) out[r * kBlock] = head[static_cast<int>(r)];
        for (std::size_t r = 4; r < kRow; ++r) out[r * kBlock] = tail[static_cast<int>(r - 2)];
    }
}

const std::array<float, SessionFeatures::kRow>& SessionFeatures::box_of(ClusterPlace place, BoxTime time) noexcept {
    Boxes& boxes = boxes_[place.part].at[static_cast<std::size_t>(time)];
    if (boxes.boxed[place.cluster] == step_) return boxes.clusters[place.cluster];
    fill_vertices(place, time, boxes);
    boxes.boxed[place.cluster] = step_;
    ++boxes_made_;
    return boxes.clusters[place.cluster];
}

const SessionFeatures::Boxes& SessionFeatures::fill(ClusterPlace place, BoxTime time) noexcept {
    Boxes& boxes = boxes_[place.part].at[static_cast<std::size_t>(time)];
    if (boxes.filled[place.cluster] == step_) return boxes;
    static_cast<void>(box_of(place, time));
    boxes.filled[place.cluster] = step_;
    ++blocks_made_;
    const DopTree& tree = parts_[place.part].tree;
    const DopTree::Cluster& cluster = tree.clusters()[place.cluster];
    fill_blocks<3>(tree, cluster.faces, boxes);
    fill_blocks<2>(tree, cluster.edges, boxes);
    fill_blocks<1>(tree, cluster.vertices, boxes);
    return boxes;
}

/// Floats hold the boxes outwards, so their gap, computed in doubles without error but the last root, is not above the true one.
SessionFeatures::Gap SessionFeatures::gap_at_start(ClusterPlace a, ClusterPlace b) noexcept {
    const auto &box_a = box_of(a, BoxTime::Start), &box_b = box_of(b, BoxTime::Start);
    Gap gap;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double ab = static_cast<double>(box_a[axis]) + box_b[axis + 3], ba = static_cast<double>(box_b[axis]) + box_a[axis + 3];
        gap.side[static_cast<Eigen::Index>(axis)] = ba > 0.0 ? ba : ab > 0.0 ? -ab : 0.0;
    }
    const double length = gap.side.norm();
    if (!(length > 0.0 && length < kLargestCoordinate)) return {length > 0.0 ? kLargestCoordinate : 0.0, Vec3::Zero()};
    gap.side /= length;
    gap.distance = length * (1.0 - 0x1p-40);
    return gap;
}

void SessionFeatures::append(const SurfacePart& a, const SurfacePart& b, PairKind kind, std::size_t count,
                             std::vector<FeaturePair>& out) const {
    const bool edges = kind == PairKind::EdgeEdge, within = a.surface == b.surface;
    const std::vector<Index>&of_a = edges ? a.edge_of : a.vertex_of, &of_b = edges ? b.edge_of : b.face_of;
    for (std::size_t i = 0; i < count; ++i) {
        FeaturePair pair{of_a[found_[i].a], of_b[found_[i].b]};
        if (edges && within && pair.b < pair.a) std::swap(pair.a, pair.b);
        out.push_back(pair);
    }
}

void SessionFeatures::collect(ClusterPlace a, ClusterPlace b, BoxTime time, double reach, bool simd, CandidateLists& out) noexcept {
    const float limit = round_up(reach);
    if (!boxes_near(box_of(a, time), box_of(b, time), limit)) return;
    const Boxes &boxes_a = fill(a, time), &boxes_b = fill(b, time);
    const SurfacePart &part_a = parts_[a.part], &part_b = parts_[b.part];
    const DopTree::Cluster &cluster_a = part_a.tree.clusters()[a.cluster], &cluster_b = part_b.tree.clusters()[b.cluster];
    const std::array<float, 3> distance{limit, limit, limit};
    const bool same_part = a.part == b.part, same = same_part && a.cluster == b.cluster;
    const auto run_of = [](const SurfacePart& part, const Boxes& boxes, const DopTree::BlockRange& range, int corners) -> BlockRun {
        if (range.count == 0) return {};
        return {boxes.blocks.data() + range.begin * kRow * kBlock, part.tree.block_ids(range.begin), part.tree.block_corners(range.begin),
                range.count, corners};
    };
    const auto find = [&](const BlockRun& run_a, const BlockRun& run_b, bool swapped, bool same_run) -> std::size_t {
        if (run_a.count == 0 || run_b.count == 0) return 0;
        const float *box_a = boxes_a.clusters[a.cluster].data(), *box_b = boxes_b.clusters[b.cluster].data();
        const NearTest test{.slabs = 3,
                            .distance = distance.data(),
                            .box_a = swapped ? box_b : box_a,
                            .box_b = swapped ? box_a : box_b,
                            .skip_shared = same_part,
                            .same_run = same_run};
        return simd ? near_pairs(run_a, run_b, test, found_.data()) : near_pairs_plain(run_a, run_b, test, found_.data());
    };
    const bool within = part_a.surface == part_b.surface;
    append(part_a, part_b, PairKind::VertexFace,
           find(run_of(part_a, boxes_a, cluster_a.vertices, 1), run_of(part_b, boxes_b, cluster_b.faces, 3), false, false),
           out.vertex_face);
    append(part_a, part_b, PairKind::EdgeEdge,
           find(run_of(part_a, boxes_a, cluster_a.edges, 2), run_of(part_b, boxes_b, cluster_b.edges, 2), false, same), out.edge_edge);
    if (same) return;
    append(part_b, part_a, PairKind::VertexFace,
           find(run_of(part_b, boxes_b, cluster_b.vertices, 1), run_of(part_a, boxes_a, cluster_a.faces, 3), true, false),
           within ? out.vertex_face : out.face_vertex);
}

std::size_t SessionFeatures::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    std::size_t sum = bytes(found_);
    for (const PartBoxes& part : boxes_)
        for (const Boxes& boxes : part.at)
            sum += bytes(boxes.vertices) + bytes(boxes.blocks) + bytes(boxes.clusters) + bytes(boxes.boxed) + bytes(boxes.filled);
    for (const auto& list : local_) sum += bytes(list);
    return sum;
}

} // namespace trocar::collision
