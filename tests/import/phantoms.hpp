// Phantoms with known radii: label maps of tubes round axes, as files of every format that is read.
#pragma once

#include "base/vec.hpp"
#include "engine/io/gzip.hpp"
#include "tests/temp_folder.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace trocar::import_test {

namespace fs = std::filesystem;
using engine::gzip_bytes;

/// Axis points with radii, mm.
struct Branch {
    std::vector<Vec3> axis;
    std::vector<double> radii;
};

struct NearestAxis {
    double distance = 1e30, radius = 0.0; // mm
    bool inner = false;                   // not beyond an end
};

inline NearestAxis nearest_axis(const std::vector<Branch>& branches, const Vec3& p) {
    NearestAxis best;
    double least = 1e30;
    for (const Branch& branch : branches)
        for (std::size_t i = 0; i + 1 < branch.axis.size(); ++i) {
            const Vec3 along = branch.axis[i + 1] - branch.axis[i];
            const double t = (p - branch.axis[i]).dot(along) / along.squaredNorm(), s = std::clamp(t, 0.0, 1.0);
            const double radius = (1 - s) * branch.radii[i] + s * branch.radii[i + 1], distance = (p - branch.axis[i] - s * along).norm();
            if (distance - radius >= least) continue;
            least = distance - radius;
            best = {distance, radius, t == s || (i > 0 && i + 2 < branch.axis.size())};
        }
    return best;
}

/// What lies in the frame of medical images (LPS) in the engine's (RAS), and back.
inline Vec3 to_ras(const Vec3& lps) { return {-lps.x(), -lps.y(), lps.z()}; }

/// A label map in memory: voxels of `spacing` mm, turned by `turn` (LPS), label 1 inside.
struct Phantom {
    std::array<std::size_t, 3> size{};
    Vec3 spacing = Vec3::Constant(0.5), origin = Vec3::Zero(); // mm
    Mat3 turn = Mat3::Identity();
    std::string voxels; // a byte each

    [[nodiscard]] std::size_t at(std::size_t i, std::size_t j, std::size_t k) const { return (k * size[1] + j) * size[0] + i; }
    [[nodiscard]] Vec3 place(std::size_t i, std::size_t j, std::size_t k) const {
        return origin + turn * spacing.cwiseProduct(Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)));
    }
    [[nodiscard]] Mat3 axes() const { return turn * spacing.asDiagonal(); }
};

/// branches  in the phantom's own frame: of turn, from its origin
inline Phantom make_phantom(const std::vector<Branch>& branches, std::array<std::size_t, 3> size, const Vec3& spacing, const Mat3& turn = Mat3::Identity(),
                            const Vec3& origin = Vec3::Zero()) {
    Phantom phantom{size, spacing, origin, turn, std::string(size[0] * size[1] * size[2], '\0')};
    for (std::size_t k = 0; k < size[2]; ++k)
        for (std::size_t j = 0; j < size[1]; ++j)
            for (std::size_t i = 0; i < size[0]; ++i) {
                const Vec3 p = spacing.cwiseProduct(Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)));
                const NearestAxis near = nearest_axis(branches, p);
                if (near.distance <= near.radius) phantom.voxels[phantom.at(i, j, k)] = 1;
            }
    return phantom;
}

inline std::string vector_text(const Vec3& v) { return fmt::format("({},{},{})", v.x(), v.y(), v.z()); }

inline std::string nrrd_header(const Phantom& p, const std::string& encoding, const std::string& more = "") {
    const Mat3 axes = p.axes();
    return fmt::format("NRRD0004\n# made by a test\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: {} {} {}\n"
                       "space directions: {} {} {}\nkinds: domain domain domain\nencoding: {}\nspace origin: {}\n{}\n",
                       p.size[0], p.size[1], p.size[2], vector_text(axes.col(0)), vector_text(axes.col(1)), vector_text(axes.col(2)), encoding,
                       vector_text(p.origin), more);
}

inline std::string nrrd_raw(const Phantom& p) { return nrrd_header(p, "raw") + p.voxels; }
inline std::string nrrd_gzip(const Phantom& p) { return nrrd_header(p, "gzip") + gzip_bytes(p.voxels).value(); }
inline std::string nrrd_ascii(const Phantom& p) {
    std::string text;
    for (const char c : p.voxels) text += c == 0 ? "0 " : "1\n";
    return nrrd_header(p, "ascii") + text;
}

template <class Number>
void put(std::string& bytes, std::size_t at, Number number) {
    std::memcpy(bytes.data() + at, &number, sizeof number);
}

/// NIfTI-1 with an sform; RAS.
inline std::string nifti(const Phantom& p) {
    std::string bytes(352, '\0');
    put<std::int32_t>(bytes, 0, 348);
    put<std::int16_t>(bytes, 40, 3);
    for (std::size_t a = 0; a < 3; ++a) {
        put<std::int16_t>(bytes, 42 + 2 * a, static_cast<std::int16_t>(p.size[a]));
        put<float>(bytes, 80 + 4 * a, static_cast<float>(p.spacing[static_cast<int>(a)]));
    }
    put<std::int16_t>(bytes, 70, 2);
    put<std::int16_t>(bytes, 72, 8);
    put<float>(bytes, 108, 352.0F);
    put<std::int16_t>(bytes, 254, 1);
    bytes[123] = 2;
    const Mat3 axes = p.axes();
    for (int row = 0; row < 3; ++row) {
        const double sign = row < 2 ? -1.0 : 1.0;
        for (int axis = 0; axis < 3; ++axis) put<float>(bytes, 280 + 16 * static_cast<std::size_t>(row) + 4 * static_cast<std::size_t>(axis), static_cast<float>(sign * axes(row, axis)));
        put<float>(bytes, 280 + 16 * static_cast<std::size_t>(row) + 12, static_cast<float>(sign * p.origin[row]));
    }
    std::memcpy(bytes.data() + 344, "n+1", 4);
    return bytes + p.voxels;
}

inline std::string metaimage_header(const Phantom& p, const std::string& file, const std::string& more = "") {
    return fmt::format("ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n{}TransformMatrix = {} {} {} {} {} {} {} {} {}\n"
                       "Offset = {} {} {}\nElementSpacing = {} {} {}\nDimSize = {} {} {}\nElementType = MET_UCHAR\nElementDataFile = {}\n",
                       more, p.turn(0, 0), p.turn(1, 0), p.turn(2, 0), p.turn(0, 1), p.turn(1, 1), p.turn(2, 1), p.turn(0, 2), p.turn(1, 2), p.turn(2, 2),
                       p.origin.x(), p.origin.y(), p.origin.z(), p.spacing.x(), p.spacing.y(), p.spacing.z(), p.size[0], p.size[1], p.size[2], file);
}

using Folder = FolderTest;

/// The same numbers on every run and machine.
class Dice {
public:
    explicit Dice(std::uint64_t seed) : state_(seed * 0x9E3779B97F4A7C15ULL + 1) {}
    double between(double least, double most) {
        state_ ^= state_ << 13, state_ ^= state_ >> 7, state_ ^= state_ << 17;
        return least + (most - least) * static_cast<double>(state_ >> 11) / 9007199254740992.0;
    }
    Mat3 turn() {
        const Vec3 axis(between(-1, 1), between(-1, 1), between(-1, 1.5));
        return Eigen::AngleAxisd(between(0, 3), axis.normalized()).toRotationMatrix();
    }

private:
    std::uint64_t state_;
};

} // namespace trocar::import_test
