#include "fem/tissue/tissue.hpp"

#include "fem/tissue/prism_pairs.hpp"
#include "fem/tissue/prisms.hpp"

#include "base/short_number.hpp"
#include "fem/mesh/mesh_parts.hpp"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace trocar::fem {

namespace {

Error bad_mesh(std::string message) { return {.code = ErrorCode::BadMesh, .message = std::move(message)}; }

std::string name_tet(std::size_t tet, const Tet& nodes) {
    return "tet " + std::to_string(tet) + " (nodes " + std::to_string(nodes[0]) + ", " + std::to_string(nodes[1]) + ", " +
           std::to_string(nodes[2]) + ", " + std::to_string(nodes[3]) + ")";
}

Result<void> check_nodes(const TetMesh& mesh) {
    if (mesh.tets.empty()) return bad_mesh("the mesh has no tetrahedra");
    for (std::size_t node = 0; node < mesh.vertices.size(); ++node)
        if (!is_finite(mesh.vertices[node])) return bad_mesh("node " + std::to_string(node) + " is not finite");
    for (std::size_t tet = 0; tet < mesh.tets.size(); ++tet) {
        const Tet& t = mesh.tets[tet];
        for (const Index node : t)
            if (node >= mesh.vertices.size())
                return bad_mesh(name_tet(tet, t) + " names a node beyond the last, " + std::to_string(mesh.vertices.size() - 1));
        for (int i = 0; i < 4; ++i)
            for (int j = i + 1; j < 4; ++j)
                if (t[i] == t[j]) return bad_mesh(name_tet(tet, t) + " names a node twice");
    }
    return {};
}

/// The same four nodes twice count twice in mass and stiffness: never intended.
Result<void> check_repeats(const TetMesh& mesh) {
    std::vector<std::pair<Tet, std::size_t>> sorted;
    for (std::size_t tet = 0; tet < mesh.tets.size(); ++tet) {
        sorted.emplace_back(mesh.tets[tet], tet);
        std::sort(sorted.back().first.begin(), sorted.back().first.end());
    }
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t k = 1; k < sorted.size(); ++k)
        if (sorted[k].first == sorted[k - 1].first)
            return bad_mesh(name_tet(sorted[k].second, mesh.tets[sorted[k].second]) + " is there already, as tet " +
                            std::to_string(sorted[k - 1].second));
    return {};
}

Result<void> check_connected(const TetMesh& mesh) {
    const std::vector<Index> part = find_node_parts(mesh);
    for (std::size_t tet = 0; tet < mesh.tets.size(); ++tet)
        if (part[mesh.tets[tet][0]] != part[mesh.tets[0][0]])
            return bad_mesh(name_tet(tet, mesh.tets[tet]) + " belongs to a part that shares no node with tet 0: a body is one piece");
    return {};
}

Result<TetShape> make_shape(const TetMesh& mesh, std::size_t tet) {
    const Tet& t = mesh.tets[tet];
    Mat3 edges;
    double longest_sq = 0.0;
    for (int i = 0; i < 4; ++i)
        for (int j = i + 1; j < 4; ++j) longest_sq = std::max(longest_sq, (mesh.vertices[t[i]] - mesh.vertices[t[j]]).squaredNorm());
    for (int k = 0; k < 3; ++k) edges.col(k) = mesh.vertices[t[k + 1]] - mesh.vertices[t[0]];
    const double volume = edges.determinant() / 6.0;
    if (!std::isfinite(longest_sq))
        return bad_mesh(name_tet(tet, t) + " is too large: the square of its longest edge is beyond any number");
    if (!(std::abs(volume) > kFlatTetRatio * longest_sq * std::sqrt(longest_sq)))
        return bad_mesh(name_tet(tet, t) + " is flat: volume " + short_number(volume) + " m^3");
    if (volume < 0.0) return bad_mesh(name_tet(tet, t) + " is inverted: swap two of its nodes");
    const Mat3 inverse = edges.inverse();
    TetShape shape{};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) shape.inverse[3 * i + j] = inverse(i, j);
    shape.volume = volume;
    shape.stiffness = 1.0;
    return shape;
}

/// Every factor positive and finite, one for each tet.
Result<void> check_factors(const TetMesh& mesh, std::span<const double> factors, const char* name) {
    if (factors.empty()) return {};
    const auto bad = [&](std::string what) {
        return Error{.code = ErrorCode::BadValue, .message = std::string(name) + " factors: " + what};
    };
    if (factors.size() != mesh.tets.size())
        return bad(std::to_string(factors.size()) + " of them for " + std::to_string(mesh.tets.size()) + " tets");
    for (std::size_t tet = 0; tet < factors.size(); ++tet)
        if (!(factors[tet] > 0.0) || !std::isfinite(factors[tet]))
            return bad(std::to_string(factors[tet]) + " of " + name_tet(tet, mesh.tets[tet]) + " is not a positive number");
    return {};
}

