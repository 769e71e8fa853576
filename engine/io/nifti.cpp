// NIfTI-1 as label maps: one file (.nii, .nii.gz) or a header with its image (.hdr, .img).
#include "engine/io/file_bytes.hpp"
#include "engine/io/label_volume.hpp"
#include "engine/io/volume_header.hpp"

namespace trocar::engine::volume {

namespace {

constexpr std::size_t kNiftiHeader = 348;

std::optional<ScalarType> find_nifti_type(std::int64_t code) {
    switch (code) {
    case 2: return ScalarType::UInt8;
    case 4: return ScalarType::Int16;
    case 8: return ScalarType::Int32;
    case 16: return ScalarType::Float32;
    case 64: return ScalarType::Float64;
    case 256: return ScalarType::Int8;
    case 512: return ScalarType::UInt16;
    case 768: return ScalarType::UInt32;
    case 1024: return ScalarType::Int64;
    case 1280: return ScalarType::UInt64;
    default: return std::nullopt;
    }
}

class NiftiReader {
public:
    NiftiReader(const std::filesystem::path& path, const std::string& bytes) : path_(path), name_(path.string()), bytes_(bytes) {}

    Result<LabelVolume> read() {
        for (const auto part : {&NiftiReader::read_header, &NiftiReader::set_sizes, &NiftiReader::set_space, &NiftiReader::read_data})
            if (const Result<void> done = (this->*part)(); !done.ok()) return done.error();
        return std::move(volume_);
    }

private:
    Error bad(const char* key, std::string message, std::size_t offset) const {
        return {ErrorCode::BadValue, fmt::format("byte {}: {}", offset, message), name_, 0, 0, key};
    }
    [[nodiscard]] std::int64_t whole(std::size_t at, ScalarType type = ScalarType::Int16) const { return load_integer(header_.data() + at, type, volume_.big); }
    [[nodiscard]] double real(std::size_t at) const { return load_real(header_.data() + at, ScalarType::Float32, volume_.big); }
    [[nodiscard]] static bool is_packed(std::string_view bytes) { return bytes.size() > 1 && bytes[0] == '\x1f' && bytes[1] == '\x8b'; }

    /// As many bytes from the beginning, unpacked where the file is packed.
    static Result<std::string> take(std::string_view bytes, std::size_t count, const std::string& name) {
        if (is_packed(bytes)) {
            Result<std::string> unpacked = inflate_prefix(bytes, count);
            if (!unpacked.ok()) return Error{unpacked.error().code, unpacked.error().message, name};
            return unpacked;
        }
        return std::string(bytes.substr(0, count));
    }

    Result<void> read_header() {
        const Result<std::string> head = take(bytes_, kNiftiHeader, name_);
        if (!head.ok()) return head.error();
        header_ = *head;
        if (header_.size() < kNiftiHeader)
            return Error{ErrorCode::BadSyntax, fmt::format("ends after {} bytes; a NIfTI-1 header has {}", header_.size(), kNiftiHeader), name_};
        for (const bool big : {false, true}) {
            volume_.big = big;
            volume_.order_key = "sizeof_hdr";
            if (whole(0, ScalarType::Int32) == static_cast<std::int64_t>(kNiftiHeader)) break;
            if (!big) continue;
            return Error{ErrorCode::BadSyntax,
                         load_integer(header_.data(), ScalarType::Int32, false) == 540
                             ? std::string("is NIfTI-2, which is not read; expected NIfTI-1")
                             : std::string("is no NIfTI-1 file: byte 0 is not the header's size, 348, in either byte order"),
                         name_};
        }
        const std::string magic = header_.substr(344, 3);
        pair_ = magic == "ni1";
        if (magic != "n+1" && !pair_) return Error{ErrorCode::BadSyntax, "is no NIfTI-1 file: byte 344 is not n+1 or ni1", name_};
        return {};
    }

