#include "engine/importing/label_mask.hpp"

#include "engine/io/printable.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

namespace trocar::engine {

namespace {

/// Different numbers in a label map: more are an image's grey values.
constexpr std::size_t kMostLabels = 4096;
/// Labels that a message lists.
constexpr std::size_t kListed = 20;
/// Fewest voxels that a side of the volume cuts, for an opening.
constexpr std::size_t kLeastCut = 4;

Error bad_label(std::string message) { return {ErrorCode::BadValue, std::move(message), {}, 0, 0, "--label"}; }

using Counts = std::map<std::int64_t, std::size_t>;

Result<Counts> count_labels(const LabelVolume& volume, std::size_t layer) {
    Counts counts;
    std::int64_t last = 0;
    std::size_t run = 0;
    for (std::size_t v = 0; v < volume.voxel_count(); ++v) {
        const std::int64_t label = volume.label(v, layer);
        if (label == last) {
            ++run;
            continue;
        }
        if (last != 0) counts[last] += run;
        last = label;
        run = 1;
        if (counts.size() > kMostLabels)
            return Error{ErrorCode::BadValue, fmt::format("holds more than {} different numbers: it is an image, not a label map; expected a "
                                                          "whole number per segment, as a segmentation gives",
                                                          kMostLabels)};
    }
    if (last != 0) counts[last] += run;
    return counts;
}

/// Segments that the file names, or one for each number in each layer.
Result<std::vector<LabelSegment>> list_segments(const LabelVolume& volume) {
    if (!volume.segments.empty()) return volume.segments;
    std::vector<LabelSegment> segments;
    for (std::size_t layer = 0; layer < volume.layers; ++layer) {
        const Result<Counts> counts = count_labels(volume, layer);
        if (!counts.ok()) return counts.error();
        for (const auto& [value, count] : *counts) segments.push_back({volume.layers > 1 ? fmt::format("{}:{}", layer, value) : "", value, layer});
    }
    return segments;
}

/// Labels of several bytes that all are multiples of 256 were most likely read with the wrong byte order. A number asked for is taken as it is.
Result<void> check_byte_order(const LabelVolume& volume, const std::vector<LabelSegment>& segments) {
    if (is_real(volume.type) || size_of(volume.type) < 2 || volume.slope != 1.0 || volume.intercept != 0.0 || segments.empty()) return {};
    for (const LabelSegment& segment : segments)
        if (segment.value % 256 != 0) return {};
    return Error{ErrorCode::BadValue,
                 fmt::format("all its labels are multiples of 256, the first is {}: they were stored in the other byte order; expected {} endian numbers, or --label {} if "
                             "they are meant",
                             segments.front().value, volume.big ? "big" : "little", segments.front().value),
                 {}, 0, 0, std::string(volume.order_key)};
}

std::string shown_segment(const LabelSegment& segment) {
    if (segment.name.empty()) return std::to_string(segment.value);
    return fmt::format("{} ({})", printable(segment.name), segment.value);
}

Result<LabelSegment> choose_segment(const std::vector<LabelSegment>& segments, const std::string& wanted) {
    if (segments.empty()) return Error{ErrorCode::BadValue, "all voxels are 0: there is no segment in it"};
    std::vector<std::string> known;
    for (const LabelSegment& segment : segments)
        if (known.size() < kListed) known.push_back(shown_segment(segment));
    const std::string list = fmt::format("{}{}", fmt::join(known, ", "), segments.size() > kListed ? fmt::format(" and {} more", segments.size() - kListed) : "");
    if (wanted.empty() && segments.size() == 1) return segments.front();
    if (wanted.empty()) return bad_label(fmt::format("there are {} segments; expected one of {}", segments.size(), list));
    for (const LabelSegment& segment : segments)
        if (segment.name == wanted) return segment;
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), value);
    if (error == std::errc() && end == wanted.data() + wanted.size()) {
        std::optional<LabelSegment> found;
        for (const LabelSegment& segment : segments) {
            if (segment.value != value) continue;
            if (found) return bad_label(fmt::format("{} is a segment of several layers; expected a name: {}", value, list));
            found = segment;
        }
        if (found) return *found;
    }
    return bad_label(fmt::format("no segment '{}'; known: {}", printable(wanted), list));
}

