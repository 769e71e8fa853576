// Wrapped trees that follow coarse nodes: what the bound holds, what the sphere-tree paper's heuristic loses, the cost of a lazy descent.
#include "base/trig.hpp"
#include "shapes.hpp"
#include "spheretree/update/deforming_tree.hpp"
#include "spheretree/traverse/descent.hpp"
#include "spheretree/build/wrapped_tree.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace trocar::spheretree {
namespace {

using test::make_icosphere;
using test::Random;
using Deformation = std::function<Vec3(const Vec3&)>;

Mat3 axes_of(const Vec3& a, const Vec3& b, const Vec3& c) {
    Mat3 axes;
    const Vec3 e = (b - a).normalized(), n = (b - a).cross(c - a).normalized();
    axes << n, e, e.cross(n);
    return axes;
}

/// An ellipsoid on the nodes of a coarser one, linked by a formula of the test's own: p = sum a_i q_i + A rho.
struct LinkedEllipsoid {
    static TriMesh ellipsoid(double radius, unsigned levels) {
        TriMesh mesh = make_icosphere(Vec3::Zero(), radius, levels);
        for (Vec3& v : mesh.vertices) v[2] *= 2.5;
        return mesh;
    }
    static const WrappedTree& shared() { // built once
        static const WrappedTree tree = build_wrapped_tree(ellipsoid(0.05, 3), {Builder::Medial, 8, 3}).value();
        return tree;
    }
    TriMesh dense, coarse = ellipsoid(0.048, 1);
    WrappedTree wrapped;
    std::vector<Mat3> frame_rest;
    std::vector<Index> vertex_frame;
    std::vector<std::array<double, 3>> weight;
    std::vector<Vec3> projection;
    std::vector<double> blend;
    std::vector<Tet> affine_nodes; // of every seventh vertex, where asked for
    std::vector<std::array<double, 4>> affine_weight;

