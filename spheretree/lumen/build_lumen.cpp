#include "spheretree/lumen/build_lumen.hpp"

#include "base/topology.hpp"
#include "spheretree/bounding.hpp"
#include "spheretree/build/cover_selection.hpp"
#include "spheretree/hierarchy.hpp"
#include "spheretree/build/point_tree.hpp"
#include "spheretree/lumen/wall_links.hpp"

namespace trocar::spheretree {

namespace {

/// Arranges the balls as a tree: ball k becomes item k, in depth-first order of the leaves.
void hang(std::span<const Sphere> balls, unsigned branching, LumenTree& lumen) {
    std::vector<Vec3> centres;
    for (const Sphere& b : balls) centres.push_back(b.centre);
    SphereTree& tree = lumen.tree;
    tree = split_by_median(centres, branching, 1);
    std::vector<Sphere> ordered; // [item]
    for (const Index id : tree.items) ordered.push_back(balls[id]);
    std::iota(tree.items.begin(), tree.items.end(), Index{0});
    lumen.leaf_of_ball.assign(balls.size(), kNoIndex);
    lumen.largest_ball.assign(tree.sphere_count(), 0.0);
    for (Index s = 0; s < tree.sphere_count(); ++s) {
        const auto beneath = std::span<const Sphere>(ordered).subspan(tree.item_begin[s], tree.item_end[s] - tree.item_begin[s]);
        for (const Sphere& b : beneath) lumen.largest_ball[s] = std::max(lumen.largest_ball[s], b.radius);
        if (tree.is_leaf(s)) {
            tree.spheres[s] = beneath.front();
            lumen.leaf_of_ball[tree.item_begin[s]] = s;
        } else {
            tree.spheres[s] = enclose(beneath);
        }
    }
}

/// How far each sample lies outside the union, relative to the local radius.
void measure_error(std::span<const Sphere> balls, std::span<const WallSample> samples, LumenReport& report) {
    std::vector<Vec3> points;
    for (const WallSample& s : samples) points.push_back(s.point);
    const PointTree tree(points);
    std::vector<double> error(samples.size(), 1.0); // [-] 1 stands for "not near any ball"
    for (const Sphere& ball : balls)
        tree.for_each_within(ball.centre, 1.5 * ball.radius, [&](Index i, double distance_sq) {
            error[i] = std::min(error[i], std::max(0.0, std::sqrt(distance_sq) - ball.radius) / samples[i].local_radius);
        });
    double sum = 0.0;
    for (const double e : error) {
        report.worst_relative_error = std::max(report.worst_relative_error, e);
        sum += e;
    }
    report.mean_relative_error = samples.empty() ? 0.0 : sum / static_cast<double>(samples.size());
}

} // namespace

Result<LumenTree> build_lumen_tree(const TriMesh& closed_lumen, const LumenOptions& options, LumenReport* report) {
    if (const auto checked = check_closed_surface(closed_lumen); !checked) return checked.error();
    const InsideTest inside(closed_lumen);
    const MedialBalls medial =
        find_medial_balls(closed_lumen, inside, {.min_radius = options.min_radius, .max_samples = options.max_samples});
    const std::vector<Index> chosen = select_cover(medial, {options.relative_error, options.error_floor, options.corner_ratio});
    if (chosen.empty())
        return Error{ErrorCode::BadMesh, "the lumen holds no inscribed sphere of radius " + std::to_string(options.min_radius) +
                                             " m: its surface must be closed, outward, and in metres"};
    std::vector<Sphere> balls;
    for (const Index id : chosen) {
        const Vec3& centre = medial.balls[id].centre;
        balls.push_back({centre, inside.tree().closest(centre)->distance * (1.0 - 1e-12)});
    }

    LumenTree lumen;
    lumen.rest_vertices = closed_lumen.vertices;
    lumen.triangles = closed_lumen.triangles;
    lumen.link_reach = options.link_reach;
    hang(balls, options.branching, lumen);
    add_neighbours(lumen);
    add_wall_links(lumen, inside.tree(), options.link_reach);
    if (report != nullptr) {
        *report = {medial.samples.size(), medial.balls.size(), balls.size(), 0, 0.0, 0.0};
        (void)find_components(balls, report->components);
        measure_error(balls, medial.samples, *report);
    }
    return lumen;
}

} // namespace trocar::spheretree
