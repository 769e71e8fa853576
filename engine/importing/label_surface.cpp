#include "engine/importing/label_surface.hpp"

#include "assets/anatomy/polygonise.hpp"
#include "base/simplify.hpp"
#include "base/topology.hpp"
#include "engine/importing/rebuild_surface.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trocar::engine {

namespace {

/// Taubin's pass band 1 / kShrink - 1 / kGrow = 0.1: waves longer than about 14 edges stay.
constexpr double kShrink = 0.5, kGrow = -0.5263;
/// Rounds in which the volume is set right.
constexpr int kVolumeRounds = 4;
/// Of the volume: what may be left of the difference after them.
constexpr double kVolumeError = 0.02;
/// Of the largest distance that is allowed: the root mean square error to begin with; halved until the distance is kept, so often.
constexpr double kFirstShare = 0.25;
constexpr int kDecimations = 5;
/// Fewest triangles that the decimation leaves.
constexpr std::size_t kFewest = 400;

/// Weights of a voxel and its neighbours along a row, of kWhole: a Gauss bell one voxel wide.
constexpr std::array<unsigned, 5> kBell{1, 4, 6, 4, 1};
constexpr unsigned kWhole = 16, kFull = 255;
/// Of kFull: a voxel stays at least this far on its own side, so that no vessel breaks and no gap closes.
constexpr unsigned kOwnSide = 135;

/// Averages along one axis, row by row.
void blur_rows(std::vector<std::uint8_t>& field, const std::array<std::size_t, 3>& size, std::size_t axis) {
    const std::array<std::size_t, 3> step{1, size[0], size[0] * size[1]};
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3, length = size[axis];
    std::vector<unsigned> row(length + 4, 0);
    for (std::size_t b = 0; b < size[v]; ++b)
        for (std::size_t a = 0; a < size[u]; ++a) {
            std::uint8_t* at = field.data() + a * step[u] + b * step[v];
            for (std::size_t i = 0; i < length; ++i) row[i + 2] = at[i * step[axis]];
            for (std::size_t i = 0; i < length; ++i) {
                unsigned sum = kWhole / 2;
                for (std::size_t k = 0; k < kBell.size(); ++k) sum += kBell[k] * row[i + k];
                at[i * step[axis]] = static_cast<std::uint8_t>(sum / kWhole);
            }
        }
}

/// The mask averaged over some voxels, negative inside, in voxels about: its zero set passes between the same voxels as the mask's border,
/// without its stairs. Asked at the grid's points only.
class MaskField final : public anatomy::Field {
public:
    MaskField(const LabelMask& mask, bool smooth) : size_(mask.size), field_(mask.inside) {
        for (std::uint8_t& value : field_) value = value != 0 ? kFull : 0;
        if (!smooth) return;
        for (std::size_t axis = 0; axis < 3; ++axis) blur_rows(field_, size_, axis);
        for (std::size_t v = 0; v < field_.size(); ++v) {
            const unsigned value = field_[v];
            field_[v] = static_cast<std::uint8_t>(mask.inside[v] != 0 ? std::max(value, kOwnSide) : std::min(value, kFull - kOwnSide));
        }
    }
    [[nodiscard]] double value(const Vec3& p) const override {
        std::array<std::size_t, 3> at{};
        for (std::size_t a = 0; a < 3; ++a) {
            const double c = std::floor(p[static_cast<int>(a)] + 0.5);
            if (!(c >= 0.0) || c >= static_cast<double>(size_[a])) return 1.0;
            at[a] = static_cast<std::size_t>(c);
        }
        return 1.0 - field_[(at[2] * size_[1] + at[1]) * size_[0] + at[0]] / (0.5 * kFull);
    }

private:
    std::array<std::size_t, 3> size_;
    std::vector<std::uint8_t> field_;
};

/// Each vertex' neighbours in one array.
struct Neighbours {
    std::vector<Index> begin, ids;

