#include "fem/embedding/link_kernels.hpp"

#include "fem/tissue/blocks.hpp"
#include "fem/embedding/link_frame.hpp"

#include <algorithm>
#include <array>
#include <limits>

#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/embedding/link_kernels.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

#include "fem/tissue/tet_lanes-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace trocar::fem {
namespace HWY_NAMESPACE {

#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX2

/// The operations of link_frame.hpp in their order, without fused multiply-adds.
HWY_INLINE V inner(const Axes& a, const Axes& b) { return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z)); }
HWY_INLINE Axes cross(const Axes& a, const Axes& b) {
    const auto minor = [](V p, V q, V r, V s) HWY_ATTR { return hn::Sub(hn::Mul(p, q), hn::Mul(r, s)); };
    return {minor(a.y, b.z, a.z, b.y), minor(a.z, b.x, a.x, b.z), minor(a.x, b.y, a.y, b.x)};
}
HWY_INLINE Axes times(const Axes& a, V s) { return {hn::Mul(a.x, s), hn::Mul(a.y, s), hn::Mul(a.z, s)}; }

/// Four numbers of one of the triangles in a vector of them.
HWY_INLINE hn::Vec<D4> row_of(const Rows& rows, std::size_t lane) {
#if HWY_TARGET == HWY_AVX3
    return lane < 4 ? hn::LowerHalf(D4(), rows.row[lane]) : hn::UpperHalf(D4(), rows.row[lane - 4]);
#else
    return rows.row[lane];
#endif
}

EmbeddedUpdateReport turn_range(const RigidLinks& links, const NodeRecord* nodes, LinkFrame* frames, std::size_t begin, std::size_t end) {
    const D4 d4;
    const auto three = hn::FirstN(d4, 3);
    EmbeddedUpdateReport report;
    for (std::size_t first = begin; first < end; first += kLanes) {
        const std::size_t count = std::min(kLanes, end - first);
        Index at[3][kLanes];
        for (std::size_t lane = 0; lane < kLanes; ++lane)
            for (std::size_t k = 0; k < 3; ++k)
                at[k][lane] = static_cast<Index>(sizeof(NodeRecord)) * links.frame_nodes[first + std::min(lane, count - 1)][k];
        const Rows origin = load_rows(nodes, at[0], false);
        const Axes e = turn(subtract(load_rows(nodes, at[1], false), origin)), f = turn(subtract(load_rows(nodes, at[2], false), origin));
        const Axes n = cross(e, f);
        const V e_sq = inner(e, e), n_sq = inner(n, n);
        const V least = hn::Mul(hn::Mul(set(kCollapsedSine * kCollapsedSine), e_sq), inner(f, f));
        const auto sound = hn::And(hn::Gt(n_sq, least), hn::Lt(n_sq, set(std::numeric_limits<double>::infinity())));
        const V one = set(1.0);
        const V per_n = hn::Div(one, hn::Sqrt(hn::IfThenElse(sound, n_sq, one))),
                per_e = hn::Div(one, hn::Sqrt(hn::IfThenElse(sound, e_sq, one)));
        const Rows axes[3] = {turn_back(times(n, per_n)), turn_back(times(e, per_e)), turn_back(times(cross(e, n), hn::Mul(per_n, per_e)))};
        alignas(64) double good[kLanes];
        hn::Store(hn::IfThenElseZero(sound, one), D8(), good);
        TROCAR_UNROLL for (std::size_t lane = 0; lane < kLanes; ++lane) {
            if (lane >= count) break;
            LinkFrame& frame = frames[first + lane];
            for (std::size_t k = 0; k < 3; ++k) hn::Store(hn::Load(d4, record_at(nodes, at[k][lane]).v), d4, frame.displacement[k]);
            if (good[lane] == 0.0) {
                report.note_collapsed(static_cast<Index>(first + lane));
                continue;
            }
            const double* rest = links.frame_rest[first + lane].data();
            for (int k = 0; k < 3; ++k)
                hn::Store(hn::Sub(row_of(axes[k], lane), hn::MaskedLoad(three, d4, rest + 3 * k)), d4, frame.turn[k]);
        }
    }
    return report;
}

