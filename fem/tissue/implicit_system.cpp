#include "fem/tissue/implicit_system.hpp"

#include "fem/tissue/forces.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace trocar::fem {

namespace {

/// Nodes of every tet, or patch, by record.
std::vector<std::vector<Index>> list_groups(const ForcePlan& plan) {
    std::vector<std::vector<Index>> groups;
    const std::size_t deep = plan.patched() ? kPatch : 1;
    for (std::size_t first = 0; first < plan.batches.size(); first += deep)
        for (std::size_t lane = 0; lane < kBatch; ++lane) {
            std::vector<Index> nodes;
            for (std::size_t k = first; k < first + deep; ++k) {
                if (!(plan.batches[k].volume[lane] > 0.0)) continue;
                for (const auto& corner : plan.batches[k].node) nodes.push_back(corner[lane] / static_cast<Index>(sizeof(NodeRecord)));
            }
            std::sort(nodes.begin(), nodes.end());
            nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
            if (!nodes.empty()) groups.push_back(std::move(nodes));
        }
    return groups;
}

BlockMatrix make_pattern(const ForcePlan& plan) {
    std::vector<std::vector<Index>> neighbours(plan.node_count());
    for (const std::vector<Index>& group : list_groups(plan))
        for (const Index node : group) neighbours[node].insert(neighbours[node].end(), group.begin(), group.end());
    BlockMatrix matrix;
    matrix.row_begin.assign(1, 0);
    for (std::vector<Index>& row : neighbours) {
        std::sort(row.begin(), row.end());
        row.erase(std::unique(row.begin(), row.end()), row.end());
        matrix.column.insert(matrix.column.end(), row.begin(), row.end());
        matrix.row_begin.push_back(static_cast<Index>(matrix.column.size()));
    }
    matrix.block.assign(matrix.column.size(), Mat3::Zero());
    return matrix;
}

std::span<const Index> row_of(const BlockMatrix& matrix, std::size_t row) {
    return std::span(matrix.column).subspan(matrix.row_begin[row], matrix.row_begin[row + 1] - matrix.row_begin[row]);
}

/// Nodes of one colour have no neighbour in common: one product tells the columns of them all (Curtis, Powell & Reid 1974).
std::vector<std::vector<Index>> colour_nodes(const BlockMatrix& matrix) {
    std::vector<std::vector<Index>> colours;
    std::vector<std::size_t> colour(matrix.row_count(), SIZE_MAX), seen;
    for (std::size_t node = 0; node < matrix.row_count(); ++node) {
        seen.resize(colours.size(), SIZE_MAX);
        for (const Index near : row_of(matrix, node))
            for (const Index far : row_of(matrix, near))
                if (colour[far] != SIZE_MAX) seen[colour[far]] = node;
        std::size_t free = 0;
        while (free < colours.size() && seen[free] == node) ++free;
        if (free == colours.size()) colours.emplace_back();
        colour[node] = free;
        colours[free].push_back(static_cast<Index>(node));
    }
    return colours;
}

/// Adds scale times what a kernel multiplies with.
void add_columns(const TissueModel& model, TetKernel kernel, double scale, std::span<const std::vector<Index>> colours, BlockMatrix& matrix) {
    std::vector<NodeRecord> records(model.node_count());
    std::vector<PartialForce> partial(model.plan.slots.size());
    gather_records(model.plan, model.rest_position, {}, records);
    const TetJob job = make_tet_job(model, kernel, 1);
    for (const std::vector<Index>& colour : colours)
        for (int axis = 0; axis < 3; ++axis) {
            for (const Index node : colour) records[node].v[axis] = 1.0;
            (void)run_tets(model.plan, job, records, partial);
            for (const Index node : colour) {
                records[node].v[axis] = 0.0;
                for (const Index row : row_of(matrix, node)) {
                    const std::span<const Index> columns = row_of(matrix, row);
                    const auto at = static_cast<std::size_t>(std::lower_bound(columns.begin(), columns.end(), node) - columns.begin());
                    matrix.block[matrix.row_begin[row] + at].col(axis) -= scale * sum_partial(model.plan, partial, row);
                }
            }
        }
}

Mat3& block_at(BlockMatrix& matrix, Index row, Index column) {
    const std::span<const Index> columns = row_of(matrix, row);
    return matrix.block[matrix.row_begin[row] + static_cast<std::size_t>(std::lower_bound(columns.begin(), columns.end(), column) - columns.begin())];
}

void add_ties(const ForcePlan& plan, const TieLoad& load, BlockMatrix& matrix) {
    for (const Tie& tie : load.ties) {
        if (!load.hosts) {
            const Index record = plan.record_of[tie.node];
            block_at(matrix, record, record) += tie.stiffness * Mat3::Identity();
            continue;
        }
        for (std::size_t i = 0; i < 4; ++i) // corners of one tetrahedron are neighbours
            for (std::size_t j = 0; j < 4; ++j)
                block_at(matrix, plan.record_of[tie.host[i]], plan.record_of[tie.host[j]]) += tie.stiffness * tie.weight[i] * tie.weight[j] * Mat3::Identity();
    }
}

void hold_pinned(const ForcePlan& plan, BlockMatrix& matrix) {
    for (std::size_t row = 0; row < matrix.row_count(); ++row)
        for (Index k = matrix.row_begin[row]; k < matrix.row_begin[row + 1]; ++k) {
            if (plan.inv_mass[row] > 0.0 && plan.inv_mass[matrix.column[k]] > 0.0) continue;
            if (matrix.column[k] == row)
                matrix.block[k].setIdentity();
            else
                matrix.block[k].setZero();
        }
}

} // namespace

Result<ImplicitSystem> make_implicit_system(const TissueModel& model, double step, std::span<const TieLoad> ties) {
    if (model.node_count() > kMostImplicitNodes) {
        std::string message = "found ";
        message += std::to_string(model.node_count());
        message += " nodes; expected at most ";
        message += std::to_string(kMostImplicitNodes);
        message += " of a body that is integrated implicitly";
        return Error{.code = ErrorCode::BadValue, .message = std::move(message)};
    }
    BlockMatrix matrix = make_pattern(model.plan);
    const std::vector<std::vector<Index>> colours = colour_nodes(matrix);
    const double reach = kStageShare * step;
    add_columns(model, TetKernel::Stiffness, 1.0, colours, matrix);
    if (model.material.viscosity > 0.0) add_columns(model, TetKernel::Damping, 1.0 / reach, colours, matrix);
    for (std::size_t row = 0; row < matrix.row_count(); ++row)
        for (Index k = matrix.row_begin[row]; k < matrix.row_begin[row + 1]; ++k)
            if (matrix.column[k] == row && model.plan.inv_mass[row] > 0.0)
                matrix.block[k] += (1.0 / reach + model.material.mass_damping) / (reach * model.plan.inv_mass[row]) * Mat3::Identity();
    for (const TieLoad& load : ties) add_ties(model.plan, load, matrix);
    hold_pinned(model.plan, matrix);
    std::optional<BlockFactor> factor = make_block_factor(matrix);
    if (!factor)
        return Error{.code = ErrorCode::BadValue, .message = "the tissue's stiffness at rest is not positive; expected a material that is stable at rest"};
    return ImplicitSystem{std::move(*factor), std::cbrt(6.0 * std::sqrt(2.0) * model.volume / static_cast<double>(model.tet_count()))};
}

} // namespace trocar::fem
