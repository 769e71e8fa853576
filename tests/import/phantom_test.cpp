// Label maps of tubes with known radius: the centreline's radii are within half a voxel, the surface holds the voxels' volume.
#include "phantoms.hpp"

#include "base/self_intersection.hpp"
#include "base/topology.hpp"
#include "bench/import_phantoms.hpp"
#include "engine/importing/import_segmentation.hpp"
#include "engine/importing/import_vessel.hpp"
#include "engine/importing/label_surface.hpp"

#include <numbers>

using namespace trocar;
using namespace trocar::engine;
using namespace trocar::import_test;

namespace {

constexpr double kVoxel = 0.5; // mm

Branch straight() { return {{{16, 16, 6}, {16, 16, 58}}, {4, 4}}; }
Branch tapering() { return {{{16, 16, 6}, {16, 16, 58}}, {5, 2}}; }
Branch slanting() { return {{{8, 9, 6}, {24, 22, 58}}, {3.2, 3.2}}; }
Branch bent() {
    Branch branch;
    for (int i = 0; i <= 40; ++i) {
        const double a = std::numbers::pi * i / 40;
        branch.axis.emplace_back(16, 28 - 16 * std::cos(a), 12 + 20 * std::sin(a));
        branch.radii.push_back(3);
    }
    return branch;
}
std::vector<Branch> branching() { return {{{{16, 26, 6}, {16, 26, 30}}, {4, 4}}, {{{16, 26, 30}, {16, 10, 58}}, {3, 3}}, {{{16, 26, 30}, {16, 44, 58}}, {2.5, 2.5}}}; }

struct Imported {
    SegmentSurface segment;
    ImportedVessel vessel;
};

class Phantoms : public Folder {
protected:
    Result<Imported> import(const Phantom& phantom) {
        Result<SegmentSurface> segment = read_segment(write("phantom.nrrd", nrrd_gzip(phantom)), "", {});
        if (!segment.ok()) return segment.error();
        VesselOptions options;
        options.openings = segment->cut;
        Result<ImportedVessel> vessel = import_vessel(segment->mesh, options);
        if (!vessel.ok()) return vessel.error();
        return Imported{std::move(*segment), std::move(*vessel)};
    }
};

/// m -> the phantom's own frame, mm.
Vec3 own_place(const Phantom& phantom, const Vec3& p) { return phantom.turn.transpose() * (to_ras(1e3 * p) - phantom.origin); }

/// mm; largest difference between the radii of the centreline and of the phantom. Left out: points near ends, and those whose inscribed sphere
/// another branch widens, since it reaches into that one.
double radius_error(const Phantom& phantom, const std::vector<Branch>& branches, const ImportedVessel& vessel, std::size_t& counted) {
    const double voxel = phantom.spacing.maxCoeff();
    double most = 0.0;
    counted = 0;
    for (const CentrelineBranch& branch : vessel.branches)
        for (std::size_t i = 0; i < branch.points.size(); ++i) {
            const Vec3 p = own_place(phantom, branch.points[i]);
            const NearestAxis near = nearest_axis(branches, p);
            bool skip = false;
            for (const Branch& each : branches)
                for (const Vec3& end : {each.axis.front(), each.axis.back()}) skip = skip || (p - end).norm() < 1.5 * near.radius;
            std::size_t reached = 0;
            for (const Branch& each : branches) {
                const NearestAxis wall = nearest_axis({each}, p);
                reached += wall.distance - wall.radius < near.radius + voxel;
            }
            skip = skip || reached > 1;
            if (skip) continue;
            ++counted;
            most = std::max(most, std::abs(1e3 * branch.radii[i] - near.radius));
            EXPECT_LT(near.distance, voxel) << "off the axis";
        }
    return most;
}

/// A shape of random size, bend and direction, mm; radii between 2.5 and 8 of the longest voxel sides.
std::vector<Branch> random_shape(const std::string& kind, Dice& dice, double voxel) {
    const Mat3 turn = dice.turn();
    const double r = voxel * dice.between(5.0, 8.0);
    const auto at = [&](double x, double y, double z) -> Vec3 { return r * (turn * Vec3(x, y, z)); };
    if (kind == "straight") return {{{at(0, 0, 0), at(0, 0, 14)}, {r, r}}};
    if (kind == "tapering") return {{{at(0, 0, 0), at(0, 0, 16)}, {r, r * dice.between(0.5, 0.8)}}};
    if (kind == "bent") {
        const double bend = dice.between(3, 6), whole = dice.between(1.5, 3.1);
        Branch branch;
        for (int i = 0; i <= 40; ++i) {
            const double a = whole * i / 40;
            branch.axis.push_back(at(bend * std::cos(a), bend * std::sin(a), 0));
            branch.radii.push_back(r);
        }
        return {branch};
    }
    std::vector<Branch> branches{{{at(0, 0, -9), at(0, 0, 0)}, {r, r}}};
    for (const double side : {-1.0, 1.0}) {
        const double a = side * dice.between(0.4, 0.8), own = r * dice.between(0.5, 0.9);
        branches.push_back({{at(0, 0, 0), at(10 * std::sin(a), 0, 10 * std::cos(a))}, {own, own}});
    }
    return branches;
}

/// Moves the branches so that a grid which begins at 0 holds them with at least two empty voxels all round; returns its size.
std::array<std::size_t, 3> move_into_grid(std::vector<Branch>& branches, const Vec3& spacing, Dice& dice) {
    Vec3 low = Vec3::Constant(1e30), high = -low;
    for (const Branch& branch : branches)
        for (std::size_t i = 0; i < branch.axis.size(); ++i) {
            low = low.cwiseMin(branch.axis[i] - Vec3::Constant(branch.radii[i]));
            high = high.cwiseMax(branch.axis[i] + Vec3::Constant(branch.radii[i]));
        }
    const Vec3 shift = spacing.cwiseProduct(Vec3(dice.between(2, 3), dice.between(2, 3), dice.between(2, 3))) - low;
    for (Branch& branch : branches)
        for (Vec3& p : branch.axis) p += shift;
    std::array<std::size_t, 3> size{};
    for (int a = 0; a < 3; ++a) size[static_cast<std::size_t>(a)] = static_cast<std::size_t>((high - low)[a] / spacing[a]) + 6;
    return size;
}

void expect_sound(const ImportedVessel& vessel) {
    EXPECT_TRUE(check_closed_surface(vessel.surface).ok());
    EXPECT_EQ(find_self_intersections(vessel.surface).count, 0u);
}

} // namespace

