// What is written is read back: nothing is lost beyond the digits of the format.
#include "phantoms.hpp"

#include "assets/anatomy/shapes.hpp"
#include "engine/importing/curve_set.hpp"
#include "engine/importing/import_curves.hpp"
#include "engine/importing/vessel_files.hpp"
#include "engine/io/markups.hpp"
#include "engine/io/read_lines.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/write_mesh.hpp"

using namespace trocar;
using namespace trocar::engine;
using namespace trocar::import_test;

namespace {

using RoundTrips = Folder;

/// Random trees: each branch begins on an earlier one.
std::vector<CentrelineBranch> random_branches(std::uint64_t seed) {
    Dice dice(seed);
    std::vector<CentrelineBranch> branches;
    for (Index b = 0; b < 5; ++b) {
        CentrelineBranch branch;
        branch.parent = b == 0 ? kNoIndex : static_cast<Index>(dice.between(0, b));
        Vec3 at = b == 0 ? Vec3(0, 0, 0) : branches[branch.parent].points.back();
        if (b > 0) branches[branch.parent].ends = false;
        for (int i = 0; i < 7; ++i, at += Vec3(dice.between(-1, 1), dice.between(-1, 1), dice.between(0.5, 2)) * 1e-3) {
            branch.points.push_back(at);
            branch.radii.push_back(dice.between(1e-4, 5e-3));
        }
        branches.push_back(branch);
    }
    return branches;
}

} // namespace

TEST_F(RoundTrips, OfCentrelinesAsVmtkNamesThemLoseNothing) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        const std::vector<CentrelineBranch> branches = random_branches(seed);
        ASSERT_TRUE(write_centreline_vtp(folder / "line.vtp", branches).ok());
        const Result<LineMesh> lines = read_centreline_lines(folder / "line.vtp");
        ASSERT_TRUE(lines.ok()) << lines.error().to_string();
        ASSERT_EQ(lines->lines.size(), branches.size());
        ASSERT_EQ(lines->groups.size(), branches.size());
        ASSERT_EQ(lines->tracts.size(), branches.size());
        ASSERT_EQ(lines->centrelines.size(), branches.size());
        ASSERT_EQ(lines->blanking.size(), branches.size());
        for (std::size_t b = 0; b < branches.size(); ++b) {
            ASSERT_EQ(lines->lines[b].size(), branches[b].points.size());
            EXPECT_EQ(lines->groups[b], static_cast<double>(b));
            for (std::size_t i = 0; i < branches[b].points.size(); ++i) {
                EXPECT_EQ(lines->points[lines->lines[b][i]], Vec3(1e3 * branches[b].points[i]));
                EXPECT_EQ(lines->radii[lines->lines[b][i]], 1e3 * branches[b].radii[i]);
            }
        }
    }
}

TEST_F(RoundTrips, OfMarkupsLoseNothing) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
        Dice dice(seed);
        std::vector<Markup> markups(2);
        markups[0].name = "a \"curve\" \\ \xc3\xa4";
        markups[1].type = "Fiducial";
        for (int i = 0; i < 9; ++i)
            for (Markup& markup : markups) {
                markup.points.emplace_back(dice.between(-1, 1), dice.between(-1, 1), dice.between(-1, 1));
                markup.labels.push_back(fmt::format("p{}", i));
                if (markup.type == "Curve") markup.radii.push_back(dice.between(0, 0.01));
            }
        ASSERT_TRUE(write_markups(folder / "a.mrk.json", markups).ok());
        const Result<std::vector<Markup>> read = read_markups(folder / "a.mrk.json");
        ASSERT_TRUE(read.ok()) << read.error().to_string();
        ASSERT_EQ(read->size(), 2u);
        for (std::size_t m = 0; m < 2; ++m) {
            EXPECT_EQ((*read)[m].type, markups[m].type);
            EXPECT_EQ((*read)[m].name, markups[m].name);
            EXPECT_EQ((*read)[m].labels, markups[m].labels);
            ASSERT_EQ((*read)[m].points.size(), markups[m].points.size());
            ASSERT_EQ((*read)[m].radii.size(), markups[m].radii.size());
            for (std::size_t i = 0; i < 9; ++i) EXPECT_LT(((*read)[m].points[i] - markups[m].points[i]).norm(), 1e-15);
        }
        // Once more through the file: the same bytes.
        ASSERT_TRUE(write_markups(folder / "b.mrk.json", *read).ok());
        const Result<std::vector<Markup>> again = read_markups(folder / "b.mrk.json");
        ASSERT_TRUE(again.ok());
    }
}

