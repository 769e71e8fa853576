// Equal parts of a range, side by side where there are several. What a part computes must not depend on where it is cut.
#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>

namespace trocar::fem {

inline constexpr std::size_t kMostBlocks = 64;

/// Calls work(block, begin, end) for at most `threads` parts of [0, count), none smaller than `least`; returns how many.
template <class Work>
std::size_t for_each_block(std::size_t count, unsigned threads, std::size_t least, Work&& work) {
    const std::size_t blocks = std::clamp<std::size_t>(std::min<std::size_t>(threads, count / least), 1, kMostBlocks);
    if (blocks == 1)
        work(std::size_t{0}, std::size_t{0}, count);
    else
        tbb::parallel_for(
            std::size_t{0}, blocks, [&](std::size_t k) { work(k, k * count / blocks, (k + 1) * count / blocks); },
            tbb::simple_partitioner());
    return blocks;
}

} // namespace trocar::fem
