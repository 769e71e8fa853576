// Pairs of triangles that touch, in the hardest configurations for image space: seen edge-on, smaller than a pixel, aligned with pixels and
// their corners, at equal depths, slivers, at the picture's borders; spread over more than 32 sets.
#pragma once

#include "collision/culling/cull_backend.hpp"

#include <numeric>
#include <vector>

namespace trocar::collision::testing {

struct HardPrisms {
    static constexpr Index kSets = 40;
    static constexpr double kReach = 1e-3; // m, half the distance
    std::vector<SweptCorners> prisms;
    std::vector<Triangle> corners; // no two share a vertex
    std::vector<std::pair<Index, Index>> touching;
    std::vector<Index> set_of, set_begin, members;
    std::vector<CullQuestion> questions; // each of a pair queries the other's set
    std::vector<std::size_t> question_begin;
    std::vector<Footprint> footprints;

    /// random  anything with real(from, to) and bits()
    template <class Random>
    HardPrisms(Random& random, const ViewDirection& view, int size, int pairs) {
        // two far corners fix the frame, so that what follows can be put onto its pixels
        for (const double end : {0.0, 1.0}) add(SweptCorners{}, end == 0.0 ? 0 : 1, Vec3::Constant(end));
        const CullFrame frame = make_cull_frame(view, prisms, kReach, size, size);
        for (int k = 0; k < pairs; ++k) {
            const double pixel = 1.0 / frame.pixels_x;
            Vec3 meet;
            for (double& x : meet) x = random.real(0.05, 0.95);
            if (k % 5 == 1) meet = on_pixel_corner(frame, meet);             // a shared corner of four pixels
            if (k % 5 == 2) meet[k / 5 % 3] = (k / 15) % 2 == 0 ? 0.0 : 1.0; // at a border
            const double extent = k % 4 == 0 ? 0.01 * pixel : k % 4 == 1 ? pixel : k % 4 == 2 ? 5.0 * pixel : 0.04; // m
            const Index first = static_cast<Index>(random.bits() % kSets), second = static_cast<Index>(random.bits() % kSets);
            Vec3 apart;
            for (double& x : apart) x = random.real(-1.0, 1.0);
            apart *= 1.999 * kReach * random.real(0.0, 1.0) / apart.norm();
            const auto a = add(shape(random, frame, meet, extent, k % 6), first, Vec3::Zero());
            const auto b = add(k % 7 == 3 ? prisms[a] : shape(random, frame, meet + apart, extent, (k / 6) % 6), second, Vec3::Zero());
            touching.emplace_back(a, b);
        }
        sort_into_sets();
        const CullFrame all = make_cull_frame(view, prisms, kReach, size, size);
        for (const SweptCorners& prism : prisms) footprints.push_back(make_footprint(all, prism));
    }

    [[nodiscard]] CullJob job(int size, CullMemory memory) const {
        return {.width = size,
                .height = size,
                .footprints = footprints,
                .corners = corners,
                .set_begin = set_begin,
                .set_members = members,
                .questions = questions,
                .question_begin = question_begin,
                .memory = memory};
    }

private:
    Index add(SweptCorners prism, Index set, const Vec3& move) {
        for (Vec3& p : prism) p += move;
        if (prisms.size() < 2) prism.fill(move);
        const auto id = static_cast<Index>(prisms.size());
        prisms.push_back(prism);
        corners.push_back({3 * id, 3 * id + 1, 3 * id + 2});
        set_of.push_back(set);
        return id;
    }

    static Vec3 on_pixel_corner(const CullFrame& f, const Vec3& p) {
        const double x = std::round((f.view.right.dot(p) - f.left) * f.pixels_x) / f.pixels_x + f.left;
        const double y = std::round((f.view.up.dot(p) - f.bottom) * f.pixels_y) / f.pixels_y + f.bottom;
        return x * f.view.right + y * f.view.up + f.view.forward.dot(p) * f.view.forward;
    }

    /// A triangle through the point, static or swept.
    template <class Random>
    static SweptCorners shape(Random& random, const CullFrame& f, const Vec3& point, double extent, int kind) {
        const ViewDirection& v = f.view;
        Vec3 e1 = extent * (random.real(-1, 1) * v.right + random.real(-1, 1) * v.up + random.real(-1, 1) * v.forward);
        Vec3 e2 = extent * (random.real(-1, 1) * v.right + random.real(-1, 1) * v.up + random.real(-1, 1) * v.forward);
        if (kind == 0) e2 = extent * v.forward;                                       // edge-on
        if (kind == 1) e1 = extent * v.forward, e2 = 0.3 * e1;                        // a line that is a point in the picture
        if (kind == 2) e1 = extent * v.right, e2 = extent * v.up;                     // flat: one depth everywhere
        if (kind == 3) e1 = 1.0 / f.pixels_x * v.right, e2 = 1.0 / f.pixels_y * v.up; // one pixel wide and high
        if (kind == 4) e2 = 1e-6 * e2 + e1;                                           // sliver
        const double s = random.bits() % 3 == 0 ? 0.0 : random.real(0.0, 0.5), t = random.bits() % 3 == 0 ? 0.0 : random.real(0.0, 0.5);
        const Vec3 a = point - s * e1 - t * e2;
        const Vec3 motion = random.bits() % 2 == 0 ? Vec3::Zero() : Vec3(extent * random.real(-1, 1) * v.right + extent * v.forward);
        return {a, a + e1, a + e2, a + motion, a + e1 + motion, a + e2 + motion};
    }

    void sort_into_sets() {
        set_begin.assign(kSets + 1, 0);
        question_begin.assign(1, 0);
        for (Index set = 0; set < kSets; ++set) {
            for (Index p = 0; p < prisms.size(); ++p)
                if (set_of[p] == set) members.push_back(p);
            set_begin[set + 1] = static_cast<Index>(members.size());
            for (Index p = 0; p < prisms.size(); ++p) questions.push_back({p, set});
            question_begin.push_back(questions.size());
        }
    }
};

/// How many pairs the answers would lose: neither may be free of the other's set.
inline std::size_t count_lost(const HardPrisms& hard, std::span<const std::uint8_t> hits) {
    std::size_t lost = 0;
    const std::size_t count = hard.prisms.size(); // questions are set by set, every prism once
    for (const auto& [a, b] : hard.touching)
        if (hard.set_of[a] != hard.set_of[b] || a != b)
            lost += hits[hard.set_of[b] * count + a] == 0 || hits[hard.set_of[a] * count + b] == 0;
    return lost;
}

} // namespace trocar::collision::testing
