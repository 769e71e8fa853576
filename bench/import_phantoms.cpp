#include "bench/import_phantoms.hpp"

#include "base/trig.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/gzip.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace trocar::engine {

namespace {

struct OnAxis {
    double distance = 0.0, radius = 0.0; // m
};

OnAxis nearest_tube(const std::vector<PhantomTube>& tubes, const Vec3& p) {
    OnAxis best;
    double least = std::numeric_limits<double>::infinity();
    for (const PhantomTube& tube : tubes)
        for (std::size_t i = 0; i + 1 < tube.axis.size(); ++i) {
            const Vec3 along = tube.axis[i + 1] - tube.axis[i];
            const double s = std::clamp((p - tube.axis[i]).dot(along) / along.squaredNorm(), 0.0, 1.0);
            const double radius = (1 - s) * tube.radii[i] + s * tube.radii[i + 1], distance = (p - tube.axis[i] - s * along).norm();
            if (distance - radius < least) least = distance - radius, best = {distance, radius};
        }
    return best;
}

PhantomTube bent_tube() {
    PhantomTube tube;
    for (int i = 0; i <= 40; ++i) {
        const auto [s, c] = sin_cos(std::numbers::pi * i / 40);
        tube.axis.emplace_back(0.032, 0.032 - 0.02 * c, 0.014 + 0.03 * s);
        tube.radii.push_back(0.003);
    }
    return tube;
}

} // namespace

std::vector<LabelPhantom> make_phantoms(bool quick) {
    std::vector<LabelPhantom> phantoms;
    phantoms.push_back({"straight", {{{{0.032, 0.032, 0.006}, {0.032, 0.032, 0.058}}, {0.004, 0.004}}}, {}});
    if (quick) return phantoms;
    phantoms.push_back({"slanting", {{{{0.012, 0.015, 0.006}, {0.05, 0.04, 0.058}}, {0.0032, 0.0032}}}, {}});
    phantoms.push_back({"tapering", {{{{0.032, 0.032, 0.006}, {0.032, 0.032, 0.058}}, {0.005, 0.002}}}, {}});
    phantoms.push_back({"bent", {bent_tube()}, {}});
    const Vec3 fork(0.032, 0.032, 0.028);
    phantoms.push_back({"branching",
                        {{{{0.032, 0.032, 0.004}, fork}, {0.004, 0.004}}, {{fork, {0.032, 0.014, 0.06}}, {0.003, 0.003}}, {{fork, {0.032, 0.052, 0.06}}, {0.0025, 0.0025}}},
                        {fork}});
    LabelPhantom large = phantoms.back();
    large.name = "branching, 256^3";
    large.size = 256;
    large.voxel = 2.5e-4;
    phantoms.push_back(large);
    return phantoms;
}

Result<void> write_phantom(const LabelPhantom& phantom, const std::filesystem::path& file) {
    std::string voxels(phantom.size * phantom.size * phantom.size, '\0');
    std::size_t v = 0;
    for (std::size_t k = 0; k < phantom.size; ++k)
        for (std::size_t j = 0; j < phantom.size; ++j)
            for (std::size_t i = 0; i < phantom.size; ++i, ++v) {
                const OnAxis near = nearest_tube(phantom.tubes, phantom.voxel * Vec3(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k)));
                if (near.distance <= near.radius) voxels[v] = 1;
            }
    const Result<std::string> packed = gzip_bytes(voxels);
    if (!packed.ok()) return packed.error();
    const double mm = 1e3 * phantom.voxel;
    return write_file_atomically(file, fmt::format("NRRD0004\ntype: unsigned char\ndimension: 3\nspace: right-anterior-superior\nsizes: {0} {0} {0}\n"
                                                   "space directions: ({1},0,0) (0,{1},0) (0,0,{1})\nencoding: gzip\nspace origin: (0,0,0)\n\n",
                                                   phantom.size, mm) +
                                           *packed);
}

RadiusError measure_radii(const LabelPhantom& phantom, const std::vector<CentrelineBranch>& branches) {
    RadiusError error;
    for (const CentrelineBranch& branch : branches)
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            const Vec3& p = branch.points[i];
            const OnAxis near = nearest_tube(phantom.tubes, p);
            bool apart = true;
            for (const PhantomTube& tube : phantom.tubes)
                for (const Vec3& end : {tube.axis.front(), tube.axis.back()}) apart = apart && (p - end).norm() >= 1.5 * near.radius;
            for (const Vec3& fork : phantom.forks) apart = apart && (p - fork).norm() >= 0.01;
            if (!apart) continue;
            ++error.points;
            error.most = std::max(error.most, std::abs(branch.radii[i] - near.radius));
        }
    return error;
}

} // namespace trocar::engine
