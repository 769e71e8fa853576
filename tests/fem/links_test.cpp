#include "base/topology.hpp"
#include "fem/tissue/kernels.hpp"
#include "fem/embedding/links.hpp"
#include "fem/embedding/tet_locator.hpp"
#include "tests/fem/bodies.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace trocar::fem {

using namespace test;

namespace {

/// A finer copy of the bar's surface, pushed slightly off it.
TriMesh make_dense_surface(const TetMesh& coarse, int rounds) {
    TriMesh mesh = boundary_surface(coarse);
    for (int round = 0; round < rounds; ++round) {
        std::vector<Triangle> finer;
        for (const Triangle& t : mesh.triangles) {
            const auto centre = static_cast<Index>(mesh.vertices.size());
            mesh.vertices.push_back((mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]]) / 3.0);
            for (std::size_t k = 0; k < 3; ++k) finer.push_back({t[k], t[(k + 1) % 3], centre});
        }
        mesh.triangles = finer;
    }
    drop_unreferenced_vertices(mesh);
    std::mt19937_64 random(3);
    for (Vec3& v : mesh.vertices) v += random_vec(random, 0.0008);
    return mesh;
}

std::vector<Vec3> deform(const std::vector<Vec3>& rest, std::uint64_t seed, double size) {
    std::mt19937_64 random(seed);
    std::vector<Vec3> out = rest;
    for (Vec3& x : out) x += random_vec(random, size);
    return out;
}

std::vector<Vec3> steered(const RigidLinks& links, const std::vector<Vec3>& nodes, const std::vector<Vec3>& rest) {
    LinkFrames frames;
    std::vector<Vec3> out(rest.size());
    update_embedded_surface(links, nodes, rest, frames, out);
    return out;
}

struct Fixture {
    TetMesh coarse = make_bar(4, 3, 2, 0.01);
    TriMesh dense = make_dense_surface(coarse, 3);
    RigidLinks links = make_surface_links(coarse, dense).value();
};

} // namespace

TEST(Links, RestPoseIsReproducedExactly) {
    for (const Vec3& far : {Vec3(0, 0, 0), Vec3(1e4, -3e3, 77.0)}) {
        TetMesh coarse = make_bar(4, 3, 2, 0.01);
        TriMesh dense = make_dense_surface(coarse, 3);
        for (Vec3& v : coarse.vertices) v += far;
        for (Vec3& v : dense.vertices) v += far;
        const auto links = make_surface_links(coarse, dense);
        ASSERT_TRUE(links.ok());
        const auto out = steered(*links, coarse.vertices, dense.vertices);
        for (std::size_t v = 0; v < out.size(); ++v) ASSERT_EQ(out[v], dense.vertices[v]) << v;
    }
}

TEST(Links, FollowARigidMotionOfTheBody) {
    const Fixture f;
    const Mat3 turn = Eigen::AngleAxisd(2.5, Vec3(1, -2, 0.3).normalized()).matrix();
    auto nodes = f.coarse.vertices;
    for (Vec3& x : nodes) x = turn * x + Vec3(0.2, 0.1, -0.4);
    const auto out = steered(f.links, nodes, f.dense.vertices);
    for (std::size_t v = 0; v < out.size(); ++v) EXPECT_LT((out[v] - (turn * f.dense.vertices[v] + Vec3(0.2, 0.1, -0.4))).norm(), 1e-14);
}

TEST(Links, KeepTheirLengthWhateverTheBodyDoes) {
    const Fixture f;
    const auto nodes = deform(f.coarse.vertices, 5, 0.004);
    const auto out = steered(f.links, nodes, f.dense.vertices);
    for (std::size_t v = 0; v < out.size(); ++v) {
        const Triangle& q = f.links.frame_nodes[f.links.vertex_frame[v]];
        const auto& a = f.links.vertex_weight[v];
        const Vec3 origin = a[0] * nodes[q[0]] + a[1] * nodes[q[1]] + a[2] * nodes[q[2]];
        EXPECT_NEAR((out[v] - origin).norm(), f.links.vertex_projection[v].norm(), 1e-15) << v;
        EXPECT_NEAR(a[0] + a[1] + a[2], 1.0, 1e-15);
    }
}