Result<void> add_mass(TissueModel& model, std::span<const double> density_factor) {
    model.node_mass.assign(model.node_count(), 0.0);
    for (std::size_t tet = 0; tet < model.tet_count(); ++tet) {
        const double density = model.material.density * (density_factor.empty() ? 1.0 : density_factor[tet]);
        const double quarter = 0.25 * density * model.tet_shape[tet].volume;
        for (const Index node : model.tet_nodes[tet]) model.node_mass[node] += quarter;
        model.volume += model.tet_shape[tet].volume;
    }
    model.mass = model.material.density * model.volume;
    if (!density_factor.empty()) model.mass = std::accumulate(model.node_mass.begin(), model.node_mass.end(), 0.0);
    model.inv_mass.resize(model.node_count());
    for (std::size_t node = 0; node < model.node_count(); ++node) {
        if (!(model.node_mass[node] > 0.0)) return bad_mesh("node " + std::to_string(node) + " belongs to no tet: drop it");
        model.inv_mass[node] = 1.0 / model.node_mass[node];
    }
    return {};
}

Vec3 centre_of_tet(const TissueModel& model, std::size_t tet) {
    const Tet& t = model.tet_nodes[tet];
    return 0.25 * (model.rest_position[t[0]] + model.rest_position[t[1]] + model.rest_position[t[2]] + model.rest_position[t[3]]);
}

Result<void> check_fibres(const TetMesh& mesh, std::span<const FibreAxes> fibres) {
    if (fibres.empty()) return {};
    if (fibres.size() != mesh.tets.size()) return bad_mesh(std::to_string(fibres.size()) + " tets have fibres; expected " + std::to_string(mesh.tets.size()));
    for (std::size_t tet = 0; tet < fibres.size(); ++tet)
        for (const double* axis : {fibres[tet].axis, fibres[tet].axis + 3})
            if (!(std::abs(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2] - 1.0) < 1e-6))
                return bad_mesh("a fibre of tet " + std::to_string(tet) + " is not of length 1");
    return {};
}

/// A tet's fibres are those of its centre, a patch's those of its tets' mean centre.
FibreAxes fibres_of_centre(const TissueModel& model, std::size_t first, std::size_t group, std::size_t lane) {
    const ForcePlan& plan = model.plan;
    Vec3 centre = Vec3::Zero();
    for (std::size_t b = first; b < first + group; ++b)
        centre += (plan.patched() ? plan.shares[b].share[lane] : 1.0) * centre_of_tet(model, plan.tet_of[b * kBatch + lane]);
    return find_fibres(model.material, centre);
}

/// Of given ones the line that those of its tets lie along most, since a fibre has no sense of direction: sum V a a^T stretches it most.
FibreAxes mean_fibres(const ForcePlan& plan, std::span<const FibreAxes> given, std::size_t first, std::size_t group, std::size_t lane) {
    if (group == 1) return given[plan.tet_of[first * kBatch + lane]];
    FibreAxes mean;
    for (std::size_t family = 0; family < 2; ++family) {
        Mat3 sum = Mat3::Zero();
        for (std::size_t b = first; b < first + group; ++b) {
            const double* axis = given[plan.tet_of[b * kBatch + lane]].axis + 3 * family;
            const Vec3 a(axis[0], axis[1], axis[2]);
            sum += plan.shares[b].share[lane] * a * a.transpose();
        }
        const Vec3 line = Eigen::SelfAdjointEigenSolver<Mat3>(sum).eigenvectors().col(2);
        for (int i = 0; i < 3; ++i) mean.axis[3 * family + static_cast<std::size_t>(i)] = line[i];
    }
    return mean;
}

void add_fibres(TissueModel& model, std::span<const FibreAxes> given) {
    ForcePlan& plan = model.plan;
    plan.fibres.resize(plan.batches.size());
    const std::size_t group = plan.patched() ? kPatch : 1;
    for (std::size_t first = 0; first < plan.batches.size(); first += group)
        for (std::size_t lane = 0; lane < kBatch; ++lane) {
            const FibreAxes axes = given.empty() ? fibres_of_centre(model, first, group, lane) : mean_fibres(plan, given, first, group, lane);
            for (std::size_t b = first; b < first + group; ++b)
                for (std::size_t k = 0; k < 6; ++k) plan.fibres[b].axis[k][lane] = axes.axis[k];
        }
}

} // namespace