    explicit LinkedEllipsoid(bool stands = false, bool affine = false) : LinkedEllipsoid(ellipsoid(0.05, 3), shared(), stands, affine) {}
    LinkedEllipsoid(TriMesh surface, WrappedTree tree_of_it, bool stands, bool affine)
        : dense(std::move(surface)), wrapped(std::move(tree_of_it)) {
        for (const Triangle& t : coarse.triangles)
            frame_rest.push_back(axes_of(coarse.vertices[t[0]], coarse.vertices[t[1]], coarse.vertices[t[2]]));
        for (const Vec3& p : dense.vertices) {
            Index best = 0;
            const auto away = [&](Index f) {
                const Triangle& t = coarse.triangles[f];
                return ((coarse.vertices[t[0]] + coarse.vertices[t[1]] + coarse.vertices[t[2]]) / 3.0 - p).norm();
            };
            for (Index f = 1; f < coarse.triangles.size(); ++f)
                if (away(f) < away(best)) best = f;
            vertex_frame.push_back(best);
            std::array<double, 3> a{};
            double sum = 0.0;
            for (std::size_t k = 0; k < 3; ++k) sum += a[k] = 1.0 / (1e-6 + (coarse.vertices[coarse.triangles[best][k]] - p).norm());
            Vec3 origin = Vec3::Zero();
            for (std::size_t k = 0; k < 3; ++k) origin += (a[k] /= sum) * coarse.vertices[coarse.triangles[best][k]];
            weight.push_back(a);
            projection.push_back(frame_rest[best].transpose() * (p - origin));
            blend.push_back(stands ? std::clamp(0.5 + 10.0 * p.z(), 0.0, 1.0) : 1.0);
            if (affine && blend.size() % 7 == 0) follow_tet(best, p);
        }
    }
    /// The last vertex lies outside of the tetrahedron of a triangle and a node beyond the middle.
    void follow_tet(Index face, const Vec3& p) {
        const Triangle& t = coarse.triangles[face];
        Index beyond = 0;
        for (Index n = 1; n < coarse.vertices.size(); ++n)
            if ((coarse.vertices[n] - p).norm() > (coarse.vertices[beyond] - p).norm()) beyond = n;
        const Tet nodes{t[0], t[1], t[2], beyond};
        Mat3 edges;
        for (int k = 0; k < 3; ++k) edges.col(k) = coarse.vertices[nodes[k + 1]] - coarse.vertices[nodes[0]];
        const Vec3 w = edges.inverse() * (p - coarse.vertices[nodes[0]]);
        vertex_frame.back() = static_cast<Index>(coarse.triangles.size() + affine_nodes.size());
        projection.back().setZero();
        affine_nodes.push_back(nodes);
        affine_weight.push_back({1.0 - w.sum(), w[0], w[1], w[2]});
    }
    [[nodiscard]] DeformingTree tree() const {
        return make_deforming_tree(wrapped.tree, dense,
                                   {coarse.triangles, frame_rest, vertex_frame, projection, blend, coarse.vertices, affine_nodes, affine_weight});
    }
};

struct Posed {
    std::vector<Vec3> nodes, surface, points; // points: of the tree's pieces
    std::vector<Mat3> turn;
    [[nodiscard]] NodePose pose() const { return {nodes, turn}; }
};

Posed deform(const LinkedEllipsoid& body, const Deformation& by) {
    Posed out;
    for (const Vec3& q : body.coarse.vertices) out.nodes.push_back(by(q));
    for (std::size_t f = 0; f < body.frame_rest.size(); ++f) {
        const Triangle& t = body.coarse.triangles[f];
        const Mat3 now = axes_of(out.nodes[t[0]], out.nodes[t[1]], out.nodes[t[2]]);
        out.turn.push_back(now.allFinite() ? Mat3(now - body.frame_rest[f]) : Mat3(Mat3::Zero())); // collapsed: the last good one
    }
    for (std::size_t v = 0; v < body.dense.vertices.size(); ++v) {
        const Index f = body.vertex_frame[v];
        if (f >= body.coarse.triangles.size()) {
            Vec3 p = Vec3::Zero();
            const std::size_t k = f - body.coarse.triangles.size();
            for (std::size_t i = 0; i < 4; ++i) p += body.affine_weight[k][i] * out.nodes[body.affine_nodes[k][i]];
            out.surface.push_back(p);
            continue;
        }
        Vec3 p = (body.frame_rest[f] + out.turn[f]) * body.projection[v];
        for (std::size_t k = 0; k < 3; ++k) p += body.weight[v][k] * out.nodes[body.coarse.triangles[f][k]];
        out.surface.push_back(body.dense.vertices[v] + body.blend[v] * (p - body.dense.vertices[v]));
    }
    out.points = out.surface;
    for (const auto& parents : body.wrapped.set.midpoints()) out.points.push_back(0.5 * (out.points[parents[0]] + out.points[parents[1]]));
    return out;
}

Vec3 bend(const Vec3& p) { // round the y axis, radius 0.1 m
    const SinCos turn = sin_cos(p.z() / 0.1);
    return {(0.1 + p.x()) * turn.cos - 0.1, p.y(), (0.1 + p.x()) * turn.sin};
}
Vec3 twist(const Vec3& p) { return rotation_about(Vec3::UnitZ(), 12.0 * p.z()) * p; }
Vec3 stretch(const Vec3& p) { return {0.8 * p.x(), 0.8 * p.y(), 1.5 * p.z()}; }
Vec3 turn90(const Vec3& p) { return rotation_about(Vec3::UnitX(), 1.5707963267948966) * p + Vec3(0.3, -0.1, 0.2); }
Vec3 collapse(const Vec3& p) { return {p.x(), p.y(), std::min(p.z(), 0.02)}; } // one end onto a plane
Vec3 shrink_to_a_point(const Vec3&) { return {0.01, 0.02, 0.03}; }

struct Named {
    const char* name;
    Deformation by;
};
std::vector<Named> all_deformations() {
    std::vector<Named> out = {{"rest", [](const Vec3& p) { return p; }},
                              {"bend", bend},
                              {"twist", twist},
                              {"stretch", stretch},
                              {"turn", turn90},
                              {"collapse", collapse},
                              {"a point", shrink_to_a_point}};
    for (std::uint64_t seed = 1; seed <= 3; ++seed)
        out.push_back({"noise", [random = Random(seed)](const Vec3& p) mutable {
                           return Vec3(p + random.in_box({Vec3::Constant(-0.01), Vec3::Constant(0.01)}));
                       }});
    return out;
}

/// m; how far the farthest piece beneath sphere s reaches out of it; below 0 where it holds all.
double escape_from(const LinkedEllipsoid& body, Index s, const Sphere& sphere, const std::vector<Vec3>& points) {
    double worst = -std::numeric_limits<double>::infinity();
    for (Index item = body.wrapped.tree.item_begin[s]; item < body.wrapped.tree.item_end[s]; ++item)
        for (const Index corner : body.wrapped.pieces[item].corners)
            worst = std::max(worst, (points[corner] - sphere.centre).norm() - sphere.radius);
    return worst;
}

/// m; of all spheres.
double worst_escape(const LinkedEllipsoid& body, std::span<const Sphere> spheres, const std::vector<Vec3>& points) {
    double worst = 0.0;
    for (Index s = 0; s < body.wrapped.tree.sphere_count(); ++s) worst = std::max(worst, escape_from(body, s, spheres[s], points));
    return worst;
}

std::vector<Sphere> all_spheres(const DeformingTree& tree, const NodePose& pose, SphereUpdate update) {
    std::vector<Sphere> out;
    for (Index s = 0; s < tree.tree.sphere_count(); ++s) out.push_back(deform_sphere(tree, s, pose, update));
    return out;
}

TEST(DeformingTree, ConservativeSpheresHoldWhatTheyHeldAtRestUnderAnyMotionOfTheNodes) {
    for (const auto& [stands, affine] : {std::pair{false, false}, {true, false}, {false, true}}) {
        const LinkedEllipsoid body(stands, affine);
        const DeformingTree tree = body.tree();
        for (const Named& deformation : all_deformations()) {
            const Posed posed = deform(body, deformation.by);
            EXPECT_LE(worst_escape(body, all_spheres(tree, posed.pose(), SphereUpdate::Conservative), posed.points), 0.0)
                << deformation.name << (stands ? ", partly standing" : "") << (affine ? ", some by tetrahedra" : "");
        }
    }
}

TEST(DeformingTree, LeavesHoldTheirPiecesOfLargeTrianglesWhoseCornersStandStillFarOutsideOfThem) {
    const TriMesh icosahedron = LinkedEllipsoid::ellipsoid(0.05, 0);
    LinkedEllipsoid body(icosahedron, build_wrapped_tree(icosahedron, {Builder::Shell, 8, 3}).value(), false, false);
    for (std::size_t v = 0; v < body.blend.size(); ++v) body.blend[v] = std::array{0.0, 1.0, 0.5}[v % 3];
    const DeformingTree tree = body.tree();
    double farthest = 0.0; // of a leaf's radius
    for (Index s = 0; s < tree.tree.sphere_count(); ++s) {
        if (!tree.tree.is_leaf(s)) continue;
        const Vec3 centre = tree.tree.spheres[s].centre; // the sphere stays where it is and turns: only the corners' way counts
        const Posed posed = deform(body, [&](const Vec3& p) { return Vec3(centre + rotation_about(Vec3::UnitX(), 2.5) * (p - centre)); });
        for (Index above = s; above != kNoIndex; above = tree.tree.parent[above])
            EXPECT_LE(escape_from(body, above, deform_sphere(tree, above, posed.pose(), SphereUpdate::Conservative), posed.points), 0.0)
                << "sphere " << above << ", turned about leaf " << s;
        farthest = std::max(farthest, tree.stands[s] / tree.tree.spheres[s].radius);
    }
    EXPECT_GT(farthest, 3.0);
    for (const Named& deformation : all_deformations()) {
        const Posed posed = deform(body, deformation.by);
        EXPECT_LE(worst_escape(body, all_spheres(tree, posed.pose(), SphereUpdate::Conservative), posed.points), 0.0) << deformation.name;
    }
}

TEST(DeformingTree, ARigidMotionTurnsConservativeSpheresAndGrowsThemByNothing) {
    const LinkedEllipsoid body(false, true);
    const DeformingTree tree = body.tree();
    const Posed posed = deform(body, turn90);
    const std::vector<Sphere> now = all_spheres(tree, posed.pose(), SphereUpdate::Conservative);
    for (Index s = 0; s < now.size(); ++s) {
        EXPECT_LT((now[s].centre - turn90(tree.tree.spheres[s].centre)).norm(), 1e-12);
        EXPECT_NEAR(now[s].radius, tree.tree.spheres[s].radius, 1e-10);
        EXPECT_EQ(tree.stands[s], 0.0) << "every vertex moves fully";
    }
}

TEST(DeformingTree, ThePapersHeuristicMisplacesCentresUnderATurnAndLosesSurfaceThatTheBoundHolds) {
    const LinkedEllipsoid body;
    const DeformingTree tree = body.tree();
    const Posed rest = deform(body, [](const Vec3& p) { return p; });
    EXPECT_LE(worst_escape(body, all_spheres(tree, rest.pose(), SphereUpdate::Heuristic), rest.points), 1e-12) << "at rest it is the tree";
    double misplaced = 0.0;
    const Posed turned = deform(body, turn90);
    for (Index s = 0; s < tree.tree.sphere_count(); ++s)
        misplaced =
            std::max(misplaced,
                     (deform_sphere(tree, s, turned.pose(), SphereUpdate::Heuristic).centre - turn90(tree.tree.spheres[s].centre)).norm());
    EXPECT_GT(misplaced, 1e-3) << "the mean displacement is not covariant";
    double lost = 0.0;
    for (const Deformation& by : {Deformation(bend), Deformation(twist), Deformation(stretch)}) {
        const Posed posed = deform(body, by);
        lost = std::max(lost, worst_escape(body, all_spheres(tree, posed.pose(), SphereUpdate::Heuristic), posed.points));
    }
    EXPECT_GT(lost, 1e-4);
}

TEST(DeformingTree, NodesOnACentreAndTreesOnNoNodesAreNoDivisionByZero) {
    LinkedEllipsoid body;
    body.wrapped.tree.spheres[0].centre = body.coarse.vertices[0]; // a node of V lies on the centre
    const DeformingTree tree = body.tree();
    const Posed posed = deform(body, bend);
    for (const SphereUpdate update : {SphereUpdate::Conservative, SphereUpdate::Heuristic})
        for (const Sphere& s : all_spheres(tree, posed.pose(), update)) {
            EXPECT_TRUE(s.centre.allFinite());
            EXPECT_TRUE(std::isfinite(s.radius));
        }
    const DeformingTree loose = make_deforming_tree(body.wrapped.tree, body.dense,
                                                    {{},
                                                     {},
                                                     std::vector<Index>(body.dense.vertices.size(), kNoIndex),
                                                     std::vector<Vec3>(body.dense.vertices.size()),
                                                     std::vector<double>(body.dense.vertices.size(), 0.0),
                                                     {}});
    EXPECT_EQ(deform_sphere(loose, 3, {}, SphereUpdate::Conservative).centre, body.wrapped.tree.spheres[3].centre);
}

TEST(DeformingTree, SweptSpheresHoldTheSurfaceAllAlongTheStep) {
    const LinkedEllipsoid body(false, true);
    const DeformingTree tree = body.tree();
    const Posed t0 = deform(body, stretch), t1 = deform(body, [](const Vec3&p) { return Vec3(bend(p) + Vec3(0.02, 0, 0)); });
    DeformingSpheres spheres;
    spheres.begin(tree, SphereUpdate::Conservative, t1.pose(), t0.pose());
    spheres.ensure(0, static_cast<Index>(tree.tree.sphere_count()));
    for (const double t : {0.0, 0.25, 0.5, 0.9, 1.0}) {
        std::vector<Vec3> now;
        for (std::size_t k = 0; k < t0.points.size(); ++k) now.emplace_back((1.0 - t) * t0.points[k] + t * t1.points[k]);
        EXPECT_LE(worst_escape(body, spheres.spheres(), now), 0.0) << t;
    }
}

TEST(DeformingTree, ALazyDescentFindsTheSameAndUpdatesOnlyWhatItVisits) {
    const LinkedEllipsoid body;
    const DeformingTree tree = body.tree();
    const Posed here = deform(body, bend), beside = deform(body, [](const Vec3&p) { return Vec3(twist(p) + Vec3(0.07, 0, 0.02)); });
    const std::vector<Sphere> a = all_spheres(tree, here.pose(), SphereUpdate::Conservative),
                              b = all_spheres(tree, beside.pose(), SphereUpdate::Conservative);
    DeformingSpheres lazy_a, lazy_b;
    for (const std::uint64_t units : {std::uint64_t{0}, std::uint64_t{5}, std::uint64_t{60}, std::uint64_t{700}, WorkBudget::kUnlimited}) {
        Descent eager, lazy;
        lazy_a.begin(tree, SphereUpdate::Conservative, here.pose());
        lazy_b.begin(tree, SphereUpdate::Conservative, beside.pose());
        eager.begin(0.0);
        eager.add_solid_pair({Thing::body(1), &tree.tree, a}, {Thing::body(2), &tree.tree, b});
        lazy.begin(0.0);
        lazy.add_solid_pair({Thing::body(1), &tree.tree, lazy_a.spheres(), &lazy_a}, {Thing::body(2), &tree.tree, lazy_b.spheres(), &lazy_b});
        WorkBudget for_eager(units), for_lazy(units);
        eager.run(for_eager);
        lazy.run(for_lazy);
        EXPECT_LE(lazy_a.updated() + lazy_b.updated(), 2 * lazy.stats().pairs_tested) << "two spheres a test at most";
        EXPECT_LT(lazy_a.updated() + lazy_b.updated(), a.size() + b.size());
        std::vector<Contact> x, y;
        eager.add_contacts(x);
        lazy.add_contacts(y);
        ASSERT_EQ(x.size(), y.size());
        for (std::size_t k = 0; k < x.size(); ++k) {
            ASSERT_EQ(x[k].feature_a[0], y[k].feature_a[0]);
            ASSERT_EQ(x[k].feature_b[0], y[k].feature_b[0]);
            ASSERT_EQ(x[k].gap, y[k].gap);
        }
    }
}

/// Every place where the two surfaces truly cross lies beneath some reported pair, whatever the budget.
TEST(DeformingTree, AtAnyBudgetEveryCrossingOfDeformedSurfacesIsBeneathAReportedPair) {
    const LinkedEllipsoid body;
    const DeformingTree tree = body.tree();
    const SphereTree& rest = body.wrapped.tree;
    const Posed here = deform(body, bend), beside = deform(body, [](const Vec3&p) { return Vec3(twist(p) + Vec3(0.06, 0, 0.01)); });
    const auto balls_of = [&](const std::vector<Vec3>& at) {
        std::vector<Sphere> balls;
        for (const Piece& piece : body.wrapped.pieces) {
            const Vec3 c = (at[piece.corners[0]] + at[piece.corners[1]] + at[piece.corners[2]]) / 3.0;
            double r = 0.0;
            for (const Index corner : piece.corners) r = std::max(r, (at[corner] - c).norm());
            balls.push_back({c, r});
        }
        return balls;
    };
    const std::vector<Sphere> xs = balls_of(here.points), ys = balls_of(beside.points);
    std::vector<std::pair<Index, Index>> near; // items whose pieces cross: an edge of the first goes through the second
    for (Index i = 0; i < body.wrapped.pieces.size(); ++i)
        for (Index k = 0; k < body.wrapped.pieces.size(); ++k) {
            const double reach = xs[i].radius + ys[k].radius;
            if ((xs[i].centre - ys[k].centre).squaredNorm() > reach * reach) continue;
            for (const Index c : body.wrapped.pieces[i].corners) // a corner of one on either side of the other: they cross
                for (const Index d : body.wrapped.pieces[i].corners) {
                    const auto& other = body.wrapped.pieces[k].corners;
                    const Vec3 n =
                        (beside.points[other[1]] - beside.points[other[0]]).cross(beside.points[other[2]] - beside.points[other[0]]);
                    const double from = n.dot(here.points[c] - beside.points[other[0]]),
                                 to = n.dot(here.points[d] - beside.points[other[0]]);
                    if (!(from > 0.0 && to < 0.0)) continue;
                    const Vec3 p = here.points[c] + from / (from - to) * (here.points[d] - here.points[c]);
                    bool within = true;
                    for (std::size_t e = 0; e < 3; ++e)
                        within =
                            within &&
                            n.dot((beside.points[other[(e + 1) % 3]] - beside.points[other[e]]).cross(p - beside.points[other[e]])) >= 0.0;
                    if (within) near.emplace_back(i, k);
                }
        }
    ASSERT_GT(near.size(), 10u);
    DeformingSpheres a, b;
    for (const std::uint64_t units : {0U, 1U, 2U, 3U, 7U, 20U, 50U, 130U, 400U, 1000U, 3000U, 100000U}) {
        a.begin(tree, SphereUpdate::Conservative, here.pose());
        b.begin(tree, SphereUpdate::Conservative, beside.pose());
        Descent descent;
        descent.begin(0.0);
        descent.add_solid_pair({Thing::body(1), &tree.tree, a.spheres(), &a}, {Thing::body(2), &tree.tree, b.spheres(), &b});
        WorkBudget budget(units);
        descent.run(budget);
        std::vector<Contact> contacts;
        descent.add_contacts(contacts);
        for (const auto& [i, k] : near)
            ASSERT_TRUE(std::any_of(contacts.begin(), contacts.end(),
                                    [&, i = i, k = k](const Contact& c) {
                                        const Index s = c.feature_a[0], t = c.feature_b[0];
                                        return rest.item_begin[s] <= i && i < rest.item_end[s] && rest.item_begin[t] <= k &&
                                               k < rest.item_end[t];
                                    }))
                << "budget " << units;
    }
}

} // namespace
} // namespace trocar::spheretree