TEST(Links, JacobianIsTheDerivativeOfTheUpdate) {
    const Fixture f;
    const auto nodes = deform(f.coarse.vertices, 6, 0.003);
    const double h = 1e-8;
    for (Index v = 0; v < f.dense.vertices.size(); v += 37) {
        const LinkJacobian jacobian = link_jacobian(f.links, v, nodes);
        for (int k = 0; k < 3; ++k)
            for (int axis = 0; axis < 3; ++axis) {
                auto above = nodes, below = nodes;
                above[jacobian.node[k]][axis] += h;
                below[jacobian.node[k]][axis] -= h;
                const Vec3 slope = (steered(f.links, above, f.dense.vertices)[v] - steered(f.links, below, f.dense.vertices)[v]) / (2 * h);
                EXPECT_LT((slope - jacobian.block[k].col(axis)).norm(), 1e-6) << v;
            }
    }
}

TEST(Links, TransposedForcesKeepLinearAndAngularMomentum) {
    const Fixture f;
    const auto nodes = deform(f.coarse.vertices, 7, 0.003);
    const auto out = steered(f.links, nodes, f.dense.vertices);
    std::mt19937_64 random(8);
    for (Index v = 0; v < out.size(); ++v) {
        const Vec3 force = random_vec(random, 1.0);
        const LinkForces spread = spread_link_force(f.links, v, nodes, force);
        Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
        for (int k = 0; k < 3; ++k) {
            sum += spread.force[k];
            moment += nodes[spread.node[k]].cross(spread.force[k]);
        }
        EXPECT_LT((sum - force).norm(), 1e-13);
        EXPECT_LT((moment - out[v].cross(force)).norm(), 1e-14);
    }
}

/// A fixture of which every fifth vertex follows a tetrahedron.
struct AffineFixture : Fixture {
    std::vector<Index> which;
    AffineFixture() {
        for (Index v = 0; v < dense.vertices.size(); v += 5) which.push_back(v);
        EXPECT_EQ(follow_tets(links, coarse.tets, dense.vertices, which), which.size());
        EXPECT_EQ(links.frame_count(), links.frame_nodes.size() + which.size());
    }
};

TEST(AffineLinks, ReproduceTheRestPoseExactlyAndEveryAffineMapOfTheBody) {
    const AffineFixture f;
    const auto at_rest = steered(f.links, f.coarse.vertices, f.dense.vertices);
    for (std::size_t v = 0; v < at_rest.size(); ++v) ASSERT_EQ(at_rest[v], f.dense.vertices[v]) << v;
    std::mt19937_64 random(11);
    for (int k = 0; k < 20; ++k) {
        Mat3 map;
        for (int c = 0; c < 3; ++c) map.col(c) = random_vec(random, 2.0); // turns, stretches, shears, and turns inside out
        const Vec3 shift = random_vec(random, 0.3);
        auto nodes = f.coarse.vertices;
        for (Vec3& x : nodes) x = map * x + shift;
        const auto out = steered(f.links, nodes, f.dense.vertices);
        for (const Index v : f.which) ASSERT_LT((out[v] - (map * f.dense.vertices[v] + shift)).norm(), 1e-13) << v;
    }
}

TEST(AffineLinks, TheirJacobianIsTheDerivativeAndTransposedForcesKeepBothMomenta) {
    const AffineFixture f;
    const auto nodes = deform(f.coarse.vertices, 7, 0.003);
    const auto out = steered(f.links, nodes, f.dense.vertices);
    std::mt19937_64 random(8);
    for (const Index v : f.which) {
        const LinkJacobian jacobian = link_jacobian(f.links, v, nodes);
        const Vec3 force = random_vec(random, 1.0);
        const LinkForces spread = spread_link_force(f.links, v, nodes, force);
        Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
        for (std::size_t k = 0; k < kMostLinkNodes; ++k) {
            ASSERT_NE(spread.node[k], kNoIndex);
            auto moved = nodes;
            const Vec3 by = random_vec(random, 0.01);
            moved[jacobian.node[k]] += by;
            EXPECT_LT((steered(f.links, moved, f.dense.vertices)[v] - out[v] - jacobian.block[k] * by).norm(), 1e-15);
            sum += spread.force[k];
            moment += nodes[spread.node[k]].cross(spread.force[k]);
        }
        EXPECT_LT((sum - force).norm(), 1e-13);
        EXPECT_LT((moment - out[v].cross(force)).norm(), 1e-14);
    }
}