    explicit Neighbours(const TriMesh& mesh) : begin(mesh.vertices.size() + 1, 0) {
        const std::vector<std::array<Index, 2>> edges = unique_edges(mesh.triangles);
        for (const auto& [a, b] : edges) ++begin[a + 1], ++begin[b + 1];
        for (std::size_t v = 1; v < begin.size(); ++v) begin[v] += begin[v - 1];
        std::vector<Index> next(begin.begin(), begin.end() - 1);
        ids.resize(2 * edges.size());
        for (const auto& [a, b] : edges) ids[next[a]++] = b, ids[next[b]++] = a;
    }
};

void smooth_surface(TriMesh& mesh, int rounds) {
    const Neighbours around(mesh);
    std::vector<Vec3> moved(mesh.vertices.size());
    for (int half = 0; half < 2 * rounds; ++half) {
        const double factor = half % 2 == 0 ? kShrink : kGrow;
        for (std::size_t v = 0; v < moved.size(); ++v) {
            Vec3 sum = Vec3::Zero();
            for (Index n = around.begin[v]; n < around.begin[v + 1]; ++n) sum += mesh.vertices[around.ids[n]];
            const double count = std::max<double>(1.0, around.begin[v + 1] - around.begin[v]);
            moved[v] = mesh.vertices[v] + factor * (sum / count - mesh.vertices[v]);
        }
        mesh.vertices.swap(moved);
    }
}

/// Moves the surface along its normals until it encloses the volume.
void set_volume(TriMesh& mesh, double wanted) {
    for (int round = 0; round < kVolumeRounds; ++round) {
        std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
        double area = 0.0;
        for (const Triangle& t : mesh.triangles) {
            const Vec3 twice = (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
            area += 0.5 * twice.norm();
            for (const Index v : t) normals[v] += twice;
        }
        const double offset = area > 0.0 ? (wanted - signed_volume(mesh)) / area : 0.0;
        for (std::size_t v = 0; v < normals.size(); ++v)
            if (const double length = normals[v].norm(); length > 0.0) mesh.vertices[v] += offset / length * normals[v];
    }
}

/// Fewer rounds where so many take a small or thin shape away: it stays within a voxel of the border, with the voxels' volume.
/// returns  whether any does
bool smooth_within_a_voxel(TriMesh& mesh, int rounds, double voxel, double volume, LabelSurface& made) {
    const std::vector<Vec3> old = mesh.vertices;
    for (; rounds > 0; rounds /= 2) {
        smooth_surface(mesh, rounds);
        set_volume(mesh, volume);
        made.smoothing = 0.0;
        for (std::size_t v = 0; v < old.size(); ++v) made.smoothing = std::max(made.smoothing, (mesh.vertices[v] - old[v]).norm());
        if (made.smoothing <= voxel && std::abs(signed_volume(mesh) - volume) <= kVolumeError * volume) return true;
        mesh.vertices = old;
    }
    made.smoothing = 0.0;
    return false;
}

/// m; between the voxels' centres, halfway or by the averaged mask.
TriMesh cut_surface(const LabelMask& mask, bool averaged) {
    Box3 box;
    box.add(Vec3::Zero());
    box.add(Vec3(static_cast<double>(mask.size[0]), static_cast<double>(mask.size[1]), static_cast<double>(mask.size[2])));
    TriMesh mesh = anatomy::polygonise(MaskField(mask, averaged), box, 1.0, std::numeric_limits<double>::infinity());
    for (Vec3& v : mesh.vertices) v = mask.origin + mask.axes * v;
    if (mask.axes.determinant() < 0.0)
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

/// As few triangles as keep within `most` of the surface, everywhere; all of them where no try does.
Result<void> decimate(const TriMesh& mesh, double most, LabelSurface& made) {
    double error = kFirstShare * most;
    for (int trial = 0; trial < kDecimations; ++trial, error *= 0.5) {
        Result<TriMesh> fewer = simplify(mesh, kFewest, {.max_error = error});
        if (!fewer.ok()) return fewer.error();
        made.decimation = std::max(largest_distance(*fewer, mesh), largest_distance(mesh, *fewer));
        if (made.decimation > most) continue;
        made.mesh = std::move(*fewer);
        return {};
    }
    made.mesh = mesh;
    made.decimation = 0.0;
    return {};
}

} // namespace

std::string LabelSurface::told() const {
    return fmt::format("surface: {} triangles of {}; volume {:.6g} mm^3, of the voxels {:.6g} mm^3; smoothing moved it by at most {:.3g} mm, "
                       "decimation by at most {:.3g} mm",
                       mesh.triangles.size(), cut, 1e9 * volume, 1e9 * mask_volume, 1e3 * smoothing, 1e3 * decimation);
}

Result<LabelSurface> make_label_surface(const LabelMask& mask, const LabelSurfaceOptions& options,
                                        const std::function<void(const std::string&)>& progress) {
    const auto tell = [&](const char* what) {
        if (progress) progress(what);
    };
    tell("cutting the surface out of the voxels");
    LabelSurface made;
    TriMesh mesh = cut_surface(mask, options.smoothing > 0);
    if (mesh.triangles.empty()) return Error{ErrorCode::BadMesh, "the segment has no surface"};
    made.cut = mesh.triangles.size();
    made.mask_volume = static_cast<double>(mask.voxels) * std::abs(mask.axes.determinant());
    if (options.smoothing > 0) {
        tell("smoothing the surface");
        const double longest = std::max({mask.axes.col(0).norm(), mask.axes.col(1).norm(), mask.axes.col(2).norm()});
        if (!smooth_within_a_voxel(mesh, options.smoothing, longest, made.mask_volume, made)) mesh = cut_surface(mask, false);
    }
    tell("taking triangles away that the error does not need");
    const double spacing = std::min({mask.axes.col(0).norm(), mask.axes.col(1).norm(), mask.axes.col(2).norm()});
    if (const Result<void> done = decimate(mesh, options.error * spacing, made); !done.ok()) return done.error();
    made.volume = signed_volume(made.mesh);
    return made;
}

} // namespace trocar::engine
