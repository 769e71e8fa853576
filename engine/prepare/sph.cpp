#include "engine/prepare/sph.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/scanner.hpp"
#include "spheretree/build/wrapped_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace trocar::engine {

namespace {

constexpr std::size_t kMostPlaces = 20'000'000;
constexpr double kLeastRadius = 1e-30; // the toolkit takes 0 for an empty place

/// Places of a full tree, 0 where there are more than allowed.
std::size_t count_places(std::size_t levels, std::size_t degree) {
    std::size_t all = 0, row = 1;
    for (std::size_t level = 0; level < levels; ++level, row *= degree) {
        all += row;
        if (all > kMostPlaces) return 0;
    }
    return all;
}

} // namespace

Result<void> write_sph(const std::filesystem::path& path, const spheretree::SphereTree& tree, double scale) {
    std::size_t degree = 2;
    for (const std::uint16_t count : tree.child_count) degree = std::max<std::size_t>(degree, count);
    const std::size_t places = count_places(tree.level_count(), degree);
    if (places == 0)
        return Error{ErrorCode::BadValue,
                     fmt::format("{} levels of {} children have more than {} places, too many for a .sph file", tree.level_count(), degree,
                                 kMostPlaces),
                     path.string()};
    std::string text = fmt::format("{} {}\n", tree.level_count(), degree);
    std::vector<Index> row{0}; // spheres of the level's places, kNoIndex where empty
    for (std::size_t level = 0; level < tree.level_count(); ++level) {
        std::vector<Index> next;
        for (const Index s : row) {
            const Index children = s == kNoIndex ? 0 : tree.child_count[s];
            if (level + 1 < tree.level_count())
                for (Index k = 0; k < degree; ++k) next.push_back(k < children ? tree.first_child[s] + k : kNoIndex);
            if (s == kNoIndex || tree.spheres[s].radius < 0.0) {
                text += "0 0 0 -1 1\n";
                continue;
            }
            const Vec3 c = scale * tree.spheres[s].centre;
            fmt::format_to(std::back_inserter(text), "{} {} {} {} 1\n", c[0], c[1], c[2],
                           std::max(scale * tree.spheres[s].radius, kLeastRadius));
        }
        row = std::move(next);
    }
    return write_file_atomically(path, text);
}

namespace {

/// Lines to spheres, empty places dropped; the places' own numbering gives the parents.
bool read_places(Scanner& in, std::size_t levels, std::size_t degree, double scale, spheretree::SphereTree& tree) {
    std::vector<Index> above, here; // sphere of each place of the last level and of this one
    std::size_t row = 1;
    for (std::size_t level = 0; level < levels; ++level, row *= degree) {
        here.assign(row, kNoIndex);
        tree.level_begin.push_back(static_cast<Index>(tree.spheres.size()));
        for (std::size_t k = 0; k < row; ++k) {
            spheretree::Sphere sphere;
            double radius = 0.0;
            if (in.at_end())
                return in.fail(ErrorCode::BadSyntax, fmt::format("the file ends at place {} of level {}; {} levels of degree {} "
                                                                 "have {} there",
                                                                 k, level, levels, degree, row));
            if (!in.point(sphere.centre, k) || !in.real(radius, "a radius")) return false;
            if (!std::isfinite(radius)) return in.fail(ErrorCode::BadValue, "the radius is not finite");
            if (const double largest = std::max(sphere.centre.cwiseAbs().maxCoeff(), radius) * scale; !(largest <= spheretree::kLargestCoordinate))
                return in.fail(ErrorCode::BadValue, fmt::format("found a sphere that reaches {:g} m from the origin; expected at most {:g} m", largest,
                                                                spheretree::kLargestCoordinate));
            in.skip_line();
            if (!(radius > 0.0)) continue;
            const Index parent = level == 0 ? kNoIndex : above[k / degree];
            if (level > 0 && parent == kNoIndex)
                return in.fail(ErrorCode::BadValue, fmt::format("a sphere at place {} of level {} hangs beneath an empty place", k, level));
            const auto id = static_cast<Index>(tree.spheres.size());
            here[k] = id;
            tree.spheres.push_back({scale * sphere.centre, scale * radius});
            tree.parent.push_back(parent);
            tree.first_child.push_back(kNoIndex);
            tree.child_count.push_back(0);
            tree.level.push_back(static_cast<std::uint8_t>(level));
            if (parent == kNoIndex) continue;
            if (tree.child_count[parent]++ == 0) tree.first_child[parent] = id;
        }
        above = here;
    }
    if (tree.spheres.empty()) return in.fail(ErrorCode::BadValue, "the tree has no root");
    while (tree.level_begin.back() == tree.spheres.size()) tree.level_begin.pop_back(); // levels of empty places alone
    tree.level_begin.push_back(static_cast<Index>(tree.spheres.size()));
    tree.item_begin.assign(tree.spheres.size(), 0);
    tree.item_end.assign(tree.spheres.size(), 0);
    return true;
}

} // namespace

Result<spheretree::SphereTree> read_sph(const std::filesystem::path& path, double scale) {
    const auto bytes = read_file_bytes(path);
    if (!bytes.ok()) return bytes.error();
    Scanner in(*bytes, path.string());
    std::int64_t levels = 0, degree = 0;
    spheretree::SphereTree tree;
    if (!in.integer(levels, "the number of levels") || !in.integer(degree, "the degree")) return in.error();
    const bool sane = levels >= 1 && levels <= 64 && degree >= 1 && degree <= 65535;
    const std::size_t places = sane ? count_places(static_cast<std::size_t>(levels), static_cast<std::size_t>(degree)) : 0;
    if (places == 0 || !in.fits(places, 8)) {
        in.fail(ErrorCode::BadValue, fmt::format("{} levels of degree {} do not fit into this file", levels, degree));
        return in.error();
    }
    in.skip_line();
    if (!read_places(in, static_cast<std::size_t>(levels), static_cast<std::size_t>(degree), scale, tree)) return in.error();
    return tree;
}

} // namespace trocar::engine
