#include "engine/io/label_volume.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/io/mesh_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr double kLeastVoxel = 1e-7, kMostVoxel = 0.1; // m, spacing
constexpr double kFarthestOrigin = 1e3;                // m
/// Cosine between two axes above which they are not perpendicular: far above what single precision loses, and below half a voxel over
/// a thousand.
constexpr double kSheared = 5e-4;

} // namespace

std::int64_t LabelVolume::label(std::size_t voxel, std::size_t layer) const noexcept {
    const char* at = bytes.data() + (voxel * voxel_step + layer * layer_step) * size_of(type);
    if (!is_real(type) && slope == 1.0 && intercept == 0.0) return load_integer(at, type, big);
    const double value = (is_real(type) ? load_real(at, type, big) : static_cast<double>(load_integer(at, type, big))) * slope + intercept;
    return std::abs(value) < 1e15 ? std::llround(value) : 0; // NaN and what is far out of any label's range: background
}

namespace volume {

Result<void> set_frame(LabelVolume& volume, const Mat3& directions, const Vec3& origin, double unit, bool is_ras, const std::string& name,
                       const std::string& key) {
    const auto bad = [&](std::string message) { return Error{ErrorCode::BadValue, std::move(message), name, 0, 0, key}; };
    volume.axes = unit * directions;
    volume.origin = unit * origin;
    for (int axis = 0; axis < 3; ++axis) {
        const double spacing = volume.spacing(axis);
        if (!(spacing >= kLeastVoxel && spacing <= kMostVoxel))
            return bad(fmt::format("along axis {} a voxel is {:.6g} m; expected {:g} m to {:g} m", axis, spacing, kLeastVoxel, kMostVoxel));
    }
    for (int a = 0; a < 3; ++a) {
        const int b = (a + 1) % 3;
        const double cosine = volume.axes.col(a).normalized().dot(volume.axes.col(b).normalized());
        if (!(std::abs(cosine) <= kSheared))
            return bad(fmt::format("axes {} and {} are not perpendicular: the cosine between them is {:.4g}; expected a volume that is not "
                                   "sheared, resample it",
                                   a, b, cosine));
    }
    if (!is_finite(volume.origin) || !(volume.origin.norm() < kFarthestOrigin)) return bad("the origin is not finite, or a kilometre away");
    if (is_ras) return {};
    volume.axes.topRows<2>() *= -1.0;
    volume.origin.head<2>() *= -1.0;
    return {};
}

Result<std::size_t> expected_bytes(const LabelVolume& volume, const std::string& name, const std::string& key) {
    std::size_t bytes = size_of(volume.type);
    for (const std::size_t count : {volume.size[0], volume.size[1], volume.size[2], volume.layers}) {
        if (count == 0) return Error{ErrorCode::BadValue, "a size is 0; expected at least one voxel", name, 0, 0, key};
        if (count > kMostVolumeBytes / bytes)
            return Error{ErrorCode::BadValue,
                         fmt::format("{} x {} x {} voxels in {} layers are more than the {} bytes that are read; crop the label map, or store "
                                     "it in bytes",
                                     volume.size[0], volume.size[1], volume.size[2], volume.layers, kMostVolumeBytes),
                         name, 0, 0, key};
        bytes *= count;
    }
    return bytes;
}

Result<std::filesystem::path> find_data_file(const std::filesystem::path& header, const std::string& named, const std::string& key) {
    const auto bad = [&](const char* why) {
        return Error{ErrorCode::BadValue, fmt::format("names the data file '{}': {}", named, why), header.string(), 0, 0, key};
    };
    const std::filesystem::path relative(named);
    if (named.empty()) return bad("expected a name");
    if (named.find('\0') != named.npos) return bad("expected a name without zero bytes");
    if (relative.is_absolute()) return bad("expected a file in the header's folder, not an absolute path");
    for (const std::filesystem::path& part : relative)
        if (part == "..") return bad("expected a file in the header's folder, not above it");
    std::error_code failed;
    const std::filesystem::path folder = std::filesystem::weakly_canonical(header.has_parent_path() ? header.parent_path() : ".", failed);
    const std::filesystem::path file = std::filesystem::weakly_canonical(folder / relative, failed);
    const auto [end, ignored] = std::mismatch(folder.begin(), folder.end(), file.begin(), file.end());
    if (end != folder.end()) return bad("a link leads out of the header's folder");
    return file;
}

Result<void> take_voxels(LabelVolume& volume, std::string_view data, bool packed, std::size_t bytes, const std::string& name, const std::string& key) {
    std::string unpacked;
    if (packed) {
        Result<std::string> all = inflate_prefix(data, bytes + kMostPadding + 1);
        if (!all.ok()) return Error{all.error().code, fmt::format("{}; the header announces {} bytes", all.error().message, bytes), name};
        unpacked = std::move(*all);
        data = unpacked;
    }
    if (data.size() < bytes)
        return Error{ErrorCode::BadSyntax, fmt::format("{} {} bytes of data; the header announces {}", packed ? "unpacks to" : "ends after", data.size(), bytes), name};
    if (data.size() > bytes + kMostPadding)
        return Error{ErrorCode::BadSyntax,
                     fmt::format("more than {} bytes of data follow the {} that the header announces; expected sizes that fit the data", kMostPadding, bytes), name, 0, 0, key};
    if (data.size() > bytes) volume.notes.push_back(fmt::format("{} bytes after the voxels are padding", data.size() - bytes));
    if (!packed) {
        volume.bytes = std::string(data.substr(0, bytes));
        return {};
    }
    unpacked.resize(bytes);
    volume.bytes = std::move(unpacked);
    return {};
}

} // namespace volume

Result<LabelVolume> read_label_volume(const std::filesystem::path& path) {
    const std::string extension = mesh_extension(path);
    const bool nifti = extension == ".nii" || extension == ".hdr" || extension == ".img", meta = extension == ".mha" || extension == ".mhd";
    if (extension != ".nrrd" && extension != ".nhdr" && !nifti && !meta)
        return Error{ErrorCode::BadUsage,
                     fmt::format("'{}' is no format of label maps; .nrrd, .nhdr, .nii, .nii.gz, .hdr, .mha and .mhd are read", extension),
                     path.string()};
    const Result<std::string> bytes = read_packed_bytes(path);
    if (!bytes.ok()) return bytes.error();
    if (bytes->empty()) return Error{ErrorCode::BadSyntax, "is empty", path.string()};
    if (nifti) return volume::read_nifti(path, *bytes);
    return meta ? volume::read_metaimage(path, *bytes) : volume::read_nrrd(path, *bytes);
}

} // namespace trocar::engine
