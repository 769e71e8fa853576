// The vectorised kernels: the same bits on every instruction set, for any number of threads, in any order of nodes and tets.
#include "fem/mesh/bar_mesh.hpp"
#include "fem/mesh/mapped_mesh.hpp"
#include "fem/mesh/wall_mesh.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/relaxation.hpp"
#include "tests/fem/bodies.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <numeric>

namespace trocar::fem {

using namespace test;

namespace {

struct EveryKernel : testing::TestWithParam<MaterialLaw> {
    ~EveryKernel() override { choose_isa(""); }
};

std::string name_of_law(const testing::TestParamInfo<MaterialLaw>& info) { return kLawNames[static_cast<int>(info.param)]; }

TissueModel make_rough(MaterialLaw law, std::array<Index, 3> cells) {
    Material material = make_material(law, 0.4);
    material.viscosity = 2.0;
    return make_model(make_bar_mesh(cells, 0.01, 0.15), material, {0, 1, 2});
}

/// Some tets stretched, some inverted.
std::vector<Vec3> deform(const TissueModel& model, double size) {
    std::mt19937_64 random(5);
    auto position = model.rest_position;
    for (Vec3& x : position) x += random_vec(random, size);
    return position;
}

/// Of tets, patches or a wall of prisms.
TissueModel make_elements(Material material, TetElements elements) {
    material.elements = elements;
    if (elements != TetElements::Prisms) return make_tissue_model(make_bar_mesh({9, 7, 5}, 0.01, 0.15), material, std::vector<Index>{0, 1, 2}).value();
    TriMesh ball = make_octasphere(9);
    for (Vec3& v : ball.vertices) v *= 0.01 * (1.0 + 0.05 * std::sin(900.0 * v.x()));
    const auto wall = make_wall_mesh(ball, {.thickness = 0.001, .layers = 2});
    EXPECT_TRUE(wall.ok() && !wall->folds);
    return make_tissue_model(wall->tets, material, std::vector<Index>{0, 1, 2}, {}, static_cast<Index>(ball.vertices.size())).value();
}

/// All partial sums of every kernel, one after the other.
std::vector<PartialForce> run_all(const TissueModel& model, unsigned threads, std::vector<Extremes>& found) {
    std::vector<NodeRecord> records(model.node_count());
    std::vector<PartialForce> partial(model.plan.slots.size()), all;
    gather_records(model.plan, deform(model, 0.006), deform(model, 0.3), records);
    for (const TetKernel kernel : {TetKernel::Force, TetKernel::ViscousForce, TetKernel::Stiffness, TetKernel::Damping}) {
        found.push_back(run_tets(model.plan, make_tet_job(model, kernel, threads), records, partial));
        all.insert(all.end(), partial.begin(), partial.end());
    }
    return all;
}

/// Of the three numbers that count; the fourth is padding.
bool same_bits(const std::vector<PartialForce>& a, const std::vector<PartialForce>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                      [](const PartialForce& x, const PartialForce& y) { return std::memcmp(x.f, y.f, 3 * sizeof(double)) == 0; });
}

TissueState run(const TissueModel& model, Integrator integrator, unsigned threads) {
    TissueState state = make_rest_state(model);
    state.position = deform(model, 0.001);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    workspace.threads = stable.threads = threads;
    SubstepLimits limits;
    limits.integrator = integrator;
    const auto done = advance(model, state, 0.02, {.gravity = Vec3(0, 0, -9.81)}, limits, workspace, stable);
    EXPECT_TRUE(done.integrate.finite() && !done.refused);
    return state;
}

} // namespace

TEST_P(EveryKernel, GivesTheSameBitsOnEveryInstructionSet) {
    const auto model = make_rough(GetParam(), {9, 7, 5}); // 1890 tets: no multiple of a batch or a chunk
    choose_isa("portable");
    std::vector<Extremes> found;
    const auto reference = run_all(model, 1, found);
    int compared = 0;
    for (const char* isa : {"avx2", "avx512"}) {
        if (!choose_isa(isa)) continue;
        ++compared;
        std::vector<Extremes> other;
        EXPECT_TRUE(same_bits(reference, run_all(model, 1, other))) << isa;
        for (std::size_t k = 0; k < found.size(); ++k) {
            EXPECT_EQ(found[k].low, other[k].low) << isa;
            EXPECT_EQ(found[k].high, other[k].high) << isa;
            EXPECT_EQ(found[k].low_place, other[k].low_place) << isa;
            EXPECT_EQ(found[k].high_place, other[k].high_place) << isa;
        }
    }
    if (compared == 0) GTEST_SKIP() << "this processor has neither AVX2 nor AVX-512";
}

