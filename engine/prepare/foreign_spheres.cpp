#include "engine/prepare/foreign_spheres.hpp"

#include "engine/prepare/sph.hpp"

#include <fmt/format.h>

namespace trocar::engine {

namespace {

/// A file in another unit or of another body is many times larger or smaller than the surface, or far from it.
constexpr double kMostSizeRatio = 5.0;   // of the longest sides, either way
constexpr double kFarthestOutside = 0.5; // of the surface's longest side: as far off as half of the body
constexpr std::size_t kMostSpheres = 2'000'000;

/// Nothing, or a sentence on what does not fit.
std::string find_misfit(const spheretree::SphereTree& tree, const TriMesh& surface) {
    if (tree.sphere_count() > kMostSpheres)
        return fmt::format("found {} spheres, expected at most {}", tree.sphere_count(), kMostSpheres);
    const double size = surface.bounds().longest_edge(), extent = spheretree::leaves_extent(tree);
    const std::string sizes = fmt::format("its leaves are {:.3g} mm long and the surface {:.3g} mm", 1e3 * extent, 1e3 * size);
    if (!(extent <= kMostSizeRatio * size && extent * kMostSizeRatio >= size))
        return sizes + "; expected a tree of about its size, in the unit of the surface's file (the scene's length for a shape or a recipe)";
    const double outside = spheretree::farthest_outside(tree, surface);
    if (!(outside <= kFarthestOutside * size))
        return fmt::format("{}, and a vertex of the surface is {:.3g} mm outside all of them; expected a tree of the same shape at the same "
                           "place, as the surface is before \"scale\" and \"translate\"",
                           sizes, 1e3 * outside);
    return {};
}

} // namespace

Result<spheretree::AdoptedTree> load_spheres(const std::filesystem::path& file, const SphereFrame& frame, const TriMesh& surface) {
    Result<spheretree::SphereTree> tree = read_sph(file, frame.scale);
    if (!tree.ok()) return tree.error();
    for (spheretree::Sphere& sphere : tree->spheres) sphere.centre += frame.translate;
    if (std::string misfit = find_misfit(*tree, surface); !misfit.empty()) // the spheres begin in the second line
        return Error{ErrorCode::BadValue, std::move(misfit), file.string(), 2};
    return spheretree::adopt_tree(*tree, surface);
}

std::string describe_coverage(const std::filesystem::path& file, const spheretree::AdoptedTree& adopted) {
    const spheretree::Coverage& c = adopted.coverage;
    const std::string name = file.filename().string();
    std::string text = fmt::format("sphere tree from {}: {} spheres", name, adopted.tree.sphere_count());
    if (c.is_whole()) text += ", which hold all of the surface";
    if (c.triangles > 0)
        text += fmt::format("; {:.3g} % of the surface, on {} triangles, lay outside its leaves, by up to {:.3g} mm: {} leaves grew to hold it, by at "
                            "most {:.3g} mm",
                            100.0 * c.uncovered, c.triangles, 1e3 * c.farthest, c.grown_leaves, 1e3 * c.leaf_growth);
    if (c.grown_inner > 0)
        text += fmt::format("; {} spheres above them grew by at most {:.3g} mm, to hold what lies beneath ({:.3g} % of the surface did not pass "
                            "through all of its leaf's ancestors)",
                            c.grown_inner, 1e3 * c.inner_growth, 100.0 * c.unreachable);
    if (c.idle_leaves > 0) text += fmt::format("; {} leaves hold nothing that others do not hold better, and were left out", c.idle_leaves);
    return text;
}

} // namespace trocar::engine
