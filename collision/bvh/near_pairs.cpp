#include "collision/bvh/near_pairs.hpp"

#include "collision/bvh/dop_tree.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/bvh/near_pairs.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace trocar::collision {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kBlock = 16;
constexpr std::size_t kMostInRun = DopTree::kMaxClusterSize; // triangles; three times as many edges

using Floats = hn::CappedTag<float, kBlock>;
using Ids = hn::RebindToUnsigned<Floats>;
using Vec = hn::Vec<Floats>;
using LaneMask = hn::Mask<Floats>;

/// Lanes of one register as bits.
HWY_INLINE std::uint32_t bits_of(Floats d, LaneMask mask) {
#if HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
    if constexpr (sizeof(mask.raw) == 2) return static_cast<std::uint32_t>(mask.raw);
#endif
    HWY_ALIGN std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8;
}

/// Lanes farther from one box than the distance. box: lo at [s * stride], minus_hi at [(s + Slabs) * stride]; rows: the same of
/// the lanes' boxes, a row every `pitch` floats.
template <std::size_t Slabs>
HWY_INLINE LaneMask apart_lanes(const float* box, std::size_t stride, const float* rows, std::size_t pitch, const float* distance) {
    const Floats d;
    LaneMask apart = hn::FirstN(d, 0);
    for (std::size_t s = 0; s < Slabs; ++s) {
        const Vec limit = hn::Set(d, distance[s]);
        const Vec lo = hn::LoadU(d, rows + s * pitch), minus_hi = hn::LoadU(d, rows + (s + Slabs) * pitch);
        const Vec above = hn::Add(hn::Set(d, box[s * stride]), minus_hi), below = hn::Add(hn::Set(d, box[(s + Slabs) * stride]), lo);
        apart = hn::Or(apart, hn::Or(hn::Gt(above, limit), hn::Gt(below, limit)));
        if (s == 2 && Slabs > 3 && hn::AllTrue(d, apart)) break;
    }
    return apart;
}

/// Lanes of a block of 16 that are not farther from one box than the distance.
template <std::size_t Slabs>
HWY_INLINE std::uint32_t near_lanes(const float* box, std::size_t stride, const float* rows, std::size_t pitch, const float* distance) {
    const Floats d;
    std::uint32_t apart = 0;
    for (std::size_t first = 0; first < kBlock; first += hn::Lanes(d))
        apart |= bits_of(d, apart_lanes<Slabs>(box, stride, rows + first, pitch, distance)) << first;
    return ~apart;
}

/// Lanes whose features hold the vertex.
HWY_INLINE std::uint32_t holding_lanes(Index vertex, const Index* corners, std::size_t pitch, int corner_count) {
    const Ids d;
    std::uint32_t holding = 0;
    const auto wanted = hn::Set(d, vertex);
    for (std::size_t first = 0; first < kBlock; first += hn::Lanes(d)) {
        auto same = hn::Eq(wanted, hn::LoadU(d, corners + first));
        for (int k = 1; k < corner_count; ++k)
            same = hn::Or(same, hn::Eq(wanted, hn::LoadU(d, corners + static_cast<std::size_t>(k) * pitch + first)));
        holding |= bits_of(Floats(), hn::RebindMask(Floats(), same)) << first;
    }
    return holding;
}

HWY_INLINE std::uint32_t filled_lanes(Index count, std::size_t block) {
    const std::size_t left = count - block * kBlock;
    return left >= kBlock ? 0xffffu : (1u << left) - 1u;
}

/// Features of one run, side by side; what is beyond `count` is not read.
struct Gathered {
    static constexpr std::size_t kPitch = 3 * kMostInRun + kBlock; // the last store may run over
    float* rows;                                                   // [2 slabs][kPitch]
    Index* ids;                                                    // [kPitch]
    Index* corners;                                                // [corner_count][kPitch]
    Index count = 0;
};

