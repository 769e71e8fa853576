#include "spheretree/build/adopt_tree.hpp"

#include "base/box.hpp"
#include "base/surface_area.hpp"
#include "spheretree/bounding.hpp"
#include "spheretree/build/piece.hpp"
#include "spheretree/hierarchy.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <tuple>
#include <utility>

namespace trocar::spheretree {

namespace {

/// Of the surface's longest side: what a text's rounding takes from a sphere is no lack.
constexpr double kRounding = 1e-9;
/// Cuts of all triangles together; after that parts are left as long as kCoarse of the longest side, and spheres grow by more.
constexpr std::size_t kMostCuts = 400'000;
constexpr double kCoarse = 1e-2;
constexpr double kFar = std::numeric_limits<double>::infinity();

using Corners = std::array<Vec3, 3>;

/// How far the part reaches outside; negative: the sphere holds it with so much to spare.
double lack_of(const Sphere& sphere, const Corners& corners) noexcept {
    double farthest = 0.0;
    for (const Vec3& p : corners) farthest = std::max(farthest, (p - sphere.centre).norm());
    return farthest - sphere.radius;
}

bool is_leaf(const SphereTree& tree, Index s) noexcept { return tree.is_leaf(s) && tree.spheres[s].radius >= 0.0; }

/// A hierarchy over the leaves, to find those about a place.
class LeafFinder {
public:
    explicit LeafFinder(const SphereTree& tree, double rounding) : tree_(tree), rounding_(rounding) {
        std::vector<Vec3> centres;
        for (Index s = 0; s < tree.sphere_count(); ++s)
            if (is_leaf(tree, s)) {
                leaves_.push_back(s);
                centres.push_back(tree.spheres[s].centre);
            }
        groups_ = split_by_median(centres, 8, 8);
        std::vector<Sphere> beneath;
        for (Index g = static_cast<Index>(groups_.sphere_count()); g-- > 0;) {
            beneath.clear();
            if (groups_.is_leaf(g))
                for (const Index k : groups_.items_of(g)) beneath.push_back(tree.spheres[leaves_[k]]);
            else
                for (Index c = 0; c < groups_.child_count[g]; ++c) beneath.push_back(groups_.spheres[groups_.first_child[g] + c]);
            groups_.spheres[g] = enclose(beneath);
        }
    }

    struct Found {
        Index leaf = kNoIndex;
        double lack = kFar;  // of the leaf, 0 where it holds the part
        double above = kFar; // largest of its ancestors', 0 where they all hold it
        double spare = kFar; // the leaf's lack with its sign
        [[nodiscard]] auto rank() const noexcept { return std::tie(lack, above, spare, leaf); }
    };

    [[nodiscard]] Found find(const Corners& corners) const {
        Found best;
        look(0, corners, best);
        return best;
    }

    /// Least that a leaf together with all above it lacks.
    [[nodiscard]] double find_least(const Corners& corners) const {
        double best = kFar;
        look_for_least(0, corners, best);
        return best;
    }

private:
    [[nodiscard]] double lack_above(Index leaf, const Corners& corners) const {
        double most = 0.0;
        for (Index s = tree_.parent[leaf]; s != kNoIndex; s = tree_.parent[s])
            if (const double lack = lack_of(tree_.spheres[s], corners); lack > rounding_) most = std::max(most, lack);
        return most;
    }

    void look_for_least(Index group, const Corners& corners, double& best) const {
        if (lack_of(groups_.spheres[group], corners) >= best) return;
        if (groups_.is_leaf(group)) {
            for (const Index k : groups_.items_of(group))
                if (const double lack = lack_of(tree_.spheres[leaves_[k]], corners); lack < best)
                    best = std::min(best, std::max(lack, lack_above(leaves_[k], corners)));
            return;
        }
        for (Index c = 0; c < groups_.child_count[group]; ++c) look_for_least(groups_.first_child[group] + c, corners, best);
    }

