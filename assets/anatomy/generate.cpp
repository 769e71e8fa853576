#include "assets/anatomy/anatomy.hpp"
#include "assets/anatomy/arteries.hpp"
#include "assets/anatomy/curves.hpp"
#include "assets/anatomy/hepatic_tree.hpp"
#include "assets/anatomy/liver.hpp"
#include "assets/anatomy/polygonise.hpp"
#include "assets/anatomy/remesh.hpp"
#include "assets/anatomy/route.hpp"
#include "assets/anatomy/vessel_field.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::anatomy {
namespace {

constexpr int kAttempts = 60;                // hepatic trees tried for a seed
constexpr double kLeastRouteRadius = 0.0014; // m, on the way to the tumour
constexpr double kLeastRouteBend = 0.0095;   // m
constexpr double kEntryDepth = 0.014;        // m, femoral entry from the vessel's cut end
constexpr double kTargetDepth = 0.006;       // m, targets from the end of their vessel

constexpr double kLiverCell = 0.0026;  // m, grid of the first polygons
constexpr double kLumenCell = 0.00085; // m, a gap or a terminal vessel is more than two cells wide

std::vector<Tube> tubes_of(const std::vector<LaidVessel>& vessels) {
    std::vector<Tube> tubes;
    for (const LaidVessel& v : vessels) tubes.push_back(v.tube);
    return tubes;
}

/// Every intrahepatic vessel's wall at least the recipe's margin under the liver's surface.
bool deep_enough(const Recipe& recipe, const LiverShape& liver, const std::vector<LaidVessel>& vessels) {
    for (const LaidVessel& v : vessels)
        for (std::size_t k = 0, i = 0; k < v.legs.size(); i = v.leg_end[k++]) {
            if (!v.legs[k].intrahepatic) continue;
            for (std::size_t s = i; s <= v.leg_end[k]; ++s)
                if (liver.distance(v.tube.points[s]) + v.tube.radii[s] > -recipe.capsule_margin) return false;
        }
    return true;
}

/// Nodes in the vessels' order: parents first.
Centreline make_centreline(const std::vector<LaidVessel>& vessels, const VesselField& lumen) {
    Centreline line;
    std::vector<std::vector<Index>> node_of; // [vessel][sample]
    std::vector<Index> first_branch_of;      // [vessel]
    for (const LaidVessel& v : vessels) {
        auto& nodes = node_of.emplace_back();
        std::size_t leg = 0;
        const auto first_branch = static_cast<Index>(line.branches.size());
        first_branch_of.push_back(first_branch);
        Index parent = v.parent == kNoIndex ? kNoIndex : first_branch_of[v.parent] + static_cast<Index>(v.parent_leg);
        for (const Leg& l : v.legs) {
            line.branches.push_back({l.name, parent, l.radius, l.intrahepatic});
            parent = static_cast<Index>(line.branches.size() - 1);
        }
        for (std::size_t i = 0; i < v.tube.points.size(); ++i) {
            while (leg + 1 < v.legs.size() && i > v.leg_end[leg]) ++leg;
            if (i == 0 && v.parent != kNoIndex) { // shared with the parent
                nodes.push_back(node_of[v.parent][v.parent_sample]);
                continue;
            }
            line.parent.push_back(i > 0 ? nodes.back() : kNoIndex);
            nodes.push_back(static_cast<Index>(line.points.size()));
            line.points.push_back(v.tube.points[i]);
            line.radii.push_back(-lumen.value(v.tube.points[i]));
            line.branch.push_back(first_branch + static_cast<Index>(leg));
        }
    }
    return line;
}

/// The node `depth` of arc before a branch's last one.
Index node_before_end(const Centreline& line, Index branch, double depth) {
    Index node = kNoIndex;
    for (Index i = 0; i < line.branch.size(); ++i)
        if (line.branch[i] == branch) node = i;
    double walked = 0.0;
    while (line.parent[node] != kNoIndex && walked < depth) {
        walked += (line.points[node] - line.points[line.parent[node]]).norm();
        node = line.parent[node];
    }
    return node;
}

void add_landmark(Anatomy& anatomy, std::string name, Index node) {
    Centreline& line = anatomy.centreline;
    const Index before = line.parent[node];
    const Vec3 direction = before != kNoIndex ? line.points[node] - line.points[before] : line.points[node + 1] - line.points[node];
    anatomy.landmarks.push_back({name, line.points[node], direction.normalized(), line.radii[node]});
    line.named.emplace(std::move(name), node);
}

void add_landmarks(Anatomy& anatomy, const std::vector<LaidVessel>& vessels, std::string_view tumour_branch) {
    const Centreline& line = anatomy.centreline;
    add_landmark(anatomy, "femoral_entry", static_cast<Index>(std::ceil(kEntryDepth / vessels[0].spacing)));
    for (const LaidVessel& v : vessels)
        if (v.legs.front().name == "coeliac")
            for (Index i = 0; i < line.points.size(); ++i)
                if (line.points[i] == v.tube.points[v.mouth]) add_landmark(anatomy, "coeliac_ostium", i);
    std::vector<char> forks(line.branches.size(), 0);
    for (const Branch& b : line.branches)
        if (b.parent != kNoIndex) forks[b.parent] = 1;
    int segment = 0;
    for (Index b = 0; b < line.branches.size(); ++b) {
        if (!line.branches[b].intrahepatic || forks[b]) continue;
        add_landmark(anatomy, "segment_" + std::to_string(++segment), node_before_end(line, b, kTargetDepth));
        if (line.branches[b].name == tumour_branch) add_landmark(anatomy, "tumour", node_before_end(line, b, kTargetDepth));
    }
}

/// One try: a tree, its vessels, centreline and landmarks; an error says why it is rejected.
Result<Anatomy> lay_out(const Recipe& recipe, const LiverShape& liver, const TrunkAtlas& atlas, Random& random,
                        std::vector<LaidVessel>& vessels) {
    const auto tree = grow_hepatic_tree(recipe, liver, atlas.hilum().approach, random);
    if (!tree) return Error{ErrorCode::BadMesh, "the tree's ends do not all fit into the liver"};
    std::vector<VesselPlan> plans = atlas.plans(murray_radius(recipe, tree->flow()));
    add_tree_plans(recipe, *tree, plans);
    auto laid = lay_vessels(plans);
    if (!laid) return laid.error();
    if (!deep_enough(recipe, liver, *laid)) return Error{ErrorCode::BadMesh, "a vessel comes too near to the liver's surface"};
    vessels = std::move(*laid);
    Anatomy anatomy;
    anatomy.centreline = make_centreline(vessels, VesselField(tubes_of(vessels)));
    add_landmarks(anatomy, vessels, "hepatic_" + std::to_string(tree->tumour - 1));
    const auto route = inspect_route(anatomy, "tumour");
    if (!route) return route.error();
    if (route->min_radius < kLeastRouteRadius) return Error{ErrorCode::BadMesh, "the tumour's feeder is too narrow"};
    if (route->min_curvature_radius < kLeastRouteBend) return Error{ErrorCode::BadMesh, "the way to the tumour bends too sharply"};
    return anatomy;
}

TriMesh mesh_liver(const Recipe& recipe, const LiverShape& liver) {
    return remesh(polygonise(liver, liver.box(), kLiverCell, 2.5), liver, [](const Vec3&) { return 1.0; }, {recipe.liver_triangles, 7});
}

TriMesh mesh_lumen(const Recipe& recipe, const std::vector<LaidVessel>& vessels) {
    const VesselField lumen(tubes_of(vessels));
    // Between equal angles (edge ~ r) and equal edges: small vessels stay round, the aorta keeps its curvature.
    const auto size = [&](const Vec3& p) { return std::sqrt(lumen.local_radius(p)); };
    return remesh(polygonise(lumen, lumen.box(), kLumenCell, 1.3), lumen, size, {recipe.lumen_triangles, 7});
}

} // namespace