    Result<void> set_sizes() {
        const std::int64_t dimension = whole(40);
        if (dimension < 3 || dimension > 7) return bad("dim[0]", fmt::format("found {}; expected 3, or 4 with layers", dimension), 40);
        for (std::int64_t d = 1; d <= dimension; ++d) {
            const std::size_t at = 40 + 2 * static_cast<std::size_t>(d);
            const std::int64_t size = whole(at);
            if (size < 1 || (d > 4 && size > 1)) return bad("dim", fmt::format("found {} along axis {}; expected {}", size, d, d > 4 ? "1" : "1 to 32767"), at);
            (d <= 3 ? volume_.size[static_cast<std::size_t>(d - 1)] : volume_.layers) = d <= 4 ? static_cast<std::size_t>(size) : volume_.layers;
        }
        const auto type = find_nifti_type(whole(70));
        if (!type) return bad("datatype", fmt::format("found {}; expected whole or real numbers of 8 to 64 bits", whole(70)), 70);
        volume_.type = *type;
        if (whole(72) != static_cast<std::int64_t>(8 * size_of(*type)))
            return bad("bitpix", fmt::format("found {}; the datatype has {}", whole(72), 8 * size_of(*type)), 72);
        const Result<std::size_t> total = expected_bytes(volume_, name_, "dim");
        if (!total.ok()) return total.error();
        total_ = *total;
        volume_.layer_step = volume_.voxel_count();
        const double slope = real(112), intercept = real(116);
        if (std::isfinite(slope) && slope != 0.0 && std::isfinite(intercept)) volume_.slope = slope, volume_.intercept = intercept;
        return {};
    }

    Result<void> set_space() {
        const auto code = header_[123] & 7;
        const double unit = code == 1 ? 1.0 : code == 3 ? 1e-6 : 1e-3;
        Mat3 axes = Mat3::Zero();
        Vec3 origin = Vec3::Zero();
        if (whole(254) > 0) {
            for (int row = 0; row < 3; ++row) {
                const std::size_t at = 280 + 16 * static_cast<std::size_t>(row);
                for (int axis = 0; axis < 3; ++axis) axes(row, axis) = real(at + 4 * static_cast<std::size_t>(axis));
                origin[row] = real(at + 12);
            }
            if (axes.allFinite() && origin.allFinite()) return set_frame(volume_, axes, origin, unit, true, name_, "srow");
            return bad("srow", "expected finite numbers", 280);
        }
        Vec3 spacing(real(80), real(84), real(88));
        if (!spacing.allFinite() || !(spacing.cwiseAbs().minCoeff() > 0.0)) return bad("pixdim", "expected finite spacings that are not 0", 80);
        spacing = spacing.cwiseAbs();
        if (whole(252) <= 0) {
            volume_.notes.emplace_back("the file says no orientation: axes to the right, anterior and superior are assumed");
            return set_frame(volume_, spacing.asDiagonal(), origin, unit, true, name_, "pixdim");
        }
        const double b = real(256), c = real(260), d = real(264);
        const double rest = 1.0 - b * b - c * c - d * d;
        if (!(rest > -1e-4)) return bad("quatern", "expected a unit quaternion of finite numbers", 256);
        const Eigen::Quaterniond turn(std::sqrt(std::max(0.0, rest)), b, c, d);
        if (real(76) < 0.0) spacing.z() = -spacing.z(); // qfac
        origin = Vec3(real(268), real(272), real(276));
        if (!origin.allFinite()) return bad("qoffset", "expected finite numbers", 268);
        return set_frame(volume_, turn.normalized().toRotationMatrix() * spacing.asDiagonal(), origin, unit, true, name_, "quatern");
    }

    Result<void> read_data() {
        const double offset = real(108);
        if (!std::isfinite(offset) || offset < (pair_ ? 0.0 : 348.0) || offset > 1e9)
            return bad("vox_offset", fmt::format("found {}; expected {} or more", offset, pair_ ? 0 : 352), 108);
        Result<std::string> image = std::string();
        std::string image_name = name_;
        if (pair_) {
            std::filesystem::path file = path_.extension() == ".gz" ? path_.stem() : path_.filename();
            file.replace_extension(".img");
            image_name = (path_.parent_path() / file).string();
            image = read_packed_bytes(image_name);
            if (!image.ok()) return image.error();
        }
        const auto begin = static_cast<std::size_t>(offset);
        Result<std::string> data = take(pair_ ? std::string_view(*image) : std::string_view(bytes_), begin + total_ + kMostPadding + 1, image_name);
        if (!data.ok()) return data.error();
        if (data->size() < begin + total_)
            return Error{ErrorCode::BadSyntax, fmt::format("ends after {} bytes; the header announces data from byte {} to {}", data->size(), begin, begin + total_),
                         image_name};
        return take_voxels(volume_, std::string_view(*data).substr(begin), false, total_, image_name, "dim");
    }

    const std::filesystem::path& path_;
    std::string name_, header_;
    const std::string& bytes_;
    std::size_t total_ = 0;
    bool pair_ = false;
    LabelVolume volume_;
};

} // namespace

Result<LabelVolume> read_nifti(const std::filesystem::path& path, const std::string& bytes) { return NiftiReader(path, bytes).read(); }

} // namespace trocar::engine::volume
