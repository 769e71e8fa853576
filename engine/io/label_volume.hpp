// Label maps: voxels with a whole number each, where they lie in the patient, and what their numbers are called.
// NRRD (raw, gzip, ascii; detached too; Slicer's .seg.nrrd with names and layers), NIfTI-1 (.nii, .nii.gz, .hdr with .img) and MetaImage
// (.mha, .mhd).
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"
#include "engine/io/scalar.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// Largest label map that is read, unpacked: 1024^3 voxels of a byte. Headers that claim more are refused before anything is allocated.
inline constexpr std::size_t kMostVolumeBytes = std::size_t{1} << 30;

/// A named segment: of one layer the voxels with one value.
struct LabelSegment {
    std::string name;
    std::int64_t value = 1;
    std::size_t layer = 0;
};

struct LabelVolume {
    std::array<std::size_t, 3> size{}; // voxels along i, j, k
    std::size_t layers = 1;            // that may overlap
    Mat3 axes = Mat3::Identity();      // columns: m from a voxel to the next along i, j, k; perpendicular
    Vec3 origin = Vec3::Zero();        // m, middle of voxel (0, 0, 0); right, anterior, superior (RAS), as everything in the engine
    std::vector<LabelSegment> segments; // that the file names; empty: none
    std::vector<std::string> notes;     // assumptions: a frame that the file does not say, ...

    ScalarType type = ScalarType::UInt8;
    bool big = false;                             // most significant byte first
    std::string_view order_key = "endian";        // of the file, that says so
    std::string bytes;                            // of all voxels
    std::size_t voxel_step = 1, layer_step = 0;   // elements from a voxel to the next, from a layer to the next
    double slope = 1.0, intercept = 0.0;          // of the numbers as they are stored

    [[nodiscard]] std::size_t voxel_count() const noexcept { return size[0] * size[1] * size[2]; }
    /// Rounded to a whole number; voxels in the order i, then j, then k.
    [[nodiscard]] std::int64_t label(std::size_t voxel, std::size_t layer = 0) const noexcept;
    [[nodiscard]] double spacing(int axis) const noexcept { return axes.col(axis).norm(); }
};

/// fails  with file and line, byte offset or key, and what was expected: truncated, sizes that do not fit the data, more than
///        kMostVolumeBytes, spacings that are no lengths of voxels, directions that are not perpendicular, data files outside of the
///        header's folder, numbers that are no labels, encodings that are not read
[[nodiscard]] Result<LabelVolume> read_label_volume(const std::filesystem::path& path);

/// Parts of the readers.
namespace volume {

/// Checks and stores what all formats share. directions: columns in the file's unit.
/// key  of the directions, for messages
[[nodiscard]] Result<void> set_frame(LabelVolume& volume, const Mat3& directions, const Vec3& origin, double unit, bool is_ras,
                                     const std::string& name, const std::string& key);
/// Bytes of size[0] * size[1] * size[2] * layers elements; an error where there are none, or too many.
[[nodiscard]] Result<std::size_t> expected_bytes(const LabelVolume& volume, const std::string& name, const std::string& key);
/// A data file named by a header: beside it, or in a folder beneath.
[[nodiscard]] Result<std::filesystem::path> find_data_file(const std::filesystem::path& header, const std::string& named, const std::string& key);
/// Bytes after the voxels that are taken for padding: files are filled up to blocks of 512 bytes. More of them, and the sizes are wrong.
inline constexpr std::size_t kMostPadding = 512;
/// Stores the bytes of all voxels; padding is left out, with a note.
/// packed  as one gzip or zlib stream
/// key     of the sizes, for messages
/// fails   BadSyntax: fewer bytes, or more than with padding
[[nodiscard]] Result<void> take_voxels(LabelVolume& volume, std::string_view data, bool packed, std::size_t bytes, const std::string& name,
                                       const std::string& key);

[[nodiscard]] Result<LabelVolume> read_nrrd(const std::filesystem::path& path, const std::string& bytes);
[[nodiscard]] Result<LabelVolume> read_nifti(const std::filesystem::path& path, const std::string& bytes);
[[nodiscard]] Result<LabelVolume> read_metaimage(const std::filesystem::path& path, const std::string& bytes);

} // namespace volume

} // namespace trocar::engine