TEST_F(Phantoms, HaveRadiiWithinHalfAVoxel) {
    const std::pair<const char*, std::vector<Branch>> cases[] = {
        {"straight", {straight()}}, {"slanting", {slanting()}}, {"tapering", {tapering()}}, {"bent", {bent()}}, {"branching", branching()}};
    for (const auto& [name, branches] : cases) {
        SCOPED_TRACE(name);
        const Phantom phantom = make_phantom(branches, {64, 112, 128}, Vec3::Constant(kVoxel));
        const Result<Imported> made = import(phantom);
        ASSERT_TRUE(made.ok()) << made.error().to_string();
        expect_sound(made->vessel);
        std::size_t counted = 0;
        const double error = radius_error(phantom, branches, made->vessel, counted);
        RecordProperty(name, fmt::format("{:.3f}", error));
        std::printf("%-10s radius error at most %.3f mm = %.2f voxels at %zu points, %zu ends\n", name, error, error / kVoxel, counted, made->vessel.ends.size());
        EXPECT_LE(error, 0.5 * kVoxel);
        EXPECT_GT(counted, 10u);
        EXPECT_EQ(made->vessel.ends.size(), name == std::string("branching") ? 3u : 2u);
    }
}

TEST_F(Phantoms, HaveRadiiWithinHalfAVoxelWhateverTheirShapeSpacingAndDirection) {
    for (const std::string kind : {"straight", "tapering", "bent", "branching"})
        for (std::uint64_t seed = 1; seed <= 3; ++seed) {
            SCOPED_TRACE(fmt::format("{} {}", kind, seed));
            Dice dice(seed + 100 * kind.size());
            const double even = seed % 2 == 0 ? 1.0 : 1.6; // every other one with voxels of three lengths
            const Vec3 spacing(dice.between(0.5, 0.5 * even), dice.between(0.5, 0.5 * even), dice.between(0.5, 0.5 * even));
            const double voxel = spacing.maxCoeff();
            std::vector<Branch> branches = random_shape(kind, dice, voxel);
            const std::array<std::size_t, 3> size = move_into_grid(branches, spacing, dice);
            const Phantom phantom = make_phantom(branches, size, spacing, dice.turn(), Vec3(dice.between(-200, 200), 40, dice.between(-900, 900)));
            const Result<Imported> made = import(phantom);
            ASSERT_TRUE(made.ok()) << made.error().to_string();
            EXPECT_EQ(made->vessel.ends.size(), kind == "branching" ? 3u : 2u);
            std::size_t counted = 0;
            EXPECT_LE(radius_error(phantom, branches, made->vessel, counted), 0.5 * voxel);
            EXPECT_GT(counted, 5u);
        }
}