/// The mask of the segment's box; nothing where it has no voxel.
std::optional<LabelMask> cut_out(const LabelVolume& volume, const LabelSegment& segment, std::array<std::size_t, 3>& low) {
    std::array<std::size_t, 3> lo = volume.size, hi{};
    const auto each = [&](auto&& visit) {
        std::size_t v = 0;
        for (std::size_t k = 0; k < volume.size[2]; ++k)
            for (std::size_t j = 0; j < volume.size[1]; ++j)
                for (std::size_t i = 0; i < volume.size[0]; ++i, ++v)
                    if (volume.label(v, segment.layer) == segment.value) visit(std::array{i, j, k});
    };
    each([&](const std::array<std::size_t, 3>& at) {
        for (std::size_t a = 0; a < 3; ++a) lo[a] = std::min(lo[a], at[a]), hi[a] = std::max(hi[a], at[a] + 1);
    });
    if (hi[0] == 0) return std::nullopt;
    LabelMask mask;
    std::size_t count = 1;
    mask.origin = volume.origin;
    for (std::size_t a = 0; a < 3; ++a) {
        mask.size[a] = hi[a] - lo[a] + 2;
        count *= mask.size[a];
        mask.origin += (static_cast<double>(lo[a]) - 1.0) * volume.axes.col(static_cast<int>(a));
    }
    mask.axes = volume.axes;
    mask.inside.assign(count, 0);
    each([&](const std::array<std::size_t, 3>& at) {
        mask.inside[mask.at(at[0] - lo[0] + 1, at[1] - lo[1] + 1, at[2] - lo[2] + 1)] = 1;
        ++mask.voxels;
    });
    low = lo;
    return mask;
}

/// Voxels with `from` that hang together with one of them become `to`. Returns how many.
std::size_t flood(LabelMask& mask, std::size_t start, std::uint8_t from, std::uint8_t to, std::vector<std::size_t>& waiting) {
    const std::size_t row = mask.size[0], slice = mask.size[0] * mask.size[1];
    waiting.assign(1, start);
    mask.inside[start] = to;
    std::size_t count = 0;
    while (!waiting.empty()) {
        const std::size_t v = waiting.back();
        waiting.pop_back();
        ++count;
        const std::size_t i = v % row, j = v / row % mask.size[1], k = v / slice;
        const auto take = [&](bool there, std::size_t next) {
            if (!there || mask.inside[next] != from) return;
            mask.inside[next] = to;
            waiting.push_back(next);
        };
        take(i > 0, v - 1), take(i + 1 < row, v + 1);
        take(j > 0, v - row), take(j + 1 < mask.size[1], v + row);
        take(k > 0, v - slice), take(k + 1 < mask.size[2], v + slice);
    }
    return count;
}

/// Of parts that share no face the largest stays.
void drop_islands(LabelMask& mask) {
    std::vector<std::size_t> waiting;
    std::size_t parts = 0, largest = 0, largest_start = 0;
    for (std::size_t v = 0; v < mask.inside.size(); ++v) {
        if (mask.inside[v] != 1) continue;
        const std::size_t count = flood(mask, v, 1, 2, waiting);
        ++parts;
        if (count > largest) largest = count, largest_start = v;
    }
    flood(mask, largest_start, 2, 1, waiting);
    for (std::uint8_t& voxel : mask.inside) voxel = voxel == 1;
    if (parts > 1)
        mask.repairs.push_back(fmt::format("islands: {} parts of {} voxels removed, {:.2f} % of the segment", parts - 1, mask.voxels - largest,
                                           100.0 * static_cast<double>(mask.voxels - largest) / static_cast<double>(mask.voxels)));
    mask.voxels = largest;
}

