#include "fem/tissue/statics.hpp"

#include "fem/tissue/forces.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

using Field = std::vector<Vec3>; // [node_count]

constexpr double kResidualSq = 1e-20; // of the square of the force
constexpr int kMostRounds = 4000, kNewtonRounds = 12;
constexpr double kEquilibrium = 1e-9; // of the largest nodal force

double dot(const Field& a, const Field& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
}

void hold_pinned(const TissueModel& model, Field& field) {
    for (const Index node : model.pinned) field[node].setZero();
}

double largest(const Field& field) {
    double most = 0.0;
    for (const Vec3& v : field) most = std::max(most, v.norm());
    return most;
}

/// K(position) u = force by conjugate gradients, scaled by the nodes' masses: large nodes are stiff ones.
Field solve_tangent(const TissueModel& model, const Field& position, const Field& force) {
    Field u(force.size(), Vec3::Zero()), residual = force, product = u, scaled = u;
    const auto precondition = [&] {
        for (std::size_t i = 0; i < u.size(); ++i) scaled[i] = residual[i] / std::cbrt(model.node_mass[i]);
    };
    precondition();
    Field along = scaled;
    const double wanted = kResidualSq * dot(force, force);
    double size = dot(residual, scaled);
    for (int round = 0; round < kMostRounds && dot(residual, residual) > wanted; ++round) {
        std::fill(product.begin(), product.end(), Vec3::Zero());
        (void)add_stiffness_product(model, position, along, product);
        hold_pinned(model, product);
        const double bend = dot(along, product);
        if (!(bend > 0.0)) break; // no minimum along this way
        const double alpha = size / bend;
        for (std::size_t i = 0; i < u.size(); ++i) {
            u[i] += alpha * along[i];
            residual[i] -= alpha * product[i];
        }
        precondition();
        const double next = dot(residual, scaled);
        for (std::size_t i = 0; i < u.size(); ++i) along[i] = scaled[i] + next / size * along[i];
        size = next;
    }
    return u;
}

} // namespace

std::vector<Vec3> solve_small_strain(const TissueModel& model, std::span<const Vec3> force) {
    Field held(force.begin(), force.end());
    hold_pinned(model, held);
    return solve_tangent(model, model.rest_position, held);
}

Equilibrium find_equilibrium(const TissueModel& model, std::span<const Vec3> force, int increments) {
    Equilibrium found{.position = model.rest_position};
    const Field still(force.size(), Vec3::Zero());
    Field full(force.begin(), force.end());
    hold_pinned(model, full);
    const double scale = std::max(largest(full), 1e-300);
    for (int increment = 1; increment <= increments; ++increment)
        for (int round = 0; round < kNewtonRounds; ++round) {
            Field left(force.size(), Vec3::Zero());
            (void)add_tet_forces(model, found.position, still, left);
            for (std::size_t i = 0; i < left.size(); ++i) left[i] += full[i] * (static_cast<double>(increment) / increments);
            hold_pinned(model, left);
            found.residual = largest(left) / scale;
            if (found.residual < kEquilibrium) break;
            const Field u = solve_tangent(model, found.position, left);
            for (std::size_t i = 0; i < u.size(); ++i) found.position[i] += u[i];
        }
    return found;
}

} // namespace trocar::fem
