// One segment of a label map as a mask: chosen by name or number, without islands and holes, with the places where it is cut by the
// volume's sides.
#pragma once

#include "engine/importing/openings.hpp"
#include "engine/io/label_volume.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// Voxels of a box of the label map that holds the segment, with one layer of empty voxels all round.
struct LabelMask {
    std::array<std::size_t, 3> size{};  // voxels
    std::vector<std::uint8_t> inside;   // [size 0 * size 1 * size 2] i first; 1: of the segment
    Mat3 axes = Mat3::Identity();       // m from a voxel to the next
    Vec3 origin = Vec3::Zero();         // m, middle of voxel (0, 0, 0)
    std::string name;                   // of the segment: its name, or its number
    std::size_t voxels = 0;             // inside
    std::vector<std::string> repairs;   // islands and holes, with counts
    std::vector<VesselEnd> cut;         // where a side of the volume cuts the segment

    [[nodiscard]] std::size_t at(std::size_t i, std::size_t j, std::size_t k) const noexcept { return (k * size[1] + j) * size[0] + i; }
};

/// wanted  a segment's name, or a label's number; empty: the only one that there is
/// fails   BadValue: no such segment, or several and none was asked for: they are listed, with --label; an image instead of labels
[[nodiscard]] Result<LabelMask> make_mask(const LabelVolume& volume, const std::string& wanted);

} // namespace trocar::engine