/// What no way leads to from outside is filled.
void fill_cavities(LabelMask& mask) {
    std::vector<std::size_t> waiting;
    flood(mask, 0, 0, 3, waiting); // the empty layer round the box hangs together
    std::size_t holes = 0, filled = 0;
    for (std::size_t v = 0; v < mask.inside.size(); ++v)
        if (mask.inside[v] == 0) filled += flood(mask, v, 0, 1, waiting), ++holes;
    for (std::uint8_t& voxel : mask.inside) voxel = voxel == 1;
    mask.voxels += filled;
    if (holes > 0) mask.repairs.push_back(fmt::format("holes: {} cavities of {} voxels filled", holes, filled));
}

/// Patches of the segment on one side of the volume.
void find_cuts(LabelMask& mask, std::size_t axis, bool high) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3, layer = high ? mask.size[axis] - 2 : 1;
    const std::size_t width = mask.size[u], height = mask.size[v];
    const auto voxel = [&](std::size_t a, std::size_t b) {
        std::array<std::size_t, 3> at{};
        at[axis] = layer, at[u] = a, at[v] = b;
        return at;
    };
    std::vector<std::uint8_t> open(width * height, 0);
    for (std::size_t b = 0; b < height; ++b)
        for (std::size_t a = 0; a < width; ++a) {
            const auto at = voxel(a, b);
            open[b * width + a] = mask.inside[mask.at(at[0], at[1], at[2])];
        }
    const Vec3 along = mask.axes.col(static_cast<int>(axis)), across = mask.axes.col(static_cast<int>(u)), up = mask.axes.col(static_cast<int>(v));
    for (std::size_t start = 0; start < open.size(); ++start) {
        if (open[start] == 0) continue;
        std::vector<std::size_t> patch{start};
        open[start] = 0;
        Vec3 sum = Vec3::Zero();
        for (std::size_t next = 0; next < patch.size(); ++next) {
            const std::size_t a = patch[next] % width, b = patch[next] / width;
            sum += static_cast<double>(a) * across + static_cast<double>(b) * up;
            const auto take = [&](bool there, std::size_t other) {
                if (there && open[other] != 0) open[other] = 0, patch.push_back(other);
            };
            take(a > 0, patch[next] - 1), take(a + 1 < width, patch[next] + 1);
            take(b > 0, patch[next] - width), take(b + 1 < height, patch[next] + width);
        }
        if (patch.size() < kLeastCut) continue;
        VesselEnd end;
        const double side = static_cast<double>(layer) + (high ? 0.5 : -0.5);
        end.centre = mask.origin + sum / static_cast<double>(patch.size()) + side * along;
        end.inward = (high ? -along : along).normalized();
        end.radius = std::sqrt(static_cast<double>(patch.size()) * across.norm() * up.norm() / std::numbers::pi);
        mask.cut.push_back(end);
    }
}

} // namespace

Result<LabelMask> make_mask(const LabelVolume& volume, const std::string& wanted) {
    const Result<std::vector<LabelSegment>> segments = list_segments(volume);
    if (!segments.ok()) return segments.error();
    if (wanted.empty())
        if (const Result<void> order = check_byte_order(volume, *segments); !order.ok()) return order.error();
    const Result<LabelSegment> segment = choose_segment(*segments, wanted);
    if (!segment.ok()) return segment.error();
    std::array<std::size_t, 3> low{};
    std::optional<LabelMask> mask = cut_out(volume, *segment, low);
    if (!mask) return bad_label(fmt::format("the segment {} has no voxel", shown_segment(*segment)));
    mask->name = segment->name.empty() ? std::to_string(segment->value) : segment->name;
    drop_islands(*mask);
    fill_cavities(*mask);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (low[axis] == 0) find_cuts(*mask, axis, false);
        if (low[axis] + mask->size[axis] - 2 == volume.size[axis]) find_cuts(*mask, axis, true);
    }
    return std::move(*mask);
}

} // namespace trocar::engine