TEST(AffineLinks, WhatTakesHoldOfAVertexPushesAllNodesItsOwnWay) {
    const AffineFixture f;
    const auto nodes = deform(f.coarse.vertices, 7, 0.003);
    const Vec3 force(0.3, -0.2, 0.7);
    std::size_t beside = 0;
    for (Index v = 0; v < f.dense.vertices.size(); ++v) {
        const LinkForces hold = spread_hold(f.links, v, nodes, force), spread = spread_link_force(f.links, v, nodes, force);
        const bool affine = f.links.is_affine(f.links.vertex_frame[v]);
        Vec3 sum = Vec3::Zero();
        for (std::size_t k = 0; k < kMostLinkNodes; ++k) {
            sum += hold.force[k];
            if (affine)
                EXPECT_GE(hold.force[k].dot(force), 0.0);
            else
                EXPECT_EQ(hold.force[k], spread.force[k]);
            beside += affine && spread.force[k].dot(force) < 0.0;
        }
        EXPECT_LT((sum - force).norm(), 1e-13);
    }
    EXPECT_GT(beside, 0u) << "some vertices lie beside their tetrahedra";
}

/// Contact finds the tetrahedron of a place from the nodes of its link: for a vertex that follows one, the same.
TEST(AffineLinks, OfTheTetrahedraAroundItsNodesAVertexFollowsTheOneBeneath) {
    Fixture f;
    std::mt19937_64 random(29);
    for (Vec3& v : f.dense.vertices) v += random_vec(random, 0.006); // more than half a cell, inwards and outwards
    std::vector<Index> all;
    for (Index v = 0; v < f.dense.vertices.size(); ++v) all.push_back(v);
    EXPECT_EQ(follow_tets(f.links, f.coarse.tets, f.dense.vertices, all), all.size());
    const NodeTets around(f.coarse.tets, f.coarse.vertices.size());
    for (const Index v : all) {
        const TetPlace there = find_tet_beneath(f.coarse.tets, f.coarse.vertices, around, f.links.nodes_of(f.links.vertex_frame[v]), f.dense.vertices[v]);
        ASSERT_NE(there.tet, kNoIndex);
        const std::span<const double> weights = f.links.weights_of(v);
        for (std::size_t k = 0; k < 4; ++k) ASSERT_EQ(there.weight[k], weights[k]) << v;
    }
}

TEST(AffineLinks, AVertexFollowsTheNearestTetrahedronAndOneTooFarOffKeepsItsLink) {
    Fixture f;
    const Vec3 low = Box3(boundary_surface(f.coarse).bounds()).lo;
    std::vector<Vec3> off = f.dense.vertices;
    for (const double away : {0.005, 0.2}) { // half a cell, and twenty, off the bar's corner
        RigidLinks links = f.links;
        Index corner = 0;
        for (Index v = 1; v < off.size(); ++v)
            if ((f.dense.vertices[v] - low).norm() < (f.dense.vertices[corner] - low).norm()) corner = v;
        off[corner] = low - Vec3::Constant(away);
        EXPECT_EQ(follow_tets(links, f.coarse.tets, off, std::vector<Index>{corner}), away < 0.1 ? 1u : 0u);
        EXPECT_EQ(links.is_affine(links.vertex_frame[corner]), away < 0.1);
        if (away > 0.1) continue;
        double best = -1e9; // of all tetrahedra, by brute force
        for (const Tet& t : f.coarse.tets) {
            const Vec3 x[4] = {f.coarse.vertices[t[0]], f.coarse.vertices[t[1]], f.coarse.vertices[t[2]], f.coarse.vertices[t[3]]};
            double w[4];
            if (find_affine(x, off[corner], w)) best = std::max(best, *std::min_element(w, w + 4));
        }
        const std::span<const double> weights = links.weights_of(corner);
        EXPECT_EQ(*std::min_element(weights.begin(), weights.end()), best);
    }
}