    void look(Index group, const Corners& corners, Found& best) const {
        // a ball within another reaches no farther: the group's lack is at most that of any leaf in it
        if (lack_of(groups_.spheres[group], corners) > best.lack + rounding_) return;
        if (groups_.is_leaf(group)) {
            for (const Index k : groups_.items_of(group)) consider(leaves_[k], corners, best);
            return;
        }
        for (Index c = 0; c < groups_.child_count[group]; ++c) look(groups_.first_child[group] + c, corners, best);
    }

    void consider(Index leaf, const Corners& corners, Found& best) const {
        Found found{leaf, 0.0, 0.0, lack_of(tree_.spheres[leaf], corners)};
        found.lack = found.spare > rounding_ ? found.spare : 0.0;
        if (found.lack > best.lack) return;
        found.above = lack_above(leaf, corners);
        if (found.rank() < best.rank()) best = found;
    }

    const SphereTree& tree_;
    double rounding_;
    std::vector<Index> leaves_;
    SphereTree groups_; // items: places in leaves_
};

/// Gives every part of a surface to a leaf.
class Adoption {
public:
    Adoption(const SphereTree& foreign, const TriMesh& surface, const AdoptOptions& options)
        : foreign_(foreign), surface_(surface), size_(surface.bounds().longest_edge()), finest_(options.finest * size_),
          finder_(foreign, kRounding * size_), needed_(foreign.sphere_count(), -1.0), items_(foreign.sphere_count()) {}

    [[nodiscard]] AdoptedTree make() {
        for (Index t = 0; t < surface_.triangles.size(); ++t) share_out(t);
        if (const double area = surface_area(surface_); area > 0.0) {
            coverage_.uncovered /= area;
            coverage_.unreachable /= area;
        }
        grow();
        return {rebuild(), coverage_};
    }

private:
    [[nodiscard]] Corners corners_of(const PieceSet& set, const Piece& piece) const {
        return {set.point(piece.corners[0]), set.point(piece.corners[1]), set.point(piece.corners[2])};
    }

    void share_out(Index triangle) {
        const Triangle& t = surface_.triangles[triangle];
        const std::array<Vec3, 3> corners{surface_.vertices[t[0]], surface_.vertices[t[1]], surface_.vertices[t[2]]};
        PieceSet set(corners);
        std::vector<Piece> open{{{0, 1, 2}, triangle}};
        bool whole = true;
        while (!open.empty()) {
            const Piece piece = open.back();
            open.pop_back();
            const Corners at = corners_of(set, piece);
            const LeafFinder::Found found = finder_.find(at);
            int corner = 0;
            const double longest = std::sqrt(set.longest_edge_sq(piece, corner));
            // a part farther outside than it is long is outside altogether: halving would not help
            const double lack = found.lack == 0.0 && found.above > 0.0 ? finder_.find_least(at) : found.lack;
            if (lack > 0.0 && lack < longest && longest > (cuts_ < kMostCuts ? finest_ : kCoarse * size_)) {
                ++cuts_;
                for (const Piece& half : set.split(piece, corner)) open.push_back(half);
                continue;
            }
            whole = whole && found.lack == 0.0;
            give(triangle, at, found);
        }
        coverage_.triangles += !whole;
    }

    void give(Index triangle, const Corners& at, const LeafFinder::Found& found) {
        const double area = 0.5 * (at[1] - at[0]).cross(at[2] - at[0]).norm();
        if (found.lack > 0.0) {
            coverage_.uncovered += area;
            coverage_.farthest = std::max(coverage_.farthest, found.lack);
        } else if (found.above > 0.0) {
            coverage_.unreachable += area;
        }
        std::vector<Index>& items = items_[found.leaf];
        if (items.empty() || items.back() != triangle) items.push_back(triangle); // triangles come one after the other
        for (Index s = found.leaf; s != kNoIndex; s = foreign_.parent[s])
            for (const Vec3& p : at) needed_[s] = std::max(needed_[s], (p - foreign_.spheres[s].centre).norm());
    }