Result<TissueModel> make_tissue_model(const TetMesh& mesh, const Material& material, std::span<const Index> pinned_nodes,
                                      const TetContrast& contrast, Index sheet) {
    const bool prisms = material.elements == TetElements::Prisms;
    if (const auto fine = check_material(material); !fine) return fine.error();
    if (const auto fine = check_nodes(mesh); !fine) return fine.error();
    if (const auto fine = check_factors(mesh, contrast.stiffness, "stiffness"); !fine) return fine.error();
    if (const auto fine = check_factors(mesh, contrast.density, "density"); !fine) return fine.error();
    if (const auto fine = check_fibres(mesh, contrast.fibres); !fine) return fine.error();
    TissueModel model{.material = material,
                      .law = make_law_constants(material),
                      .tet_nodes = mesh.tets,
                      .tet_shape = {},
                      .node_mass = {},
                      .inv_mass = {},
                      .rest_position = mesh.vertices,
                      .pinned = {},
                      .plan = {}};
    model.tet_shape.reserve(mesh.tets.size());
    for (std::size_t tet = 0; tet < mesh.tets.size(); ++tet) {
        auto shape = make_shape(mesh, tet);
        if (!shape) return shape.error();
        model.tet_shape.push_back(*shape);
    }
    for (std::size_t tet = 0; tet < contrast.stiffness.size(); ++tet) model.tet_shape[tet].stiffness = contrast.stiffness[tet];
    if (const auto fine = add_mass(model, contrast.density); !fine) return fine.error();
    if (const auto fine = check_repeats(mesh); !fine) return fine.error();
    if (const auto fine = check_connected(mesh); !fine) return fine.error();
    model.pinned.assign(pinned_nodes.begin(), pinned_nodes.end());
    std::sort(model.pinned.begin(), model.pinned.end());
    model.pinned.erase(std::unique(model.pinned.begin(), model.pinned.end()), model.pinned.end());
    if (!model.pinned.empty() && model.pinned.back() >= model.node_count())
        return Error{.code = ErrorCode::BadValue,
                     .message = "pinned node " + std::to_string(model.pinned.back()) + " is beyond the last node, " +
                                std::to_string(model.node_count() - 1)};
    for (const Index node : model.pinned) model.inv_mass[node] = 0.0;
    if (prisms)
        if (const auto fine = check_prisms(model.tet_nodes, model.node_count(), sheet); !fine) return fine.error();
    model.plan = make_force_plan(model.tet_nodes, model.tet_shape, model.rest_position, model.inv_mass, uses_patches(material), prisms ? sheet : 0);
    if (prisms) fill_prisms(model.plan, model.tet_nodes, model.tet_shape, model.rest_position, sheet);
    if (material.law == MaterialLaw::Hgo) add_fibres(model, contrast.fibres);
    model.material.young_modulus = find_small_strain(material).young_modulus();
    return model;
}

FibreAxes fibres_at(const TissueModel& model, std::size_t batch, std::size_t lane) noexcept {
    FibreAxes axes;
    for (std::size_t k = 0; k < 6; ++k) axes.axis[k] = model.plan.fibres[batch].axis[k][lane];
    return axes;
}

std::vector<double> find_node_stiffness(const TissueModel& model) {
    std::vector<double> stiffness(model.node_count(), 0.0);
    const double shear = find_small_strain(model.material).mu;
    for (std::size_t t = 0; t < model.tet_count(); ++t) {
        const TetShape& shape = model.tet_shape[t];
        const double volume = shape.stiffness * shear * shape.volume;
        Vec3 first = Vec3::Zero();
        for (std::size_t corner = 0; corner < 3; ++corner) {
            const Vec3 gradient(shape.inverse[3 * corner], shape.inverse[3 * corner + 1], shape.inverse[3 * corner + 2]);
            first -= gradient;
            stiffness[model.tet_nodes[t][corner + 1]] += volume * gradient.squaredNorm();
        }
        stiffness[model.tet_nodes[t][0]] += volume * first.squaredNorm();
    }
    return stiffness;
}

TissueState make_rest_state(const TissueModel& model) {
    return {.position = model.rest_position, .velocity = std::vector<Vec3>(model.node_count(), Vec3::Zero()), .relaxed = {}};
}

} // namespace trocar::fem
