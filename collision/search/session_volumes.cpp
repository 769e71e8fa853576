#include "collision/search/session_volumes.hpp"

#include "collision/search/session_work.hpp"

#include "collision/swept_box.hpp"

#include <algorithm>

namespace trocar::collision {
namespace {

bool is_leaf(Index node) noexcept { return (node & DopTree::kLeafBit) != 0; }
Index cluster_of(Index leaf) noexcept { return leaf & ~DopTree::kLeafBit; }

/// Parents come before children, so the last node is a last child.
Index count_nodes(const DopTree& tree) {
    if (is_leaf(tree.root())) return 0;
    Index last = tree.root();
    for (Index node = 0; node <= last; ++node)
        for (const Index child : tree.children(node))
            if (child != DopTree::kNoChild && !is_leaf(child)) last = std::max(last, child);
    return last + 1;
}

/// Bit i: child i is not farther than reach along every axis, at the start or at the end. If one gap is wider than that at both
/// ends it is so between them, for both boxes move on straight lines.
template <std::size_t Arity>
std::uint32_t near_moving(const float* box, std::size_t stride, const float* rows, float reach) noexcept {
    std::array<int, Arity> apart{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const float lo0 = box[axis * stride], hi0 = box[(axis + 3) * stride], lo1 = box[(axis + 6) * stride],
                    hi1 = box[(axis + 9) * stride];
        const float *other_lo0 = rows + axis * Arity, *other_hi0 = other_lo0 + 3 * Arity, *other_lo1 = other_lo0 + 6 * Arity,
                    *other_hi1 = other_lo0 + 9 * Arity;
        for (std::size_t i = 0; i < Arity; ++i) {
            apart[i] |= static_cast<int>(lo0 + other_hi0[i] > reach) & static_cast<int>(lo1 + other_hi1[i] > reach);
            apart[i] |= static_cast<int>(hi0 + other_lo0[i] > reach) & static_cast<int>(hi1 + other_lo1[i] > reach);
        }
    }
    std::uint32_t near = 0;
    for (std::size_t i = 0; i < Arity; ++i) near |= static_cast<std::uint32_t>(apart[i] == 0) << i;
    return near;
}

} // namespace

void SessionVolumes::build(std::span<const SurfacePart> parts) {
    parts_ = parts;
    arity_ = parts.empty() ? 8 : parts[0].tree.options().arity;
    first_cluster_.assign(1, 0);
    first_node_.assign(1, 0);
    part_of_.clear();
    for (std::size_t p = 0; p < parts.size(); ++p) {
        const DopTree& tree = parts[p].tree;
        part_of_.insert(part_of_.end(), tree.clusters().size(), static_cast<Index>(p));
        first_cluster_.push_back(first_cluster_.back() + static_cast<Index>(tree.clusters().size()));
        first_node_.push_back(first_node_.back() + count_nodes(tree));
    }
    cluster_rows_.assign(cluster_count() * kRows, SweptBox::kNothing);
    node_rows_.assign(first_node_.back() * kRows * arity_, SweptBox::kNothing);
    marked_clusters_.assign(cluster_count(), 1);
    marked_nodes_.assign(first_node_.back(), 1);
    box_tests_ = 0;
}

/// Rounding of the box's ends: each coordinate sum is off by a few 2^-53 of its terms, and round_down takes 2^-23 of the result;
/// 2^-40 of the terms, which may cancel in the result, come on top.
void SessionVolumes::set_volume(Index cluster, std::span<const Vec3> positions, const PredictedMotion& motion, double begin,
                                double length) noexcept {
    const std::size_t p = part_of_[cluster];
    const auto touched = parts_[p].touched_by(cluster - first_cluster_[p]);
    Vec3 lo = positions[touched[0]], hi = lo;
    for (const Index v : touched) {
        lo = lo.cwiseMin(positions[v]);
        hi = hi.cwiseMax(positions[v]);
    }
    float* rows = cluster_rows_.data() + cluster * kRows;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto k = static_cast<Eigen::Index>(axis);
        const double back = begin * motion.speed[k], ahead = (length - begin) * motion.speed[k];
        const double size = std::max(std::abs(lo[k]), std::abs(hi[k])) + std::abs(back) + std::abs(ahead) + motion.inflation;
        const double inflation = motion.inflation * kDriftRounding + 0x1p-40 * size;
        const bool fits = size <= kLargestCoordinate; // NaN does not
        rows[axis] = fits ? round_down(lo[k] - back - inflation) : -SweptBox::kNothing;
        rows[axis + 3] = fits ? round_down(-hi[k] + back - inflation) : -SweptBox::kNothing;
        rows[axis + 6] = fits ? round_down(lo[k] + ahead - inflation) : -SweptBox::kNothing;
        rows[axis + 9] = fits ? round_down(-hi[k] - ahead - inflation) : -SweptBox::kNothing;
    }
}

void SessionVolumes::refit_nodes() noexcept {
    for (std::size_t p = 0; p < parts_.size(); ++p) {
        const DopTree& tree = parts_[p].tree;
        for (Index node = node_count(p); node-- > 0;) {
            const auto children = tree.children(node);
            float* out = node_rows_.data() + (first_node_[p] + node) * kRows * arity_;
            for (std::size_t i = 0; i < arity_ && children[i] != DopTree::kNoChild; ++i)
                for (std::size_t r = 0; r < kRows; ++r) {
                    if (is_leaf(children[i])) {
                        out[r * arity_ + i] = cluster_rows(first_cluster_[p] + cluster_of(children[i]))[r];
                        continue;
                    }
                    const float* row = node_rows(p, children[i]) + r * arity_;
                    out[r * arity_ + i] = *std::min_element(row, row + arity_);
                }
        }
    }
}