TEST(Links, CollapsedTriangleKeepsItsLastGoodFrameAndIsCounted) {
    const Fixture f;
    LinkFrames frames;
    std::vector<Vec3> before(f.dense.vertices.size()), after = before;
    auto nodes = deform(f.coarse.vertices, 9, 0.001);
    EXPECT_EQ(update_embedded_surface(f.links, nodes, f.dense.vertices, frames, before).collapsed_frames, 0U);
    for (Vec3& x : nodes) x = nodes[0]; // the whole body in one point
    const EmbeddedUpdateReport report = update_embedded_surface(f.links, nodes, f.dense.vertices, frames, after);
    EXPECT_EQ(report.collapsed_frames, f.links.frame_nodes.size());
    EXPECT_EQ(report.first_collapsed, 0U);
    for (std::size_t v = 0; v < after.size(); ++v) {
        ASSERT_TRUE(is_finite(after[v]));
        EXPECT_NEAR((after[v] - nodes[0]).norm(), f.links.vertex_projection[v].norm(), 1e-14);
    }
    nodes[0][0] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(update_embedded_surface(f.links, nodes, f.dense.vertices, frames, after).collapsed_frames, f.links.frame_nodes.size());
}

TEST(Links, StaticVerticesAreLeftAloneWhereAskedAndTheHalvesAreTheWhole) {
    Fixture f;
    for (std::size_t v = 0; v < f.links.vertex_count(); v += 3) f.links.vertex_frame[v] = kNoIndex, f.links.vertex_blend[v] = 0.0;
    const auto nodes = deform(f.coarse.vertices, 23, 0.001);
    const std::vector<Vec3> whole = steered(f.links, nodes, f.dense.vertices);
    for (const char* isa : {"portable", "avx2", "avx512"}) {
        if (!choose_isa(isa)) continue;
        LinkFrames frames;
        frames.leave_static = true;
        std::vector<Vec3> held = f.dense.vertices, marked(held.size(), Vec3(7.0, 8.0, 9.0));
        EXPECT_EQ(turn_frames(f.links, nodes, frames).collapsed_frames, 0u);
        place_vertices(f.links, frames, f.dense.vertices, held);
        place_vertices(f.links, frames, f.dense.vertices, marked);
        choose_isa("");
        for (std::size_t v = 0; v < held.size(); ++v) {
            ASSERT_EQ(held[v], whole[v]) << isa << ", vertex " << v;
            if (v % 3 == 0) {
                ASSERT_EQ(marked[v].tail<2>(), (Vec3(7.0, 8.0, 9.0).tail<2>())) << isa << ", vertex " << v;
            } else {
                ASSERT_EQ(marked[v], whole[v]) << isa << ", vertex " << v;
            }
        }
    }
}

TEST(Links, TheUpdateHasTheSameBitsOnEveryInstructionSetAndThreadCount) {
    const TetMesh coarse = make_bar(13, 11, 9, 0.01);
    const TriMesh dense = make_dense_surface(coarse, 2); // some 7,000 vertices on more than 512 triangles: several blocks
    RigidLinks links = make_surface_links(coarse, dense).value();
    for (std::size_t v = 0; v < links.vertex_count(); v += 5) links.vertex_blend[v] = 0.3;
    for (std::size_t v = 0; v < links.vertex_count(); v += 7) links.vertex_frame[v] = kNoIndex;
    auto nodes = deform(coarse.vertices, 17, 0.002);
    for (const std::size_t frame : {std::size_t{3}, std::size_t{700}}) // and two that have no area
        for (const Index node : links.frame_nodes[frame]) nodes[node] = nodes[links.frame_nodes[frame][0]];
    struct Steered {
        std::vector<Vec3> out;
        EmbeddedUpdateReport report;
    };
    const auto run = [&](const char* isa, unsigned threads) {
        choose_isa(isa);
        LinkFrames frames;
        frames.threads = threads;
        std::vector<Vec3> out(dense.vertices.size());
        (void)update_embedded_surface(links, coarse.vertices, dense.vertices, frames, out);
        for (std::size_t v = 0; v < out.size(); ++v) EXPECT_EQ(out[v], dense.vertices[v]) << isa;
        const EmbeddedUpdateReport report = update_embedded_surface(links, nodes, dense.vertices, frames, out);
        choose_isa("");
        return Steered{out, report};
    };
    const Steered twin = run("portable", 1);
    EXPECT_GE(twin.report.collapsed_frames, 2U);
    for (const char* isa : {"portable", "avx2", "avx512"}) {
        if (!choose_isa(isa)) continue;
        for (const unsigned threads : {1U, 3U}) {
            const Steered other = run(isa, threads);
            EXPECT_EQ(other.report.collapsed_frames, twin.report.collapsed_frames) << isa;
            EXPECT_EQ(other.report.first_collapsed, twin.report.first_collapsed) << isa;
            for (std::size_t v = 0; v < other.out.size(); ++v) ASSERT_EQ(other.out[v], twin.out[v]) << isa << ", vertex " << v;
        }
    }
    choose_isa("");
}