TEST_F(RoundTrips, OfSurfacesAndVolumesLoseNothingBeyondSinglePrecisionOfStl) {
    const TriMesh mesh = anatomy::make_icosphere({0.1, -0.2, 0.3}, 0.05, 3);
    ASSERT_TRUE(write_vtp(folder / "a.vtp", mesh).ok());
    const Result<TriMesh> vtp = read_surface(folder / "a.vtp");
    ASSERT_TRUE(vtp.ok());
    EXPECT_EQ(vtp->triangles, mesh.triangles);
    EXPECT_EQ(vtp->vertices, mesh.vertices);
    ASSERT_TRUE(write_stl(folder / "a.stl", mesh).ok());
    const Result<TriMesh> stl = read_surface(folder / "a.stl");
    ASSERT_TRUE(stl.ok()) << stl.error().to_string();
    ASSERT_EQ(stl->triangles.size(), mesh.triangles.size());
    EXPECT_EQ(stl->vertices.size(), mesh.vertices.size()) << "no two vertices fall together";
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
            for (int axis = 0; axis < 3; ++axis)
                EXPECT_EQ(stl->vertices[stl->triangles[t][k]][axis], static_cast<double>(static_cast<float>(mesh.vertices[mesh.triangles[t][k]][axis])));
}

TEST_F(RoundTrips, OfAVesselThroughItsCentrelineKeepItsRadii) {
    const NamedCurve trunk{"trunk", {{0, 0, 0}, {0, 0, 0.03}, {0, 0, 0.06}}, {0.004, 0.004, 0.004}};
    const NamedCurve side{"side", {{0, 0, 0.03}, {0.01, 0, 0.05}, {0.02, 0, 0.08}}, {0.002, 0.002, 0.002}};
    CurveSet set;
    set.curves = {trunk, side};
    const Result<ImportedVessel> first = import_curve_set(set, {});
    ASSERT_TRUE(first.ok()) << first.error().to_string();
    EXPECT_EQ(first->ends.size(), 3u);
    ASSERT_TRUE(write_centreline_vtp(folder / "c.vtp", first->branches).ok());
    const Result<CurveSet> again = read_vmtk(folder / "c.vtp");
    ASSERT_TRUE(again.ok()) << again.error().to_string();
    const Result<ImportedVessel> second = import_curve_set(*again, {});
    ASSERT_TRUE(second.ok()) << second.error().to_string();
    EXPECT_EQ(second->ends.size(), 3u);
    EXPECT_NEAR(second->targets[0].narrowest, first->targets[0].narrowest, 2e-4);
}

TEST_F(RoundTrips, OfMarkupsTurnLeftPosteriorIntoRightAnterior) {
    const auto first = [&](const std::string& more) {
        const auto read = read_markups(write("turned.mrk.json", R"({"markups": [{"type": "Curve", )" + more +
                                                                R"("controlPoints": [{"position": [1, 2, 3]}, {"position": [4, 5, 6]}]}]})"));
        return read.ok() ? Vec3(1e3 * (*read)[0].points[0]) : Vec3(Vec3::Zero());
    };
    EXPECT_LT((first("") - Vec3(-1, -2, 3)).norm(), 1e-9); // Slicer's own default
    EXPECT_LT((first(R"("coordinateSystem": "LPS", )") - Vec3(-1, -2, 3)).norm(), 1e-9);
    EXPECT_LT((first(R"("coordinateSystem": "RAS", )") - Vec3(1, 2, 3)).norm(), 1e-9);
}

