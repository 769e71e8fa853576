// Surfaces and one whole view for the tests of culling on OpenGL.
#pragma once

#include "assets/anatomy/random.hpp"
#include "collision/culling/chromatic_sets.hpp"
#include "collision/culling/cull_backend.hpp"
#include "collision/topology.hpp"

#include <vector>

namespace trocar::engine::test {

struct Cloth {
    std::vector<Vec3> t0, t1;
    collision::SurfaceTopology topology;
    [[nodiscard]] collision::SurfaceMotion motion() const { return {&topology, t0, t1}; }
    [[nodiscard]] std::vector<collision::SweptCorners> prisms() const {
        std::vector<collision::SweptCorners> all;
        for (const Triangle& t : topology.triangles) all.push_back({t0[t[0]], t0[t[1]], t0[t[2]], t1[t[0]], t1[t[1]], t1[t[2]]});
        return all;
    }
};

/// A sheet in four folds.
inline Cloth make_cloth(Index columns, Index rows, std::uint64_t seed) {
    anatomy::Random random(seed);
    Cloth cloth;
    const Index fold = columns / 4;
    for (Index y = 0; y <= rows; ++y)
        for (Index x = 0; x <= columns; ++x) {
            const double along = (x / fold) % 2 == 0 ? x % fold : fold - x % fold;
            cloth.t0.push_back(Vec3(along, y, 0.5 * (x / fold)) + 0.1 * random.cube());
            cloth.t1.push_back(cloth.t0.back() + 0.2 * random.cube());
        }
    std::vector<Triangle> triangles;
    for (Index y = 0; y < rows; ++y)
        for (Index x = 0; x < columns; ++x) {
            const Index a = y * (columns + 1) + x, b = a + 1, c = a + columns + 1, d = c + 1;
            triangles.push_back({a, b, c});
            triangles.push_back({b, d, c});
        }
    cloth.topology = collision::make_topology(triangles, cloth.t0.size());
    return cloth;
}

/// One view of everything: all prisms drawn, every prism queries every set.
struct WholeView {
    std::vector<collision::Footprint> footprints;
    std::vector<Index> set_begin{0}, members;
    std::vector<collision::CullQuestion> questions;
    std::vector<std::size_t> question_begin{0};
    collision::CullJob job;

    WholeView(std::span<const collision::SweptCorners> prisms, std::span<const Triangle> corners, const collision::ChromaticSets& sets,
              int axis, bool reversed, int size) {
        const auto frame = collision::make_cull_frame(collision::view_along_axis(axis, reversed), prisms, 0.01, size, size);
        for (const auto& prism : prisms) footprints.push_back(collision::make_footprint(frame, prism));
        for (Index set = 0; set < sets.count(); ++set) {
            for (const Index t : sets.set(set)) members.push_back(t);
            set_begin.push_back(static_cast<Index>(members.size()));
            for (Index prism = 0; prism < prisms.size(); ++prism) questions.push_back({prism, set});
            question_begin.push_back(questions.size());
        }
        job = {.width = size,
               .height = size,
               .footprints = footprints,
               .corners = corners,
               .set_begin = set_begin,
               .set_members = members,
               .questions = questions,
               .question_begin = question_begin};
    }
};

} // namespace trocar::engine::test