/// Those of a run that come near a box, in their order. Compressed in a register and stored whole: a compressing store to memory is
/// microcode on some processors (twice the time of an entire search on Zen 4).
template <std::size_t Slabs>
HWY_INLINE void gather_near(const float* box, const BlockRun& run, const NearTest& test, Gathered& out) {
    const Floats d;
    const Ids di;
    for (std::size_t at = 0; at < run.count; at += hn::Lanes(d)) {
        const std::size_t block = at / kBlock, first = at % kBlock;
        const float* rows = run.bounds + block * 2 * Slabs * kBlock + first;
        const LaneMask near = hn::And(hn::Not(apart_lanes<Slabs>(box, 1, rows, kBlock, test.distance)), hn::FirstN(d, run.count - at));
        const std::size_t found = hn::CountTrue(d, near);
        if (found == 0) continue;
        for (std::size_t r = 0; r < 2 * Slabs; ++r)
            hn::StoreU(hn::Compress(hn::LoadU(d, rows + r * kBlock), near), d, out.rows + r * Gathered::kPitch + out.count);
        const auto same = hn::RebindMask(di, near);
        hn::StoreU(hn::Compress(hn::LoadU(di, run.ids + at), same), di, out.ids + out.count);
        if (test.skip_shared)
            for (int k = 0; k < run.corner_count; ++k) {
                const auto row = static_cast<std::size_t>(k);
                hn::StoreU(hn::Compress(hn::LoadU(di, run.corners + (block * 3 + row) * kBlock + first), same), di,
                           out.corners + row * Gathered::kPitch + out.count);
            }
        out.count += static_cast<Index>(found);
    }
}

/// A run against itself.
template <std::size_t Slabs>
HWY_INLINE std::size_t near_pairs_within(const BlockRun& run, const NearTest& test, FeaturePair* out) {
    const FeaturePair* const begin = out;
    constexpr std::size_t kStride = 2 * Slabs * kBlock;
    for (std::size_t i = 0; i < run.count; ++i) {
        const std::size_t block_a = i / kBlock, lane = i % kBlock;
        for (std::size_t block_b = block_a; block_b * kBlock < run.count; ++block_b) {
            std::uint32_t near =
                near_lanes<Slabs>(run.bounds + block_a * kStride + lane, kBlock, run.bounds + block_b * kStride, kBlock, test.distance) &
                filled_lanes(run.count, block_b);
            if (block_b == block_a) near &= ~((2u << lane) - 1u);
            if (near == 0) continue;
            if (test.skip_shared)
                for (int k = 0; k < run.corner_count; ++k)
                    near &= ~holding_lanes(run.corners[(block_a * 3 + static_cast<std::size_t>(k)) * kBlock + lane],
                                           run.corners + block_b * 3 * kBlock, kBlock, run.corner_count);
            for (; near != 0; near &= near - 1)
                *out++ = {run.ids[i], run.ids[block_b * kBlock + static_cast<std::size_t>(__builtin_ctz(near))]};
        }
    }
    return static_cast<std::size_t>(out - begin);
}