TEST_P(EveryKernel, OfAWallOfPrismsGivesTheSameBitsOnEveryInstructionSetAndThreadCount) {
    Material material = make_material(GetParam(), 0.4);
    material.viscosity = 2.0;
    const TissueModel model = make_elements(material, TetElements::Prisms);
    choose_isa("portable");
    std::vector<Extremes> found, other;
    const auto reference = run_all(model, 1, found);
    for (const char* isa : {"avx2", "avx512"})
        if (choose_isa(isa)) EXPECT_TRUE(same_bits(reference, run_all(model, 1, other))) << isa;
    for (const unsigned threads : {2u, 3u, 7u}) EXPECT_TRUE(same_bits(reference, run_all(model, threads, other))) << threads;
}

TEST(BranchKernels, GiveTheSameBitsOnEveryInstructionSetAndThreadCount) {
    Material material = make_material(MaterialLaw::NeoHookean, 0.4);
    material.g1 = 0.7, material.tau1 = 0.1, material.g3 = 0.2, material.tau3 = 2.0;
    for (const TetElements elements : {TetElements::Linear, TetElements::Patched, TetElements::Prisms}) {
        const TissueModel model = make_elements(material, elements);
        const auto run_branches = [&](unsigned threads) {
            std::vector<NodeRecord> records(model.node_count());
            std::vector<PartialForce> partial(model.plan.slots.size(), PartialForce{});
            std::vector<double> relaxed(relaxation_size(model));
            for (const double size : {0.004, 0.001}) {
                gather_records(model.plan, deform(model, size), {}, records);
                relax(model, records, 0.05, relaxed, threads);
            }
            add_relaxation_forces(model, records, relaxed, partial, threads);
            for (std::size_t k = 0; k + 3 <= relaxed.size(); k += 3) partial.push_back({{relaxed[k], relaxed[k + 1], relaxed[k + 2], 0.0}});
            return partial;
        };
        choose_isa("portable");
        const auto reference = run_branches(1);
        for (const char* isa : {"avx2", "avx512"})
            if (choose_isa(isa)) EXPECT_TRUE(same_bits(reference, run_branches(1))) << isa;
        for (const unsigned threads : {2u, 3u}) EXPECT_TRUE(same_bits(reference, run_branches(threads))) << threads;
        choose_isa("");
    }
}

TEST_P(EveryKernel, GivesTheSameBitsForAnyNumberOfThreads) {
    const auto model = make_rough(GetParam(), {16, 12, 9});
    std::vector<Extremes> found, other;
    const auto reference = run_all(model, 1, found);
    for (const unsigned threads : {2u, 3u, 7u}) EXPECT_TRUE(same_bits(reference, run_all(model, threads, other))) << threads;
}

TEST_P(EveryKernel, WholeRunsHaveTheSameBitsOnEveryInstructionSetAndThreadCount) {
    const auto model = make_rough(GetParam(), {12, 6, 6});
    for (const Integrator integrator : {Integrator::Rk4, Integrator::Leapfrog}) {
        choose_isa("");
        const TissueState best = run(model, integrator, 2);
        choose_isa("portable");
        const TissueState plain = run(model, integrator, 1);
        for (std::size_t node = 0; node < model.node_count(); ++node) {
            ASSERT_EQ(best.position[node], plain.position[node]) << node;
            ASSERT_EQ(best.velocity[node], plain.velocity[node]) << node;
        }
    }
}

TEST_P(EveryKernel, ForcesFollowTheCallersNodeIds) {
    const TetMesh mesh = make_bar_mesh({5, 4, 3}, 0.01, 0.15);
    std::vector<Index> to(mesh.vertices.size());
    std::iota(to.begin(), to.end(), Index{0});
    std::mt19937_64 random(9);
    for (std::size_t i = to.size() - 1; i > 0; --i) std::swap(to[i], to[random() % (i + 1)]);
    TetMesh shuffled = mesh;
    for (std::size_t node = 0; node < to.size(); ++node) shuffled.vertices[to[node]] = mesh.vertices[node];
    for (Tet& tet : shuffled.tets)
        for (Index& node : tet) node = to[node];
    const auto model = make_model(mesh, make_material(GetParam())), other = make_model(shuffled, make_material(GetParam()));
    const auto position = deform(model, 0.002);
    auto moved = other.rest_position;
    for (std::size_t node = 0; node < to.size(); ++node) moved[to[node]] = position[node];
    auto force = zeros(to.size()), force_shuffled = force;
    const TetReport a = add_tet_forces(model, position, force, force), b = add_tet_forces(other, moved, zeros(to.size()), force_shuffled);
    EXPECT_EQ(a.min_volume_tet, b.min_volume_tet);
    for (std::size_t node = 0; node < to.size(); ++node) EXPECT_EQ(force[node], force_shuffled[to[node]]) << node;
}