TEST(Links, CollinearNearestNodesAreWidenedAndCounted) {
    // On a lattice the nodes nearest to an edge's middle lie on that edge.
    const TetMesh coarse = make_bar(4, 1, 1, 0.01);
    TriMesh dense;
    dense.vertices = {Vec3(0.02, 0, 0), Vec3(0.0201, 0.0001, 0), Vec3(0.02, 0.0001, 0.0001)};
    dense.triangles = {{0, 2, 1}};
    const auto links = make_surface_links(coarse, dense);
    ASSERT_TRUE(links.ok());
    EXPECT_GT(links->degenerate, 0U);
    EXPECT_EQ(links->static_count, 0U);
    EXPECT_EQ(links->vertex_weight[0][0] + links->vertex_weight[0][1] + links->vertex_weight[0][2], 1.0);
    double most = 0.0;
    for (const double a : links->vertex_weight[0]) most = std::max(most, a);
    EXPECT_EQ(most, 1.0) << "a vertex on a node is embedded in it alone";
}

TEST(Links, StayOnTheirOwnSheetOfAThinFold) {
    // Two flat bars 0.4 mm apart; the dense surface of the lower one is nearer to the upper one at places.
    TetMesh coarse = make_bar(4, 4, 1, 0.01);
    const auto lower_count = static_cast<Index>(coarse.vertices.size());
    const std::size_t lower_tets = coarse.tets.size();
    for (Index v = 0; v < lower_count; ++v) coarse.vertices.push_back(coarse.vertices[v] + Vec3(0, 0, 0.0104));
    for (std::size_t t = 0; t < lower_tets; ++t) {
        Tet tet = coarse.tets[t];
        for (Index& node : tet) node += lower_count;
        coarse.tets.push_back(tet);
    }
    TriMesh dense; // faces up, belongs to the lower sheet, sags 0.3 mm towards the upper one
    dense.vertices = {Vec3(0.012, 0.012, 0.0103), Vec3(0.024, 0.013, 0.0103), Vec3(0.017, 0.026, 0.0103)};
    dense.triangles = {{0, 1, 2}};
    const auto links = make_surface_links(coarse, dense);
    ASSERT_TRUE(links.ok());
    for (const Index frame : links->vertex_frame)
        for (const Index node : links->frame_nodes[frame]) EXPECT_LT(node, lower_count);
}

TEST(EmbeddedLinks, InsideAreEmbeddedInAFaceOfTheirTetAndFollowTheStrain) {
    const TetMesh coarse = make_bar(4, 4, 4, 0.01);
    std::mt19937_64 random(10);
    std::vector<Vec3> inside;
    for (int i = 0; i < 500; ++i) inside.push_back(Vec3(0.02, 0.02, 0.02) + random_vec(random, 0.0199));
    const auto links = make_embedded_links(coarse, inside, 0.01);
    ASSERT_TRUE(links.ok());
    EXPECT_EQ(links->static_count, 0U);
    EXPECT_LT(links->max_length, 0.004);
    EXPECT_EQ(links->long_count, 0U);
    const TetLocator locator(coarse);
    for (Index v = 0; v < inside.size(); ++v) {
        const Tet& tet = coarse.tets[locator.find(inside[v])];
        for (const Index node : links->frame_nodes[links->vertex_frame[v]]) EXPECT_NE(std::find(tet.begin(), tet.end(), node), tet.end());
    }
    Mat3 strain;
    strain << 1.05, 0.02, 0, 0, 0.97, 0.01, 0.01, 0, 1.02;
    auto nodes = coarse.vertices;
    for (Vec3& x : nodes) x = strain * x;
    const auto out = steered(*links, nodes, inside);
    for (std::size_t v = 0; v < inside.size(); ++v) // only the change of R itself, strain times |R|, is not followed
        EXPECT_LT((out[v] - strain * inside[v]).norm(), 0.1 * links->vertex_projection[v].norm() + 1e-15);
}