/// Two runs: first what of b comes near a's box at all, and of a near b's, then pair by pair. Between neighbours on a surface
/// little is left for the last loop.
template <std::size_t Slabs>
HWY_INLINE std::size_t near_pairs_of(const BlockRun& a, const BlockRun& b, const NearTest& test, FeaturePair* out) {
    if (test.same_run) return near_pairs_within<Slabs>(a, test, out);
    const FeaturePair* const begin = out;
    constexpr std::size_t kStride = 2 * Slabs * kBlock;
    HWY_ALIGN float rows[2 * Slabs * Gathered::kPitch]; // left uninitialised
    HWY_ALIGN Index ids[Gathered::kPitch], corners[3 * Gathered::kPitch];
    Gathered near_b{rows, ids, corners};
    gather_near<Slabs>(test.box_a, b, test, near_b);
    if (near_b.count == 0) return 0;
    for (std::size_t block_a = 0; block_a * kBlock < a.count; ++block_a) {
        const float* bounds_a = a.bounds + block_a * kStride;
        std::uint32_t lanes = near_lanes<Slabs>(test.box_b, 1, bounds_a, kBlock, test.distance) & filled_lanes(a.count, block_a);
        for (; lanes != 0; lanes &= lanes - 1) {
            const auto lane = static_cast<std::size_t>(__builtin_ctz(lanes));
            const Index id_a = a.ids[block_a * kBlock + lane];
            for (std::size_t at = 0; at < near_b.count; at += kBlock) {
                std::uint32_t near = near_lanes<Slabs>(bounds_a + lane, kBlock, rows + at, Gathered::kPitch, test.distance) &
                                     filled_lanes(near_b.count, at / kBlock);
                if (near == 0) continue;
                if (test.skip_shared)
                    for (int k = 0; k < a.corner_count; ++k)
                        near &= ~holding_lanes(a.corners[(block_a * 3 + static_cast<std::size_t>(k)) * kBlock + lane], corners + at,
                                               Gathered::kPitch, b.corner_count);
                for (; near != 0; near &= near - 1) *out++ = {id_a, ids[at + static_cast<std::size_t>(__builtin_ctz(near))]};
            }
        }
    }
    return static_cast<std::size_t>(out - begin);
}

std::size_t near_pairs(const BlockRun& a, const BlockRun& b, const NearTest& test, FeaturePair* out) {
    if (test.slabs == 3) return near_pairs_of<3>(a, b, test, out);
    if (test.slabs == 7) return near_pairs_of<7>(a, b, test, out);
    if (test.slabs == 9) return near_pairs_of<9>(a, b, test, out);
    return near_pairs_of<13>(a, b, test, out);
}

template <std::size_t Arity>
HWY_INLINE std::uint32_t near_children_of(const float* box, std::size_t stride, const float* children, std::size_t slabs,
                                          const float* distance) {
    const hn::CappedTag<float, Arity> d;
    std::uint32_t near = 0;
    for (std::size_t first = 0; first < Arity; first += hn::Lanes(d)) {
        auto apart = hn::FirstN(d, 0);
        for (std::size_t s = 0; s < slabs; ++s) {
            const auto limit = hn::Set(d, distance[s]);
            const auto lo = hn::LoadU(d, children + s * Arity + first), minus_hi = hn::LoadU(d, children + (s + slabs) * Arity + first);
            const auto above = hn::Add(hn::Set(d, box[s * stride]), minus_hi), below = hn::Add(hn::Set(d, box[(s + slabs) * stride]), lo);
            apart = hn::Or(apart, hn::Or(hn::Gt(above, limit), hn::Gt(below, limit)));
        }
        HWY_ALIGN std::uint8_t bytes[8] = {};
        hn::StoreMaskBits(d, hn::Not(apart), bytes);
        near |= (static_cast<std::uint32_t>(bytes[0]) & ((1u << hn::Lanes(d)) - 1u)) << first;
    }
    return near;
}

std::uint32_t near_children(const float* box, std::size_t stride, const float* children, std::size_t arity, std::size_t slabs,
                            const float* distance) {
    if (arity == 8) return near_children_of<8>(box, stride, children, slabs, distance);
    if (arity == 4) return near_children_of<4>(box, stride, children, slabs, distance);
    return near_children_of<2>(box, stride, children, slabs, distance);
}

std::uint32_t near_features(const float* box, const float* block, std::size_t slabs, const float* distance) {
    if (slabs == 3) return near_lanes<3>(box, 1, block, kBlock, distance) & 0xffffu;
    if (slabs == 7) return near_lanes<7>(box, 1, block, kBlock, distance) & 0xffffu;
    if (slabs == 9) return near_lanes<9>(box, 1, block, kBlock, distance) & 0xffffu;
    return near_lanes<13>(box, 1, block, kBlock, distance) & 0xffffu;
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

} // namespace HWY_NAMESPACE
} // namespace trocar::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace trocar::collision {

