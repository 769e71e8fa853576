#include "collision/near_pairs.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "collision/near_pairs.cpp"
#include <hwy/foreach_target.h> // translates this file once more for every instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace seldinger::collision {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kBlock = 16;

using Floats = hn::CappedTag<float, kBlock>;
using Ids = hn::RebindToUnsigned<Floats>;
using Vec = hn::Vec<Floats>;
using LaneMask = hn::Mask<Floats>;

/// Lanes of one register as bits.
HWY_INLINE std::uint32_t bits_of(Floats d, LaneMask mask) {
    HWY_ALIGN std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, mask, bytes);
    return static_cast<std::uint32_t>(bytes[0]) | static_cast<std::uint32_t>(bytes[1]) << 8;
}

/// Lanes of a block that are not farther from one box than the distance. box: lo at [s * stride], minus_hi at [(s + Slabs) * stride].
template <std::size_t Slabs>
HWY_INLINE std::uint32_t near_lanes(const float* box, std::size_t stride, const float* block, const float* distance) {
    const Floats d;
    std::uint32_t apart_bits = 0;
    for (std::size_t first = 0; first < kBlock; first += hn::Lanes(d)) {
        LaneMask apart = hn::FirstN(d, 0);
        for (std::size_t s = 0; s < Slabs; ++s) {
            const Vec limit = hn::Set(d, distance[s]);
            const Vec lo = hn::LoadU(d, block + s * kBlock + first), minus_hi = hn::LoadU(d, block + (s + Slabs) * kBlock + first);
            const Vec above = hn::Add(hn::Set(d, box[s * stride]), minus_hi), below = hn::Add(hn::Set(d, box[(s + Slabs) * stride]), lo);
            apart = hn::Or(apart, hn::Or(hn::Gt(above, limit), hn::Gt(below, limit)));
            if (s == 2 && Slabs > 3 && hn::AllTrue(d, apart)) break;
        }
        apart_bits |= bits_of(d, apart) << first;
    }
    return ~apart_bits;
}

/// Lanes whose features hold the vertex.
HWY_INLINE std::uint32_t holding_lanes(Index vertex, const Index* corners, int corner_count) {
    const Ids d;
    std::uint32_t holding = 0;
    const auto wanted = hn::Set(d, vertex);
    for (std::size_t first = 0; first < kBlock; first += hn::Lanes(d)) {
        auto same = hn::Eq(wanted, hn::LoadU(d, corners + first));
        for (int k = 1; k < corner_count; ++k) same = hn::Or(same, hn::Eq(wanted, hn::LoadU(d, corners + static_cast<std::size_t>(k) * kBlock + first)));
        holding |= bits_of(Floats(), hn::RebindMask(Floats(), same)) << first;
    }
    return holding;
}

HWY_INLINE std::uint32_t filled_lanes(Index count, std::size_t block) {
    const std::size_t left = count - block * kBlock;
    return left >= kBlock ? 0xffffu : (1u << left) - 1u;
}

template <std::size_t Slabs>
HWY_INLINE std::size_t near_pairs_of(const BlockRun& a, const BlockRun& b, const NearTest& test, FeaturePair* out) {
    const FeaturePair* const begin = out;
    constexpr std::size_t kStride = 2 * Slabs * kBlock;
    for (std::size_t block_a = 0; block_a * kBlock < a.count; ++block_a) {
        const float* bounds_a = a.bounds + block_a * kStride;
        std::uint32_t lanes = near_lanes<Slabs>(test.box_b, 1, bounds_a, test.distance) & filled_lanes(a.count, block_a);
        for (; lanes != 0; lanes &= lanes - 1) {
            const auto lane = static_cast<std::size_t>(__builtin_ctz(lanes));
            for (std::size_t block_b = test.same_run ? block_a : 0; block_b * kBlock < b.count; ++block_b) {
                std::uint32_t near = near_lanes<Slabs>(bounds_a + lane, kBlock, b.bounds + block_b * kStride, test.distance) & filled_lanes(b.count, block_b);
                if (test.same_run && block_b == block_a) near &= ~((2u << lane) - 1u);
                if (near == 0) continue;
                if (test.skip_shared)
                    for (int k = 0; k < a.corner_count; ++k)
                        near &= ~holding_lanes(a.corners[(block_a * 3 + static_cast<std::size_t>(k)) * kBlock + lane],
                                               b.corners + block_b * 3 * kBlock, b.corner_count);
                const Index id_a = a.ids[block_a * kBlock + lane];
                const Index* ids_b = b.ids + block_b * kBlock;
                for (; near != 0; near &= near - 1) *out++ = {id_a, ids_b[__builtin_ctz(near)]};
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
HWY_INLINE std::uint32_t near_children_of(const float* box, std::size_t stride, const float* children, std::size_t slabs, const float* distance) {
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

std::uint32_t near_children(const float* box, std::size_t stride, const float* children, std::size_t arity, std::size_t slabs, const float* distance) {
    if (arity == 8) return near_children_of<8>(box, stride, children, slabs, distance);
    if (arity == 4) return near_children_of<4>(box, stride, children, slabs, distance);
    return near_children_of<2>(box, stride, children, slabs, distance);
}

std::uint32_t near_features(const float* box, const float* block, std::size_t slabs, const float* distance) {
    if (slabs == 3) return near_lanes<3>(box, 1, block, distance) & 0xffffu;
    if (slabs == 7) return near_lanes<7>(box, 1, block, distance) & 0xffffu;
    if (slabs == 9) return near_lanes<9>(box, 1, block, distance) & 0xffffu;
    return near_lanes<13>(box, 1, block, distance) & 0xffffu;
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

} // namespace HWY_NAMESPACE
} // namespace seldinger::collision
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace seldinger::collision {

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
bool is_near(const float* a, std::size_t stride_a, const float* b, std::size_t stride_b, std::size_t slabs, const float* distance) noexcept {
    for (std::size_t s = 0; s < slabs; ++s)
        if (a[s * stride_a] + b[(s + slabs) * stride_b] > distance[s] || a[(s + slabs) * stride_a] + b[s * stride_b] > distance[s]) return false;
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

} // namespace seldinger::collision
#endif
