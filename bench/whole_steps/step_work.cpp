#include "bench/whole_steps/step_work.hpp"

#include "fem/embedding/links.hpp"
#include "fem/tissue/kernels.hpp"

namespace trocar::engine {

namespace {

/// Operations on one tetrahedron of the neo-Hookean kernels, from the vector instructions of their AVX-512 loops in the disassembly: a fused
/// multiply-add is two, and so is what the law does once for a patch, divided by its tetrahedra. Sums into nodes are twelve of them.
std::optional<double> flops_per_tet(const fem::TissueModel& tissue) noexcept {
    if (tissue.material.law != fem::MaterialLaw::NeoHookean) return std::nullopt;
    const bool viscous = tissue.material.viscosity > 0.0;
    if (tissue.plan.patched()) return viscous ? 380.0 : 196.0;
    return viscous ? 340.0 : 172.0;
}

/// Of a node's update by leapfrog (node_kernels.cpp), without its sum over partial forces, which is three a slot.
constexpr double kFlopsPerNode = 30.0, kFlopsPerSlot = 3.0;
/// Of a triangle's frame and of a vertex that follows it (link_kernels.cpp).
constexpr double kFlopsPerFrame = 64.0, kFlopsPerVertex = 39.0;

/// One evaluation of the forces of a body and one update of its nodes.
PartWork evaluation_work(const fem::TissueModel& tissue, double per_tet) noexcept {
    const fem::ForcePlan& plan = tissue.plan;
    const std::size_t batches = plan.batches.size(), nodes = plan.node_count(), slots = plan.slots.size();
    const std::size_t constant = batches * (sizeof(fem::TetBatch) + sizeof(fem::StiffnessNote)) + plan.shares.size() * sizeof(fem::PatchShares) +
                                 slots * sizeof(Index) + nodes * (sizeof(Index) + sizeof(double));
    const std::size_t partial = slots * sizeof(fem::PartialForce), records = nodes * sizeof(fem::NodeRecord);
    // Partial forces are written and read; records are read by the forces and by the update, which writes others.
    return {static_cast<double>(constant + 2 * partial + 3 * records),
            per_tet * static_cast<double>(tissue.tet_count()) + kFlopsPerNode * static_cast<double>(nodes) + kFlopsPerSlot * static_cast<double>(slots),
            constant + partial + 2 * records};
}

/// Frames alone: nobody has looked at the surface.
double frame_bytes(const fem::RigidLinks& links) noexcept {
    constexpr std::size_t kFrame = sizeof(Triangle) + sizeof(Mat3) + sizeof(fem::LinkFrame);
    return static_cast<double>(kFrame * links.frame_count() + (2 * sizeof(Vec3) + sizeof(fem::NodeRecord)) * links.node_rest.size());
}

} // namespace

std::optional<PartWork> find_tissue_work(const SceneModel& model, std::uint64_t tet_evaluations) {
    PartWork once; // of all bodies
    double tets = 0.0;
    for (const BodyModel& body : model.bodies) {
        if (!body.tissue) continue;
        const std::optional<double> per_tet = flops_per_tet(*body.tissue);
        if (!per_tet) return std::nullopt;
        const PartWork own = evaluation_work(*body.tissue, *per_tet);
        once.bytes += own.bytes, once.flops += own.flops;
        once.working_set += own.working_set; // bodies that touch are integrated side by side
        tets += static_cast<double>(body.tissue->tet_count());
    }
    if (!(tets > 0.0)) return std::nullopt;
    const double times = static_cast<double>(tet_evaluations) / tets;
    return PartWork{times * once.bytes, times * once.flops, once.working_set};
}

std::optional<PartWork> find_surface_work(const SceneModel& model, const State& state) {
    PartWork work;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].links) continue;
        const fem::RigidLinks& links = *model.bodies[i].links;
        const bool placed = !state.bodies[i].surface_deferred;
        work.bytes += placed ? static_cast<double>(fem::embedded_update_bytes(links)) : frame_bytes(links);
        work.flops += kFlopsPerFrame * static_cast<double>(links.frame_count());
        if (placed) work.flops += kFlopsPerVertex * static_cast<double>(links.vertex_count() - links.static_count);
        work.working_set += fem::embedded_update_bytes(links);
    }
    return work.bytes > 0.0 ? std::optional(work) : std::nullopt;
}

} // namespace trocar::engine
