#include "spheretree/hierarchy.hpp"

#include "base/box.hpp"

#include <algorithm>
#include <numeric>

namespace trocar::spheretree {

namespace {

using ItemRange = std::pair<Index, Index>; // [first, second) of SphereTree::items

Index add_sphere(SphereTree& tree, Index parent, std::uint8_t level, ItemRange range) {
    tree.spheres.emplace_back();
    tree.parent.push_back(parent);
    tree.first_child.push_back(kNoIndex);
    tree.child_count.push_back(0);
    tree.level.push_back(level);
    tree.item_begin.push_back(range.first);
    tree.item_end.push_back(range.second);
    return static_cast<Index>(tree.spheres.size() - 1);
}

Index split_point(std::span<const Vec3> centres, std::vector<Index>& items, ItemRange range) {
    Box3 box;
    for (Index i = range.first; i < range.second; ++i) box.add(centres[items[i]]);
    int axis = 0;
    box.extent().maxCoeff(&axis);
    std::sort(items.begin() + range.first, items.begin() + range.second,
              [&](Index a, Index b) { return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b; });
    return range.first + (range.second - range.first + 1) / 2;
}

std::vector<ItemRange> split(std::span<const Vec3> centres, std::vector<Index>& items, ItemRange range, unsigned branching,
                             std::size_t leaf_items) {
    std::vector<ItemRange> groups{range};
    for (unsigned width = 2; width <= branching; width *= 2) {
        std::vector<ItemRange> halves;
        for (const ItemRange& group : groups) {
            if (group.second - group.first <= leaf_items) {
                halves.push_back(group);
                continue;
            }
            const Index middle = split_point(centres, items, group);
            halves.emplace_back(group.first, middle);
            halves.emplace_back(middle, group.second);
        }
        groups = std::move(halves);
    }
    return groups;
}

} // namespace

SphereTree split_by_median(std::span<const Vec3> centres, unsigned branching, std::size_t leaf_items) {
    SphereTree tree;
    if (centres.empty()) return tree;
    branching = std::clamp(branching, 2U, 8U);
    leaf_items = std::max<std::size_t>(leaf_items, 1);
    tree.items.resize(centres.size());
    std::iota(tree.items.begin(), tree.items.end(), Index{0});
    add_sphere(tree, kNoIndex, 0, {0, static_cast<Index>(centres.size())});
    tree.level_begin = {0};
    for (Index s = 0; s < tree.spheres.size(); ++s) { // spheres are appended behind s, level by level
        if (tree.level[s] == tree.level_begin.size()) tree.level_begin.push_back(s);
        const ItemRange range{tree.item_begin[s], tree.item_end[s]};
        if (range.second - range.first <= leaf_items) continue;
        const auto groups = split(centres, tree.items, range, branching, leaf_items);
        tree.first_child[s] = static_cast<Index>(tree.spheres.size());
        tree.child_count[s] = static_cast<std::uint16_t>(groups.size());
        for (const ItemRange& group : groups) add_sphere(tree, s, static_cast<std::uint8_t>(tree.level[s] + 1), group);
    }
    tree.level_begin.push_back(static_cast<Index>(tree.spheres.size()));
    return tree;
}

SphereTree split_in_order(std::size_t item_count, unsigned branching) {
    SphereTree tree;
    if (item_count == 0) return tree;
    branching = std::clamp(branching, 2U, 8U);
    std::vector<std::size_t> sizes{item_count}; // spheres of each level, last level first
    while (sizes.back() > 1) sizes.push_back((sizes.back() + branching - 1) / branching);
    tree.items.resize(item_count);
    std::iota(tree.items.begin(), tree.items.end(), Index{0});
    std::size_t stride = 1; // items beneath a sphere of the level
    for (std::size_t l = 1; l < sizes.size(); ++l) stride *= branching;
    for (std::size_t l = sizes.size(); l-- > 0; stride /= branching) {
        const auto level = static_cast<std::uint8_t>(sizes.size() - 1 - l);
        const auto begin = static_cast<Index>(tree.spheres.size());
        for (std::size_t k = 0; k < sizes[l]; ++k) {
            const Index parent = level == 0 ? kNoIndex : tree.level_begin.back() + static_cast<Index>(k / branching);
            const ItemRange range{static_cast<Index>(k * stride), static_cast<Index>(std::min((k + 1) * stride, item_count))};
            const Index s = add_sphere(tree, parent, level, range);
            if (parent == kNoIndex) continue;
            if (tree.child_count[parent]++ == 0) tree.first_child[parent] = s;
        }
        tree.level_begin.push_back(begin);
    }
    tree.level_begin.push_back(static_cast<Index>(tree.spheres.size()));
    return tree;
}

} // namespace trocar::spheretree