void move_range(const RigidLinks& links, const LinkFrame* frames, bool leave_static, const Vec3* rest, Vec3* out, std::size_t begin,
                std::size_t end) {
    const D4 d4;
    const auto three = hn::FirstN(d4, 3);
    for (std::size_t v = begin; v < end; ++v) {
        const Index id = links.vertex_frame[v];
        if (id == kNoIndex) {
            if (!leave_static) out[v] = rest[v];
            continue;
        }
        const LinkFrame& frame = frames[id];
        const double *a = links.vertex_weight[v].data(), *r = links.vertex_projection[v].data();
        const auto part = [&](double factor, const double* column) HWY_ATTR { return hn::Mul(hn::Set(d4, factor), hn::Load(d4, column)); };
        const auto origin =
            hn::Add(hn::Add(part(a[0], frame.displacement[0]), part(a[1], frame.displacement[1])), part(a[2], frame.displacement[2]));
        const auto link = hn::Add(part(r[0], frame.turn[0]), hn::Add(part(r[1], frame.turn[1]), part(r[2], frame.turn[2])));
        const auto moved = hn::Mul(hn::Set(d4, links.vertex_blend[v]), hn::Add(origin, link));
        // Four numbers where three are meant: the fourth is the next vertex's first, rewritten in its own iteration. If that one is
        // static it becomes its rest position: the fourth numbers of all columns are 0.
        if (v + 1 < end) {
            hn::StoreU(hn::Add(hn::LoadU(d4, rest[v].data()), moved), d4, out[v].data());
            continue;
        }
        alignas(32) double last[4];
        hn::Store(hn::Add(hn::MaskedLoad(three, d4, rest[v].data()), moved), d4, last);
        std::copy_n(last, 3, out[v].data());
    }
}

#else // the scalar reference

EmbeddedUpdateReport turn_range(const RigidLinks& links, const NodeRecord* nodes, LinkFrame* frames, std::size_t begin, std::size_t end) {
    EmbeddedUpdateReport report;
    Mat3 axes;
    for (std::size_t k = begin; k < end; ++k) {
        const Triangle& q = links.frame_nodes[k];
        const auto at = [&](std::size_t i) { return Vec3(nodes[q[i]].x[0], nodes[q[i]].x[1], nodes[q[i]].x[2]); };
        for (std::size_t i = 0; i < 3; ++i) std::copy_n(nodes[q[i]].v, 4, frames[k].displacement[i]);
        if (!find_axes({at(0), at(1), at(2)}, axes)) {
            report.note_collapsed(static_cast<Index>(k));
            continue;
        }
        for (int column = 0; column < 3; ++column)
            for (int axis = 0; axis < 3; ++axis) frames[k].turn[column][axis] = axes(axis, column) - links.frame_rest[k](axis, column);
    }
    return report;
}

void move_range(const RigidLinks& links, const LinkFrame* frames, bool leave_static, const Vec3* rest, Vec3* out, std::size_t begin,
                std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) {
        const bool still = links.vertex_frame[v] == kNoIndex;
        if (!still || !leave_static) out[v] = rest[v];
        if (still) continue;
        const LinkFrame& frame = frames[links.vertex_frame[v]];
        const std::array<double, 3>& a = links.vertex_weight[v];
        const Vec3& r = links.vertex_projection[v];
        for (int i = 0; i < 3; ++i) {
            const double origin = a[0] * frame.displacement[0][i] + a[1] * frame.displacement[1][i] + a[2] * frame.displacement[2][i];
            const double link = r[0] * frame.turn[0][i] + (r[1] * frame.turn[1][i] + r[2] * frame.turn[2][i]);
            out[v][i] += links.vertex_blend[v] * (origin + link);
        }
    }
}

#endif

} // namespace HWY_NAMESPACE
} // namespace trocar::fem
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar::fem {

namespace {

HWY_EXPORT(turn_range);
HWY_EXPORT(move_range);

} // namespace

EmbeddedUpdateReport turn_link_frames(const RigidLinks& links, std::span<const NodeRecord> nodes, std::span<LinkFrame> frames,
                             unsigned threads) noexcept {
    const auto run = HWY_DYNAMIC_DISPATCH(turn_range);
    std::array<EmbeddedUpdateReport, kMostBlocks> found;
    const std::size_t blocks =
        for_each_block(frames.size(), threads, kLeastFrames, [&](std::size_t block, std::size_t begin, std::size_t end) {
            found[block] = run(links, nodes.data(), frames.data(), begin, end);
        });
    for (std::size_t k = 1; k < blocks; ++k) {
        found[0].collapsed_frames += found[k].collapsed_frames;
        found[0].first_collapsed = std::min(found[0].first_collapsed, found[k].first_collapsed);
    }
    return found[0];
}

void move_vertices(const RigidLinks& links, const LinkFrames& frames, std::span<const Vec3> rest, std::span<Vec3> out) noexcept {
    const auto run = HWY_DYNAMIC_DISPATCH(move_range);
    for_each_block(rest.size(), frames.threads, kLeastVertices, [&](std::size_t, std::size_t begin, std::size_t end) {
        run(links, frames.frame.data(), frames.leave_static, rest.data(), out.data(), begin, end);
    });
}

} // namespace trocar::fem
#endif
