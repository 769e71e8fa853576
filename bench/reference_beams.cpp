#include "bench/reference_beams.hpp"

#include "engine/io/file_bytes.hpp"
#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/statics.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <sstream>

namespace trocar::engine {

namespace {

constexpr ReferenceBeam kBeams[] = {
    {BeamSource::SofaLinear, "SOFA cantilever, linear tetrahedra", "SOFA linear", "sofa_cantilever_tet_linear.reference_mstate.txt.gz",
     0.995, 1.005,
     "the same mesh and law; SOFA's beam is 0.99 s into a damped motion, ours at rest, and its mass is of the grid's cubes, ours lumped"},
    {BeamSource::SofaCorotational, "SOFA cantilever, corotational tetrahedra", "SOFA corotational",
     "sofa_cantilever_tet_corotational.reference_mstate.txt.gz", 0.995, 1.005,
     "the same, with frames that turn: SOFA takes them from edges, here from the polar decomposition"},
    {BeamSource::CalculixQuadratic, "CalculiX beam10p, quadratic tetrahedra", "CalculiX beam10p", "ccx_beam10p.dat.ref.gz", 0.85, 1.0,
     "CalculiX's elements bend (C3D10), linear ones do not: the share that is missing is this mesh's against Timoshenko"},
};

/// A cantilever along x, fixed at x = 0.
struct Bar {
    TetMesh mesh;
    std::vector<Index> fixed, end;
};

Bar make_bar(std::array<Index, 3> cells, const Vec3& size) {
    Bar bar{fem::make_bar_mesh(cells, 1.0, 0.0), {}, {}};
    for (Index node = 0; node < bar.mesh.vertices.size(); ++node) {
        Vec3& x = bar.mesh.vertices[node];
        if (x[0] == 0.0) bar.fixed.push_back(node);
        if (x[0] == cells[0]) bar.end.push_back(node);
        for (int axis = 0; axis < 3; ++axis) x[axis] *= size[axis] / cells[static_cast<std::size_t>(axis)];
    }
    return bar;
}

/// The scene's beam and its split: 5 x 5 x 30 nodes, 20 x 20 x 200 mm along z, six tets in a cell, each cell the mirror image of its
/// neighbours. A corner's number has a bit for each axis.
Bar make_sofa_bar() {
    constexpr std::array<Index, 3> kNodes{5, 5, 30};
    constexpr Index kSplit[6][4] = {{0, 5, 1, 7}, {0, 1, 2, 7}, {1, 2, 7, 3}, {7, 2, 0, 6}, {7, 6, 0, 5}, {6, 5, 4, 0}};
    Bar bar;
    const auto id = [&](Index i, Index j, Index k) { return (k * kNodes[1] + j) * kNodes[0] + i; };
    for (Index k = 0; k < kNodes[2]; ++k)
        for (Index j = 0; j < kNodes[1]; ++j)
            for (Index i = 0; i < kNodes[0]; ++i) {
                if (k == 0) bar.fixed.push_back(id(i, j, k));
                if (k == kNodes[2] - 1) bar.end.push_back(id(i, j, k));
                bar.mesh.vertices.push_back({0.005 * i - 0.01, 0.005 * j - 0.01, 0.2 / 29.0 * k});
            }
    for (Index k = 0; k + 1 < kNodes[2]; ++k)
        for (Index j = 0; j + 1 < kNodes[1]; ++j)
            for (Index i = 0; i + 1 < kNodes[0]; ++i) {
                const Index mirrored = (i % 2 == 0 ? 1u : 0u) | (j % 2) << 1 | (k % 2) << 2;
                for (const auto& corners : kSplit) {
                    Tet tet;
                    for (std::size_t c = 0; c < 4; ++c) {
                        const Index corner = corners[c] ^ mirrored;
                        tet[c] = id(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
                    }
                    const auto edge = [&](std::size_t c) { return Vec3(bar.mesh.vertices[tet[c]] - bar.mesh.vertices[tet[0]]); };
                    if (edge(1).cross(edge(2)).dot(edge(3)) < 0.0) std::swap(tet[2], tet[3]);
                    bar.mesh.tets.push_back(tet);
                }
            }
    return bar;
}

double mean_along(std::span<const Vec3> moved, const Bar& bar, int axis) {
    double sum = 0.0;
    for (const Index node : bar.end) sum += moved[node][axis];
    return sum / static_cast<double>(bar.end.size());
}

/// E 2 MPa, nu 0.45, 1100 kg/m^3, under 9.81 m/s^2.
Result<double> sofa_tip_here(fem::MaterialLaw law, bool small_strain) {
    const Bar bar = make_sofa_bar();
    const auto model =
        fem::make_tissue_model(bar.mesh,
                               {.law = law,
                                .young_modulus = 2e6,
                                .poisson_ratio = 0.45,
                                .density = 1100.0,
                                .elements = fem::TetElements::Linear}, // as SOFA's
                               bar.fixed);
    if (!model) return model.error();
    std::vector<Vec3> weight;
    for (const double mass : model->node_mass) weight.push_back(Vec3(0.0, -9.81 * mass, 0.0));
    if (small_strain) return mean_along(fem::solve_small_strain(*model, weight), bar, 1);
    const fem::Equilibrium found = fem::find_equilibrium(*model, weight, 2);
    if (!(found.residual < 1e-6)) return Error{.code = ErrorCode::BadValue, .message = "the corotational beam found no equilibrium"};
    return mean_along(found.position, bar, 1); // its axis stands at 0
}

/// The last line of positions: " X= x y z x y z ...", nodes along z last; the last 25 are the free end, at y = -10 .. 10 mm.
Result<double> sofa_tip(const std::string& text, std::string_view file) {
    const std::size_t at = text.rfind("X=");
    std::istringstream in(at == std::string::npos ? std::string() : text.substr(at + 2));
    std::vector<double> numbers;
    for (double value; in >> value;) numbers.push_back(value);
    if (numbers.size() < 5 * 5 * 30 * 3)
        return Error{.code = ErrorCode::BadSyntax,
                     .message = fmt::format("{} ends with {} numbers, not with the positions of 750 nodes", file, numbers.size())};
    double sum = 0.0;
    for (std::size_t node = 725; node < 750; ++node) sum += numbers[3 * node + 1];
    return sum / 25.0;
}

/// 1 x 1 x 8, E 210000, nu 0.3 (the deck's mm and MPa), nine nodes of the free end pulled by 1 each: 9 N.
Result<double> calculix_tip_here(bool quick) {
    const Index across = quick ? 4 : 8;
    const Bar bar = make_bar({8 * across, across, across}, {8.0, 1.0, 1.0});
    const auto model = fem::make_tissue_model(
        bar.mesh, {.law = fem::MaterialLaw::NeoHookean, .young_modulus = 210000.0, .poisson_ratio = 0.3, .density = 1.0}, bar.fixed);
    if (!model) return model.error();
    std::vector<Vec3> force(model->node_count(), Vec3::Zero());
    double weight = 0.0;
    for (const Index node : bar.end) weight += model->node_mass[node];
    for (const Index node : bar.end) force[node][1] = 9.0 * model->node_mass[node] / weight;
    return mean_along(fem::solve_small_strain(*model, force), bar, 1);
}

/// Nodes 10 to 18 of the first table of displacements are the free end.
Result<double> calculix_tip(const std::string& text, std::string_view file) {
    std::istringstream in(text);
    double sum = 0.0;
    int found = 0;
    for (std::string line; std::getline(in, line) && found < 9;) {
        std::istringstream row(line);
        int node = 0;
        double x = 0.0, y = 0.0;
        if (row >> node >> x >> y && node >= 10 && node <= 18) sum += y, ++found;
    }
    if (found < 9) return Error{.code = ErrorCode::BadSyntax, .message = fmt::format("{} has no displacements of nodes 10 to 18", file)};
    return sum / 9.0;
}

} // namespace

std::span<const ReferenceBeam> reference_beams() { return kBeams; }

Result<BeamTips> compare_beam(const ReferenceBeam& beam, const std::filesystem::path& folder, bool quick) {
    const Result<std::string> text = read_file_bytes(folder / beam.file);
    if (!text) return text.error();
    const bool calculix = beam.source == BeamSource::CalculixQuadratic;
    const Result<double> theirs = calculix ? calculix_tip(*text, beam.file) : sofa_tip(*text, beam.file);
    if (!theirs) return theirs.error();
    const Result<double> ours =
        calculix ? calculix_tip_here(quick) : sofa_tip_here(fem::MaterialLaw::Corotational, beam.source == BeamSource::SofaLinear);
    if (!ours) return ours.error();
    const double unit = calculix ? 1e-3 : 1.0; // the deck's mm
    return BeamTips{unit * *ours, unit * *theirs};
}

} // namespace trocar::engine