/// What a mask leaves open most: which of the voxels whose centres lie on the wall are inside is up to rounding.
TEST_F(Phantoms, HaveRadiiWithinHalfAVoxelWhereTheirWallRunsAlongRowsOfVoxels) {
    const std::vector<Branch> branches{{{{8, 32, 4}, {8, 32, 28}}, {4, 4}}, {{{8, 32, 28}, {8, 14, 60}}, {3, 3}}, {{{8, 32, 28}, {8, 52, 60}}, {2.5, 2.5}}};
    const auto drawn = [&](double wider) {
        std::vector<Branch> other = branches;
        for (Branch& branch : other)
            for (double& radius : branch.radii) radius += wider;
        return make_phantom(other, {32, 112, 132}, Vec3::Constant(kVoxel));
    };
    const Phantom outside = drawn(-1e-9), inside = drawn(1e-9);
    EXPECT_NE(outside.voxels, inside.voxels);
    for (const double share : {0.0, 0.4, 1.0}) {
        SCOPED_TRACE(share);
        Dice dice(7);
        Phantom phantom = outside;
        for (std::size_t v = 0; v < phantom.voxels.size(); ++v)
            if (outside.voxels[v] != inside.voxels[v] && dice.between(0, 1) < share) phantom.voxels[v] = 1;
        const Result<Imported> made = import(phantom);
        ASSERT_TRUE(made.ok()) << made.error().to_string();
        std::size_t counted = 0;
        const double error = radius_error(phantom, branches, made->vessel, counted);
        std::printf("%.1f of the centres on the wall inside: radius error at most %.3f voxels\n", share, error / kVoxel);
        EXPECT_LE(error, 0.5 * kVoxel);
        EXPECT_GT(counted, 20u);
    }
}

TEST_F(Phantoms, OfTheBenchHaveRadiiWithinHalfAVoxel) {
    for (const LabelPhantom& phantom : make_phantoms(false)) {
        if (phantom.size > 128) continue;
        SCOPED_TRACE(phantom.name);
        const fs::path file = folder / "phantom.nrrd";
        ASSERT_TRUE(write_phantom(phantom, file).ok());
        const Result<SegmentSurface> segment = read_segment(file, "", {});
        ASSERT_TRUE(segment.ok()) << segment.error().to_string();
        const Result<ImportedVessel> vessel = import_vessel(segment->mesh, {});
        ASSERT_TRUE(vessel.ok()) << vessel.error().to_string();
        const RadiusError error = measure_radii(phantom, vessel->branches);
        EXPECT_LE(error.most, 0.5 * phantom.voxel);
        EXPECT_GT(error.points, 15u);
    }
}

TEST_F(Phantoms, HaveTheVolumeOfTheirVoxelsWhateverTheirSpacingAndTheirTurn) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        Dice dice(seed);
        const Vec3 spacing(dice.between(0.4, 0.7), dice.between(0.4, 0.7), dice.between(0.5, 0.9));
        Mat3 turn = dice.turn();
        if (seed % 2 == 0) turn.col(0) *= -1.0; // left-handed: files may count either way
        const std::vector<Branch> branches{slanting()};
        const Phantom phantom = make_phantom(branches, {80, 80, 130}, spacing, turn, Vec3(dice.between(-200, 200), 40, dice.between(-900, 900)));
        const Result<Imported> made = import(phantom);
        ASSERT_TRUE(made.ok()) << seed << ": " << made.error().to_string();
        expect_sound(made->vessel);
        const auto voxels = static_cast<double>(std::count(phantom.voxels.begin(), phantom.voxels.end(), '\1'));
        const double volume = 1e-9 * voxels * spacing.prod();
        EXPECT_NEAR(signed_volume(made->vessel.surface) / volume, 1.0, 0.01);
        std::size_t counted = 0;
        EXPECT_LE(radius_error(phantom, branches, made->vessel, counted), 0.5 * spacing.maxCoeff()) << seed;
        EXPECT_GT(counted, 10u);
    }
}