TEST(EmbeddedLinks, BlendFallsWithoutAJumpFromTheSurfaceToStatic) {
    const TetMesh coarse = make_bar(4, 4, 4, 0.01);
    std::vector<Vec3> line;
    for (int i = 0; i <= 4000; ++i) line.push_back(Vec3(0.0217 + 1e-5 * i, 0.0171, 0.0193));
    const auto links = make_embedded_links(coarse, line, 0.012);
    ASSERT_TRUE(links.ok());
    for (std::size_t i = 0; i < line.size(); ++i) {
        const double outside = line[i][0] - 0.04;
        if (outside <= 0.0) {
            EXPECT_EQ(links->vertex_blend[i], 1.0);
        }
        if (outside >= 0.012) {
            EXPECT_EQ(links->vertex_blend[i], 0.0);
        }
        if (i > 0) {
            EXPECT_LT(std::abs(links->vertex_blend[i] - links->vertex_blend[i - 1]), 1.6e-5 / 0.012);
        }
    }
    EXPECT_GT(links->static_count, 900U);
    auto nodes = coarse.vertices; // the smooth motion of a breathing organ
    for (Vec3& x : nodes) x += Vec3(0.001, 0.008 + 0.05 * x[0], -0.003 + 0.04 * x[1]);
    const auto out = steered(*links, nodes, line);
    double jump = 0.0;
    for (std::size_t i = 1; i < out.size(); ++i) jump = std::max(jump, (out[i] - out[i - 1] - (line[i] - line[i - 1])).norm());
    EXPECT_LT(jump, 0.0004) << "links change faces, each off by strain times its length";
    EXPECT_EQ(out.back(), line.back());
}

TEST(EmbeddedLinks, WithoutABlendEverythingOutsideIsStatic) {
    const TetMesh coarse = make_bar(2, 2, 2, 0.01);
    const std::vector<Vec3> points = {Vec3(0.01, 0.01, 0.01), Vec3(0.02, 0.013, 0.007), Vec3(0.0201, 0.013, 0.007), Vec3(5, 5, 5)};
    const auto links = make_embedded_links(coarse, points, 0.0);
    ASSERT_TRUE(links.ok());
    EXPECT_EQ(links->vertex_blend, (std::vector<double>{1.0, 1.0, 0.0, 0.0}));
    const LinkJacobian none = link_jacobian(*links, 3, coarse.vertices);
    EXPECT_EQ(none.node[0], kNoIndex);
}

TEST(EmbeddedLinks, RefuseWhatIsNotFinite) {
    const TetMesh coarse = make_bar(1, 1, 1, 0.01);
    const std::vector<Vec3> points = {Vec3(0, 0, std::numeric_limits<double>::quiet_NaN())};
    EXPECT_EQ(make_embedded_links(coarse, points, 0.0).error().message, "vertex 0 is not finite");
    EXPECT_FALSE(make_embedded_links(coarse, {}, -1.0).ok());
    EXPECT_FALSE(make_embedded_links(TetMesh{}, {}, 0.0).ok());
}

TEST(TetLocator, FindsTheTetOfEveryPointAsBruteForceDoes) {
    const TetMesh mesh = make_bar(3, 5, 2, 0.01);
    const TetLocator locator(mesh);
    std::mt19937_64 random(15);
    for (int i = 0; i < 3000; ++i) {
        const Vec3 p = Vec3(0.015, 0.025, 0.01) + random_vec(random, 0.03);
        Index expected = kNoIndex;
        for (Index tet = 0; tet < mesh.tets.size() && expected == kNoIndex; ++tet) {
            Mat3 edges;
            const Tet& t = mesh.tets[tet];
            for (int k = 0; k < 3; ++k) edges.col(k) = mesh.vertices[t[static_cast<std::size_t>(k) + 1]] - mesh.vertices[t[0]];
            const Vec3 b = edges.inverse() * (p - mesh.vertices[t[0]]);
            if (b.minCoeff() >= 0.0 && b.sum() <= 1.0) expected = tet;
        }
        ASSERT_EQ(locator.find(p), expected);
    }
}

} // namespace trocar::fem