std::uint32_t SessionVolumes::near(const float* box, std::size_t stride, std::size_t part, Index node, float reach) noexcept {
    ++box_tests_;
    const float* rows = node_rows(part, node);
    if (arity_ == 8) return near_moving<8>(box, stride, rows, reach);
    if (arity_ == 4) return near_moving<4>(box, stride, rows, reach);
    return near_moving<2>(box, stride, rows, reach);
}

bool SessionVolumes::is_marked(std::size_t part, Index node) const noexcept {
    if (all_marked_) return true;
    return is_leaf(node) ? marked_clusters_[first_cluster_[part] + cluster_of(node)] != 0 : marked_nodes_[first_node_[part] + node] != 0;
}

void SessionVolumes::mark_nodes(std::span<const std::uint8_t> marked) {
    all_marked_ = marked.empty();
    if (all_marked_) return;
    std::copy(marked.begin(), marked.end(), marked_clusters_.begin());
    for (std::size_t p = 0; p < parts_.size(); ++p) {
        const DopTree& tree = parts_[p].tree;
        for (Index node = node_count(p); node-- > 0;) {
            std::uint8_t any = 0;
            for (const Index child : tree.children(node))
                if (child != DopTree::kNoChild) any |= static_cast<std::uint8_t>(is_marked(p, child));
            marked_nodes_[first_node_[p] + node] = any;
        }
    }
}

void SessionVolumes::push(std::size_t p, std::size_t q, NodePair at, std::vector<SessionPair>& out) {
    if (!is_marked(p, at.a) && !is_marked(q, at.b)) return;
    if (!is_leaf(at.a) || !is_leaf(at.b)) return stack_.push_back(at);
    const Index a = first_cluster_[p] + cluster_of(at.a), b = first_cluster_[q] + cluster_of(at.b);
    out.push_back({std::min(a, b), std::max(a, b)});
}

/// Children of a node against a leaf, or of two nodes against each other.
void SessionVolumes::open(std::size_t p, std::size_t q, NodePair at, float reach, std::vector<SessionPair>& out) {
    if (is_leaf(at.a) || is_leaf(at.b)) {
        const bool a_is_leaf = is_leaf(at.a);
        const std::size_t leaf_part = a_is_leaf ? p : q, node_part = a_is_leaf ? q : p;
        const Index leaf = a_is_leaf ? at.a : at.b, node = a_is_leaf ? at.b : at.a;
        const auto children = parts_[node_part].tree.children(node);
        const float* box = cluster_rows(first_cluster_[leaf_part] + cluster_of(leaf));
        for (std::uint32_t hits = near(box, 1, node_part, node, reach); hits != 0; hits &= hits - 1) {
            const Index child = children[static_cast<std::size_t>(__builtin_ctz(hits))];
            if (child != DopTree::kNoChild) push(p, q, a_is_leaf ? NodePair{leaf, child} : NodePair{child, leaf}, out);
        }
        return;
    }
    const auto children_a = parts_[p].tree.children(at.a), children_b = parts_[q].tree.children(at.b);
    for (std::size_t i = 0; i < arity_ && children_a[i] != DopTree::kNoChild; ++i) {
        std::uint32_t hits = near(node_rows(p, at.a) + i, arity_, q, at.b, reach);
        if (p == q && at.a == at.b) hits = (hits | 1u << i) & ~((1u << i) - 1u); // each pair once, and each child with itself
        for (; hits != 0; hits &= hits - 1) {
            const Index child = children_b[static_cast<std::size_t>(__builtin_ctz(hits))];
            if (child != DopTree::kNoChild) push(p, q, {children_a[i], child}, out);
        }
    }
}

bool SessionVolumes::traverse(double reach, bool within, bool between, std::span<const std::uint8_t> marked, double most_work,
                              std::vector<SessionPair>& out) {
    mark_nodes(marked);
    const std::uint64_t before = box_tests_;
    const std::size_t found_before = out.size();
    const auto work = [&] {
        return work::kBoxTest * static_cast<double>(box_tests_ - before) + work::kNewPair * static_cast<double>(out.size() - found_before);
    };
    const float limit = round_up(reach);
    for (std::size_t p = 0; p < parts_.size(); ++p)
        for (std::size_t q = p; q < parts_.size(); ++q) {
            if (!(parts_[p].surface == parts_[q].surface ? within : between)) continue;
            stack_.clear();
            push(p, q, {parts_[p].tree.root(), parts_[q].tree.root()}, out);
            while (!stack_.empty()) {
                if (work() > most_work) return false;
                const NodePair at = stack_.back();
                stack_.pop_back();
                open(p, q, at, limit, out);
            }
        }
    return true;
}

void SessionVolumes::traverse_alone(Index cluster, double reach, bool within, bool between, std::vector<SessionPair>& out) {
    all_marked_ = true;
    const std::size_t p = part_of_[cluster];
    const float limit = round_up(reach);
    for (std::size_t q = 0; q < parts_.size(); ++q) {
        if (!(parts_[p].surface == parts_[q].surface ? within : between)) continue;
        stack_.clear();
        push(p, q, {(cluster - first_cluster_[p]) | DopTree::kLeafBit, parts_[q].tree.root()}, out);
        while (!stack_.empty()) {
            const NodePair at = stack_.back();
            stack_.pop_back();
            open(p, q, at, limit, out);
        }
    }
}

std::size_t SessionVolumes::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return bytes(part_of_) + bytes(cluster_rows_) + bytes(node_rows_) + bytes(marked_clusters_) + bytes(marked_nodes_) + bytes(stack_);
}

} // namespace trocar::collision
