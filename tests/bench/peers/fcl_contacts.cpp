// FCL: a refitted bounding volume hierarchy traversed against itself, its triangle pairs turned into feature pairs, and its own
// double-precision cubic for each. The cubic's absolute tolerances miss contacts of small meshes: its hits are beside ours, not equal.
// usage   fcl_contacts FOLDER [aabb|kdop18]
#include "peer_frames.hpp"

#include <fcl/math/bv/utility.h> // must come before BVH_model.h

#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/math/bv/AABB.h>
#include <fcl/math/bv/kDOP.h>
#include <fcl/narrowphase/detail/traversal/collision/bvh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision/intersect.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_continuous_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#include <fcl/narrowphase/detail/traversal/traversal_recurse.h>

#include <utility>

namespace {

using Vector = fcl::Vector3<double>;
using Pair = std::pair<peer::Id, peer::Id>;

template <class Bound>
struct PairCollector : fcl::detail::BVHCollisionTraversalNode<Bound> {
    mutable std::vector<Pair> pairs;
    void leafTesting(int a, int b) const override {
        if (a != b) pairs.emplace_back(this->model1->getBV(a).primitiveId(), this->model2->getBV(b).primitiveId());
    }
    bool canStop() const override { return false; }
};

Vector vector_of(const peer::Point& p) { return {p[0], p[1], p[2]}; }

std::vector<Vector> frame(const peer::Frames& frames, std::size_t k) {
    std::vector<Vector> out;
    for (std::size_t v = 0; v < frames.vertices; ++v) out.push_back(vector_of(frames.at(k, static_cast<peer::Id>(v))));
    return out;
}

void sort_once(std::vector<Pair>& pairs) {
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

/// Feature pairs of triangle pairs, each once, whose swept boxes overlap.
void expand(const peer::Frames& f, const peer::StepBoxes& boxes, const std::vector<Pair>& triangles, std::vector<Pair>& vertex_face,
            std::vector<Pair>& edge_edge) {
    const auto index = [](peer::Id id) { return static_cast<std::size_t>(id); };
    for (const auto& [a, b] : triangles) {
        for (const auto& [face, other] : {Pair{a, b}, Pair{b, a}})
            for (const peer::Id v : f.triangle[index(other)])
                if (!peer::holds(f.triangle[index(face)], v) && boxes.vertex[index(v)].overlaps(boxes.face[index(face)]))
                    vertex_face.emplace_back(v, face);
        for (peer::Id x : f.triangle_edges[index(a)])
            for (peer::Id y : f.triangle_edges[index(b)])
                if (x != y && !peer::share(f.edge[index(x)], f.edge[index(y)]) && boxes.edge[index(x)].overlaps(boxes.edge[index(y)]))
                    edge_edge.emplace_back(std::min(x, y), std::max(x, y));
    }
    sort_once(vertex_face);
    sort_once(edge_edge);
}

std::size_t count_hits(const peer::Frames& f, std::size_t step, const std::vector<Pair>& vertex_face, const std::vector<Pair>& edge_edge) {
    const auto begin = [&](peer::Id v) { return vector_of(f.at(step, v)); };
    const auto end = [&](peer::Id v) { return vector_of(f.at(step + 1, v)); };
    using Test = fcl::detail::Intersect<double>;
    std::size_t hits = 0;
    double time;
    Vector point;
    for (const auto& [v, face] : vertex_face) {
        const peer::Corners& t = f.triangle[static_cast<std::size_t>(face)];
        hits += Test::intersect_VF(begin(t[0]), begin(t[1]), begin(t[2]), begin(v), end(t[0]), end(t[1]), end(t[2]), end(v), &time, &point);
    }
    for (const auto& [x, y] : edge_edge) {
        const peer::Ends &a = f.edge[static_cast<std::size_t>(x)], &b = f.edge[static_cast<std::size_t>(y)];
        hits += Test::intersect_EE(begin(a[0]), begin(a[1]), begin(b[0]), begin(b[1]), end(a[0]), end(a[1]), end(b[0]), end(b[1]), &time,
                                   &point);
    }
    return hits;
}

template <class Bound>
void run(const peer::Frames& frames, const char* method) {
    fcl::BVHModel<Bound> model;
    std::vector<fcl::Triangle> triangles;
    for (const peer::Corners& t : frames.triangle)
        triangles.emplace_back(static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]), static_cast<std::size_t>(t[2]));
    model.beginModel(static_cast<int>(frames.triangles), static_cast<int>(frames.vertices));
    model.addSubModel(frame(frames, 0), triangles);
    model.endModel();
    peer::StepBoxes boxes;
    peer::Measured measured;
    for (std::size_t step = 0; step < frames.steps(); ++step) {
        const std::vector<Vector> next = frame(frames, step + 1);
        const double start = peer::now_ms();
        model.beginUpdateModel();
        model.updateSubModel(next);
        model.endUpdateModel(true, true);
        const double refitted = peer::now_ms();
        PairCollector<Bound> collector;
        collector.model1 = collector.model2 = &model;
        fcl::detail::selfCollisionRecurse<double>(&collector, 0, nullptr);
        boxes.fill(frames, step);
        std::vector<Pair> vertex_face, edge_edge;
        expand(frames, boxes, collector.pairs, vertex_face, edge_edge);
        const double found = peer::now_ms();
        const std::size_t hits = count_hits(frames, step, vertex_face, edge_edge);
        const double end = peer::now_ms();
        measured.refit.add(refitted - start);
        measured.broad.add(found - refitted);
        measured.narrow.add(end - found);
        measured.total.add(end - start);
        measured.candidates_vf.add(static_cast<double>(vertex_face.size()));
        measured.candidates_ee.add(static_cast<double>(edge_edge.size()));
        measured.hits.add(static_cast<double>(hits));
    }
    measured.print(method, true);
}

} // namespace

int main(int argc, char** argv) {
    if (argc < 2) return 2;
    const peer::Frames frames = peer::read_frames(argv[1]);
    if (argc > 2 && std::string(argv[2]) == "kdop18")
        run<fcl::KDOP<double, 18>>(frames, "fcl-kdop18-cubic");
    else
        run<fcl::AABB<double>>(frames, "fcl-aabb-cubic");
}