TEST_P(EveryKernel, SumsOfEnergyAndVolumeAreTheScalarOnesAndTheSameBitsEverywhere) {
    const auto model = make_rough(GetParam(), {16, 12, 9});
    const auto position = deform(model, 0.006);
    std::vector<NodeRecord> records(model.node_count());
    std::vector<TetSum> scratch(model.plan.chunks.size());
    gather_records(model.plan, position, {}, records);
    const TetReport scalar = measure_tets(model, position), first = measure_tets(model, records, scratch, 1);
    EXPECT_NEAR(first.elastic_energy, scalar.elastic_energy, 1e-13 * scalar.elastic_energy); // another order of 10,368 terms
    EXPECT_NEAR(first.min_volume_ratio, scalar.min_volume_ratio, 1e-13);
    EXPECT_EQ(first.min_volume_tet, scalar.min_volume_tet);
    EXPECT_EQ(first.inverted, scalar.inverted);
    EXPECT_GT(first.inverted, 100u);
    EXPECT_EQ(first.first_bad_tet, kNoIndex);
    for (const char* isa : {"portable", "avx2", "avx512"}) {
        if (!choose_isa(isa)) continue;
        const TetReport other = measure_tets(model, records, scratch, 3);
        EXPECT_EQ(other.elastic_energy, first.elastic_energy) << isa;
        EXPECT_EQ(other.min_volume_ratio, first.min_volume_ratio) << isa;
        EXPECT_EQ(other.inverted, first.inverted) << isa;
    }
    auto broken = position;
    broken[model.tet_nodes[77][2]][1] = std::numeric_limits<double>::quiet_NaN();
    gather_records(model.plan, broken, {}, records);
    EXPECT_EQ(measure_tets(model, records, scratch, 1).first_bad_tet, measure_tets(model, broken).first_bad_tet);
}

TEST_P(EveryKernel, GrowthOfTheStiffestTetIsSeenAndOnlyThat) {
    const auto model = make_rough(GetParam(), {9, 7, 5});
    std::vector<NodeRecord> records(model.node_count());
    std::vector<PartialForce> partial(model.plan.slots.size());
    std::vector<StiffnessNote> notes(model.plan.batches.size());
    TetJob job = make_tet_job(model, TetKernel::ViscousForce, 1);
    const auto run_stretched = [&](double stretch, TetGrowth::Use use) {
        auto position = model.rest_position;
        for (const Index node : model.tet_nodes[500]) position[node][0] = 0.05 + stretch * (position[node][0] - 0.05);
        gather_records(model.plan, position, model.rest_position, records);
        job.growth = {use, notes.data()};
        return run_tets(model.plan, job, records, partial).high;
    };
    EXPECT_EQ(run_stretched(1.0, TetGrowth::Use::None), 1.0);
    EXPECT_EQ(run_stretched(1.0, TetGrowth::Use::Note), 1.0);
    EXPECT_NEAR(run_stretched(1.0, TetGrowth::Use::Compare), 1.0, 1e-15);
    const double little = run_stretched(1.01, TetGrowth::Use::Compare), more = run_stretched(1.05, TetGrowth::Use::Compare);
    EXPECT_GT(little, 1.0);
    EXPECT_GT(more, little);
}

INSTANTIATE_TEST_SUITE_P(Laws, EveryKernel, testing::ValuesIn(kAllLaws), name_of_law);

TEST(ForcePlan, NamesEveryTetAndNodeOnceAndEverySlotOfANode) {
    for (const TetElements elements : kElements) {
        Material material = make_material(MaterialLaw::NeoHookean);
        material.elements = elements;
        const auto model = make_model(make_bar_mesh({13, 7, 5}, 0.01, 0.1), material);
        const ForcePlan& plan = model.plan;
        EXPECT_EQ(plan.patched(), elements == TetElements::Patched);
        std::vector<int> tets(model.tet_count(), 0);
        double volume = 0.0;
        for (std::size_t place = 0; place < plan.tet_of.size(); ++place) {
            const double share = plan.batches[place / kBatch].volume[place % kBatch];
            volume += share;
            if (share > 0.0) ++tets[plan.tet_of[place]];
        }
        EXPECT_EQ(std::count(tets.begin(), tets.end(), 1), static_cast<long>(tets.size()));
        EXPECT_NEAR(volume, model.volume, 1e-12 * model.volume);
        for (std::size_t record = 0; record < plan.node_count(); ++record) {
            EXPECT_EQ(plan.record_of[plan.node_of[record]], record);
            EXPECT_LT(plan.slot_begin[record], plan.slot_begin[record + 1]);
        }
        EXPECT_EQ(plan.slot_begin.back(), plan.slots.size());
    }
}

} // namespace trocar::fem