TEST_F(Phantoms, OfAVoxelOrTwoStayWithinAVoxelOfTheirBorder) {
    const std::tuple<const char*, std::size_t, std::size_t> boxes[] = {{"a voxel", 1, 1}, {"a line", 1, 20}, {"two by two", 2, 20}, {"three by three", 3, 3}};
    for (const auto& [name, width, length] : boxes) {
        SCOPED_TRACE(name);
        Phantom phantom = make_phantom({straight()}, {12, 12, 32}, Vec3(0.4, 0.5, 0.6));
        std::fill(phantom.voxels.begin(), phantom.voxels.end(), '\0');
        for (std::size_t k = 0; k < length; ++k)
            for (std::size_t j = 0; j < width; ++j)
                for (std::size_t i = 0; i < width; ++i) phantom.voxels[phantom.at(4 + i, 4 + j, 4 + k)] = 1;
        const Result<LabelVolume> volume = read_label_volume(write("small.nrrd", nrrd_gzip(phantom)));
        ASSERT_TRUE(volume.ok());
        const Result<LabelMask> mask = make_mask(*volume, "");
        ASSERT_TRUE(mask.ok());
        const Result<LabelSurface> surface = make_label_surface(*mask, {});
        ASSERT_TRUE(surface.ok()) << surface.error().to_string();
        EXPECT_TRUE(check_closed_surface(surface->mesh).ok());
        EXPECT_EQ(find_self_intersections(surface->mesh).count, 0u);
        EXPECT_LE(surface->smoothing, 0.6e-3);
        EXPECT_GT(surface->volume, 0.1 * surface->mask_volume);
        EXPECT_LT(surface->volume, 1.05 * surface->mask_volume);
    }
}

TEST_F(Phantoms, ThatTheVolumesSidesCutOpenThere) {
    const Branch through{{{16, 16, -5}, {16, 16, 90}}, {4, 3}};
    const Phantom phantom = make_phantom({through}, {64, 64, 128}, Vec3::Constant(kVoxel));
    const Result<Imported> made = import(phantom);
    ASSERT_TRUE(made.ok()) << made.error().to_string();
    ASSERT_EQ(made->segment.cut.size(), 2u);
    ASSERT_EQ(made->vessel.ends.size(), 2u);
    EXPECT_TRUE(made->vessel.ends[0].open && made->vessel.ends[1].open);
    EXPECT_EQ(made->vessel.ends[0].name, "inlet");
    EXPECT_NEAR(1e3 * made->vessel.ends[0].radius, 4.0 - 5.0 / 95.0, 0.3) << "the wider end";
    EXPECT_NEAR(1e3 * made->vessel.ends[0].centre.z(), -0.25, 0.01);
    EXPECT_GT(made->vessel.direction.z(), 0.99);
}

TEST_F(Phantoms, LoseIslandsAndHolesThatAreCounted) {
    Phantom phantom = make_phantom({straight()}, {64, 64, 128}, Vec3::Constant(kVoxel));
    phantom.voxels[phantom.at(2, 2, 2)] = 1;
    phantom.voxels[phantom.at(60, 60, 9)] = phantom.voxels[phantom.at(60, 61, 9)] = 1;
    phantom.voxels[phantom.at(32, 32, 60)] = 0;
    const Result<Imported> made = import(phantom);
    ASSERT_TRUE(made.ok()) << made.error().to_string();
    ASSERT_GE(made->segment.repairs.size(), 2u);
    EXPECT_NE(made->segment.repairs[0].find("islands: 2 parts of 3 voxels removed"), std::string::npos) << made->segment.repairs[0];
    EXPECT_NE(made->segment.repairs[1].find("holes: 1 cavities of 1 voxels filled"), std::string::npos) << made->segment.repairs[1];
}

TEST_F(Phantoms, GiveTheSameSurfaceFromEveryFormat) {
    const Phantom phantom = make_phantom({slanting()}, {64, 64, 128}, Vec3::Constant(kVoxel));
    const Result<SegmentSurface> a = read_segment(write("a.nrrd", nrrd_raw(phantom)), "", {});
    const Result<SegmentSurface> b = read_segment(write("b.nii.gz", gzip_bytes(nifti(phantom)).value()), "1", {});
    const Result<SegmentSurface> c = read_segment(write("c.mha", metaimage_header(phantom, "LOCAL") + phantom.voxels), "", {});
    ASSERT_TRUE(a.ok() && b.ok() && c.ok());
    EXPECT_EQ(a->mesh.triangles, c->mesh.triangles);
    EXPECT_NEAR(signed_volume(a->mesh), signed_volume(b->mesh), 1e-6 * signed_volume(a->mesh));
    ASSERT_FALSE(read_segment(folder / "a.nrrd", "7", {}).ok());
    EXPECT_NE(read_segment(folder / "a.nrrd", "7", {}).error().to_string().find("no segment '7'; known: 1"), std::string::npos);
}