Result<Anatomy> generate(const Recipe& recipe) {
    if (const auto checked = check_recipe(recipe); !checked) return checked.error();
    Random dice(0x5e1d1 + static_cast<std::uint64_t>(recipe.seed));
    const TrunkAtlas atlas(recipe, dice);
    const LiverShape liver(recipe, atlas.hilum().position, dice);
    std::string reason;
    for (int attempt = 0; attempt < kAttempts; ++attempt) {
        Random branch_dice(dice.next());
        std::vector<LaidVessel> vessels;
        auto anatomy = lay_out(recipe, liver, atlas, branch_dice, vessels);
        if (!anatomy) {
            reason = anatomy.error().message;
            continue;
        }
        anatomy->liver = mesh_liver(recipe, liver);
        anatomy->lumen = mesh_lumen(recipe, vessels);
        return anatomy;
    }
    return Error{ErrorCode::BadMesh, "no valid patient for seed " + std::to_string(recipe.seed) + ": " + reason};
}

const Landmark* find_landmark(const Anatomy& anatomy, std::string_view name) noexcept {
    for (const Landmark& l : anatomy.landmarks)
        if (l.name == name) return &l;
    return nullptr;
}

const TriMesh* find_part(const Anatomy& anatomy, std::string_view name) noexcept {
    if (name == "liver") return &anatomy.liver;
    if (name == "lumen" || name == "arteries") return &anatomy.lumen;
    return nullptr;
}

} // namespace trocar::anatomy