TEST_F(RoundTrips, OfBrokenCentrelinesAreRefusedWithWhatWasExpected) {
    const auto markups = [&](const std::string& text) { return read_markups(write("x.mrk.json", text)); };
    const auto says = [](const auto& read, const char* piece) { return !read.ok() && read.error().to_string().find(piece) != std::string::npos; };
    EXPECT_TRUE(says(markups("{"), "no well-formed JSON"));
    EXPECT_TRUE(says(markups("[]"), "\"markups\" is missing"));
    EXPECT_TRUE(says(markups(R"({"markups": []})"), "holds no markup"));
    EXPECT_TRUE(says(markups(std::string(100000, '[')), "nested deeper"));
    const std::string one = R"({"markups": [{"type": "Curve", "controlPoints": [{"position": [1, 2, 3]}, {"position": [1, 2, 5]}]}]})";
    EXPECT_TRUE(markups(one).ok());
    const auto with = [&](const std::string& from, const std::string& to) {
        std::string text = one;
        return text.replace(text.find(from), from.size(), to);
    };
    const auto twice = markups(R"({"markups": [{"type": "Curve", "controlPoints": [{"id": "7", "position": [1, 2, 3]}, {"id": "7", "position": [1, 2, 5]}]}]})");
    EXPECT_TRUE(twice.ok()) << "as Slicer writes joined curves";
    EXPECT_TRUE(says(markups(with("[1, 2, 3]", "[1, 2]")), "markups[0].controlPoints[0].position: expected three numbers"));
    EXPECT_TRUE(says(markups(with("[1, 2, 3]", "[1, 1e400, 3]")), "too large"));
    EXPECT_TRUE(says(markups(with("\"type\"", R"("coordinateSystem": "XYZ", "type")")), "coordinateSystem: expected LPS or RAS"));
    EXPECT_TRUE(says(markups(with("\"type\"", R"("coordinateUnits": "furlong", "type")")), "found 'furlong'"));
    EXPECT_TRUE(says(markups(with("\"type\"", R"("measurements": [{"name": "Radius", "controlPointValues": [1]}], "type")")), "expected 2 numbers"));
    EXPECT_TRUE(says(markups(with("\"type\"", R"("measurements": [{"name": "Radius", "controlPointValues": [1, -1]}], "type")")), "not negative"));
    EXPECT_TRUE(says(read_slicer(write("y/a.mrk.json", one).parent_path()), "the curve has no radii"));
    // A line that comes back to where it was.
    const std::vector<Vec3> points{{0, 0, 0}, {0, 0, 1}, {0, 1, 1}};
    const std::vector<std::vector<Index>> cycle{{0, 1, 2, 0}};
    const std::vector<double> radii{1, 1, 1}, wrong{1, 1, -1};
    const DataArray array[] = {{"MaximumInscribedSphereRadius", 1, radii}};
    ASSERT_TRUE(write_vtp_lines(folder / "cycle.vtp", points, cycle, {array, {}}).ok());
    EXPECT_TRUE(says(read_vmtk(folder / "cycle.vtp"), "line 0 passes point 0 twice"));
    const DataArray negative[] = {{"MaximumInscribedSphereRadius", 1, wrong}};
    const std::vector<std::vector<Index>> line{{0, 1, 2}};
    ASSERT_TRUE(write_vtp_lines(folder / "negative.vtp", points, line, {negative, {}}).ok());
    EXPECT_TRUE(says(read_vmtk(folder / "negative.vtp"), "point 2 has the radius -1"));
    ASSERT_TRUE(write_vtp_lines(folder / "none.vtp", points, line).ok());
    EXPECT_TRUE(says(read_vmtk(folder / "none.vtp"), "MaximumInscribedSphereRadius"));
    EXPECT_TRUE(says(read_simvascular(folder), "")) << "no project";
}
