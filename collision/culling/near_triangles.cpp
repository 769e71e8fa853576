#include "collision/culling/near_triangles.hpp"

#include "collision/culling/chromatic_sets.hpp"

namespace trocar::collision {
namespace {

float size_of(const SweptBox& box) noexcept {
    const Float4 minus_size = box.lo + box.minus_hi;
    return -(minus_size[0] + minus_size[1] + minus_size[2]);
}

/// Those triangles of a cluster that come near a box, by their place in the cluster.
struct NearOnes {
    std::array<std::uint8_t, BoxTree::kClusterSize> ids;
    std::size_t count = 0;
    NearOnes(std::span<const SweptBox> boxes, const SweptBox& other, float distance) noexcept {
        for (std::size_t k = 0; k < boxes.size(); ++k) {
            ids[count] = static_cast<std::uint8_t>(k);
            count += are_near(boxes[k], other, distance);
        }
    }
    [[nodiscard]] std::span<const std::uint8_t> all() const noexcept { return std::span(ids).first(count); }
};

} // namespace

template <class Visit>
void NearTriangles::traverse(BoxTree& a, BoxTree& b, bool self, float distance, Visit&& visit) {
    box_tests_ = 0;
    if (a.empty() || b.empty()) return;
    const auto nodes_a = a.nodes(), nodes_b = b.nodes();
    stack_.assign(1, {0, 0});
    while (!stack_.empty()) {
        const TrianglePair pair = stack_.back();
        stack_.pop_back();
        const BoxTree::Node &na = nodes_a[pair.a], &nb = nodes_b[pair.b];
        ++box_tests_;
        if (!are_near(na.box, nb.box, distance)) continue;
        const bool a_is_leaf = na.left == kNoIndex, b_is_leaf = nb.left == kNoIndex;
        if (a_is_leaf && b_is_leaf) {
            const auto boxes_a = a.feature_boxes(na.cluster).triangles, boxes_b = b.feature_boxes(nb.cluster).triangles;
            const auto ids_a = a.triangle_ids().subspan(a.clusters()[na.cluster].triangles.begin);
            const auto ids_b = b.triangle_ids().subspan(b.clusters()[nb.cluster].triangles.begin);
            const bool same = self && pair.a == pair.b;
            const NearOnes near_a(boxes_a, nb.box, distance), near_b(boxes_b, na.box, distance);
            box_tests_ += boxes_a.size() + boxes_b.size() + near_a.count * near_b.count;
            for (const std::size_t i : near_a.all())
                for (const std::size_t k : near_b.all())
                    if (!(same && k <= i) && are_near(boxes_a[i], boxes_b[k], distance)) visit(ids_a[i], ids_b[k]);
        } else if (self && pair.a == pair.b) {
            stack_.push_back({na.left + 1, na.left + 1});
            stack_.push_back({na.left, na.left + 1});
            stack_.push_back({na.left, na.left});
        } else if (b_is_leaf || (!a_is_leaf && size_of(na.box) >= size_of(nb.box))) {
            stack_.push_back({na.left + 1, pair.b});
            stack_.push_back({na.left, pair.b});
        } else {
            stack_.push_back({pair.a, nb.left + 1});
            stack_.push_back({pair.a, nb.left});
        }
    }
}

void NearTriangles::find_self(BoxTree& tree, float distance, std::vector<TrianglePair>& pairs, std::vector<TrianglePair>* adjacent) {
    const auto& triangles = tree.topology().triangles;
    traverse(tree, tree, true, distance, [&](Index a, Index b) {
        const TrianglePair pair = a < b ? TrianglePair{a, b} : TrianglePair{b, a};
        if (!are_adjacent(triangles[a], triangles[b])) {
            pairs.push_back(pair);
        } else if (adjacent != nullptr) {
            adjacent->push_back(pair);
        }
    });
}

void NearTriangles::find(BoxTree& a, BoxTree& b, float distance, std::vector<TrianglePair>& pairs) {
    traverse(a, b, false, distance, [&](Index ta, Index tb) { pairs.push_back({ta, tb}); });
}

} // namespace trocar::collision