HWY_EXPORT(near_pairs);
HWY_EXPORT(near_children);
HWY_EXPORT(near_features);
HWY_EXPORT(target_name);

std::size_t near_pairs(const BlockRun& a, const BlockRun& b, const NearTest& test, FeaturePair* out) noexcept {
    return HWY_DYNAMIC_DISPATCH(near_pairs)(a, b, test, out);
}

std::uint32_t near_children(const float* box, std::size_t box_stride, const float* children, std::size_t arity, std::size_t slabs,
                            const float* distance) noexcept {
    return HWY_DYNAMIC_DISPATCH(near_children)(box, box_stride, children, arity, slabs, distance);
}

std::uint32_t near_features(const float* box, const float* block, std::size_t slabs, const float* distance) noexcept {
    return HWY_DYNAMIC_DISPATCH(near_features)(box, block, slabs, distance);
}

const char* near_pairs_target() noexcept { return HWY_DYNAMIC_DISPATCH(target_name)(); }

namespace {

/// The same sums and comparisons; what compares false, NaN included, is near.
bool is_near(const float* a, std::size_t stride_a, const float* b, std::size_t stride_b, std::size_t slabs,
             const float* distance) noexcept {
    for (std::size_t s = 0; s < slabs; ++s)
        if (a[s * stride_a] + b[(s + slabs) * stride_b] > distance[s] || a[(s + slabs) * stride_a] + b[s * stride_b] > distance[s])
            return false;
    return true;
}

} // namespace

std::size_t near_pairs_plain(const BlockRun& a, const BlockRun& b, const NearTest& test, FeaturePair* out) noexcept {
    constexpr std::size_t kBlock = 16;
    const FeaturePair* const begin = out;
    const std::size_t stride = 2 * test.slabs * kBlock;
    const auto corner = [](const BlockRun& run, std::size_t i, int k) {
        return run.corners[(i / kBlock * 3 + static_cast<std::size_t>(k)) * kBlock + i % kBlock];
    };
    const auto share = [&](std::size_t i, std::size_t k) {
        for (int x = 0; x < a.corner_count; ++x)
            for (int y = 0; y < b.corner_count; ++y)
                if (corner(a, i, x) == corner(b, k, y)) return true;
        return false;
    };
    for (std::size_t i = 0; i < a.count; ++i) {
        const float* bounds_a = a.bounds + i / kBlock * stride + i % kBlock;
        if (!is_near(test.box_b, 1, bounds_a, kBlock, test.slabs, test.distance)) continue;
        for (std::size_t k = test.same_run ? i + 1 : 0; k < b.count; ++k) {
            const float* bounds_b = b.bounds + k / kBlock * stride + k % kBlock;
            if (!is_near(bounds_a, kBlock, bounds_b, kBlock, test.slabs, test.distance) || (test.skip_shared && share(i, k))) continue;
            *out++ = {a.ids[i], b.ids[k]};
        }
    }
    return static_cast<std::size_t>(out - begin);
}

std::uint32_t near_children_plain(const float* box, std::size_t box_stride, const float* children, std::size_t arity, std::size_t slabs,
                                  const float* distance) noexcept {
    std::uint32_t near = 0;
    for (std::size_t i = 0; i < arity; ++i)
        if (is_near(box, box_stride, children + i, arity, slabs, distance)) near |= 1u << i;
    return near;
}

std::uint32_t near_features_plain(const float* box, const float* block, std::size_t slabs, const float* distance) noexcept {
    std::uint32_t near = 0;
    for (std::size_t i = 0; i < 16; ++i)
        if (is_near(box, 1, block + i, 16, slabs, distance)) near |= 1u << i;
    return near;
}

} // namespace trocar::collision
#endif