    void grow() {
        for (Index s = 0; s < foreign_.sphere_count(); ++s) {
            const double growth = needed_[s] - foreign_.spheres[s].radius;
            const bool leaf = foreign_.is_leaf(s);
            coverage_.idle_leaves += leaf && items_[s].empty();
            if (!(growth > kRounding * size_)) continue;
            ++(leaf ? coverage_.grown_leaves : coverage_.grown_inner);
            double& most = leaf ? coverage_.leaf_growth : coverage_.inner_growth;
            most = std::max(most, growth);
        }
    }

    /// Spheres with something beneath them, in their order: children stay next to one another, levels behind levels.
    [[nodiscard]] SphereTree rebuild() const {
        SphereTree tree;
        std::vector<Index> id(foreign_.sphere_count(), kNoIndex);
        std::vector<Index> old;
        for (Index s = 0; s < foreign_.sphere_count(); ++s) {
            if (needed_[s] < 0.0) continue;
            const auto own = static_cast<Index>(tree.spheres.size());
            id[s] = own;
            old.push_back(s);
            const Index parent = foreign_.parent[s] == kNoIndex ? kNoIndex : id[foreign_.parent[s]];
            tree.spheres.push_back({foreign_.spheres[s].centre, std::max(foreign_.spheres[s].radius, needed_[s] * kRoundOut)});
            tree.parent.push_back(parent);
            tree.first_child.push_back(kNoIndex);
            tree.child_count.push_back(0);
            const std::uint8_t level = parent == kNoIndex ? std::uint8_t{0} : static_cast<std::uint8_t>(tree.level[parent] + 1);
            tree.level.push_back(level);
            if (level == tree.level_begin.size()) tree.level_begin.push_back(own);
            if (parent != kNoIndex && tree.child_count[parent]++ == 0) tree.first_child[parent] = own;
        }
        tree.level_begin.push_back(static_cast<Index>(tree.spheres.size()));
        tree.item_begin.resize(tree.sphere_count());
        tree.item_end.resize(tree.sphere_count());
        list_items(tree, 0, old);
        return tree;
    }

    void list_items(SphereTree& tree, Index s, const std::vector<Index>& old) const {
        tree.item_begin[s] = static_cast<Index>(tree.items.size());
        if (tree.is_leaf(s)) tree.items.insert(tree.items.end(), items_[old[s]].begin(), items_[old[s]].end());
        for (Index c = 0; c < tree.child_count[s]; ++c) list_items(tree, tree.first_child[s] + c, old);
        tree.item_end[s] = static_cast<Index>(tree.items.size());
    }

    const SphereTree& foreign_;
    const TriMesh& surface_;
    double size_, finest_;
    std::size_t cuts_ = 0;
    LeafFinder finder_;
    std::vector<double> needed_;            // [sphere_count] radius that holds what was given beneath; negative: nothing was
    std::vector<std::vector<Index>> items_; // [sphere_count] triangles given to a leaf, ascending
    Coverage coverage_;
};

} // namespace

double leaves_extent(const SphereTree& tree) noexcept {
    Box3 box;
    for (Index s = 0; s < tree.sphere_count(); ++s)
        if (is_leaf(tree, s)) {
            const Vec3 reach = Vec3::Constant(tree.spheres[s].radius);
            box.add(tree.spheres[s].centre - reach);
            box.add(tree.spheres[s].centre + reach);
        }
    return box.longest_edge();
}

double farthest_outside(const SphereTree& tree, const TriMesh& surface) {
    const LeafFinder finder(tree, 0.0);
    double farthest = -kFar;
    for (const Vec3& v : surface.vertices) farthest = std::max(farthest, finder.find({v, v, v}).spare);
    return farthest;
}

AdoptedTree adopt_tree(const SphereTree& foreign, const TriMesh& surface, const AdoptOptions& options) {
    return Adoption(foreign, surface, options).make();
}

} // namespace trocar::spheretree
