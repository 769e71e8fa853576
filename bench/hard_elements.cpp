// Elements where they are hard: at load, inverted in a run, collapsed, nearly incompressible, of very unlike neighbours, turned.
#include "base/topology.hpp"
#include "bench/hard_bodies.hpp"
#include "bench/hard_cases.hpp"
#include "fem/tissue/integrate.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {

using namespace fem;

namespace {

constexpr double kCell = 0.01; // m

double farthest_from_rest(const TissueModel& model, const TissueState& state) {
    double off = 0.0;
    for (std::size_t node = 0; node < model.node_count(); ++node)
        off = std::max(off, (state.position[node] - model.rest_position[node]).norm());
    return off;
}

/// Three seconds under RK4 with derived steps; it does not hold on a refusal or a value that is not finite.
IntegrateReport let_go(HardReport& report, const TissueModel& model, TissueState& state, const std::string& what) {
    RkWorkspace workspace;
    StableStepWorkspace stable;
    IntegrateReport last;
    for (int frame = 0; frame < 300; ++frame) {
        const auto done = advance(model, state, 0.01, {}, {.max_substeps = 20000}, workspace, stable);
        last = done.integrate;
        if (!report.require(last.finite() && !done.refused, fmt::format("{}, frame {}: finite and not refused", what, frame))) break;
    }
    return last;
}

Material damped(MaterialLaw law) {
    Material material = make_material(law, 0.45);
    material.viscosity = 1.0;
    material.mass_damping = 4.0;
    return material;
}

/// A cube of 3 x 3 x 3 cells held at its bottom, deformed by f(position, whether the node is free).
template <class Change>
TissueState deform_free(const TissueModel& model, Change&& change) {
    TissueState state = make_rest_state(model);
    for (std::size_t node = 0; node < model.node_count(); ++node)
        if (model.inv_mass[node] > 0.0) change(state.position[node]);
    return state;
}

std::string refusal(const TetMesh& mesh, const TetContrast& contrast = {}) {
    const auto model = make_tissue_model(mesh, Material{}, {}, contrast);
    return model ? std::string("accepted") : model.error().message;
}

void zero_volume_and_inverted_tets_are_refused_by_id(HardReport& report) {
    TetMesh mesh = make_bar(2, 1, 1, kCell);
    std::swap(mesh.tets[7][0], mesh.tets[7][1]);
    report.require(refusal(mesh).find("tet 7 (nodes") != std::string::npos, "the refusal says \"tet 7 (nodes\"");
    report.require(refusal(mesh).find("inverted") != std::string::npos, "the refusal says \"inverted\"");
    mesh = make_bar(2, 1, 1, kCell); // one more tet, on a face of the border, whose apex lies in that face: no other is flat
    const Triangle face = boundary_surface(mesh).triangles[5];
    const Tet flat{face[0], face[2], face[1], static_cast<Index>(mesh.vertices.size())};
    mesh.vertices.push_back((mesh.vertices[face[0]] + mesh.vertices[face[1]] + mesh.vertices[face[2]]) / 3.0);
    mesh.tets.insert(mesh.tets.begin() + 7, flat);
    const std::string named = fmt::format("tet 7 (nodes {}, {}, {}, {}) is flat", flat[0], flat[1], flat[2], flat[3]);
    report.require(refusal(mesh).find(named) != std::string::npos, "the refusal says \"" + named + "\": " + refusal(mesh));
    const std::vector<double> factors(3, 1.0);
    report.require(refusal(make_bar(2, 1, 1, kCell), {.stiffness = factors}).find("3 of them for 12 tets") != std::string::npos,
                   "a list of factors that is too short is refused with both counts");
}

void sliver_of_a_tenth_of_a_degree_is_taken_slows_the_step_and_is_named(HardReport& report) {
    TetMesh mesh = make_bar(3, 3, 3, kCell);
    const double sound = [&] {
        StableStepWorkspace workspace;
        const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean));
        return find_stable_step(model, model.rest_position, nullptr, workspace).step;
    }();
    const Index apex = 21; // an inner node, pushed almost onto the opposite face of one of its tets
    Tet sliver{};
    for (const Tet& t : mesh.tets)
        if (std::find(t.begin(), t.end(), apex) != t.end()) sliver = t;
    Vec3 foot = Vec3::Zero();
    for (const Index node : sliver)
        if (node != apex) foot += mesh.vertices[node] / 3.0;
    // the face's inner radius is about 0.3 cells: a height of 0.3 tan(0.1 degrees)
    mesh.vertices[apex] = foot + 0.3 * kCell * std::tan(0.1 / 180.0 * std::numbers::pi) * (mesh.vertices[apex] - foot).normalized();
    const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean));
    StableStepWorkspace workspace;
    const StableStep step = find_stable_step(model, model.rest_position, nullptr, workspace);
    report.below("sliver's stable step over the sound mesh's", step.step / sound, 0.1);
    // it falls with the root of the height: 1/1900 of a cell, less what its neighbours' mass buys
    const Tet& worst = model.tet_nodes[step.worst_tet];
    report.require(std::find(worst.begin(), worst.end(), apex) != worst.end(), "the sliver is named as the worst tet");
}

void node_pulled_through_its_face_comes_back(HardReport& report) {
    const TetMesh mesh = make_bar(3, 3, 3, kCell);
    const auto model = make_model(mesh, damped(MaterialLaw::NeoHookean), nodes_at(mesh, 2, 0.0));
    TissueState state = make_rest_state(model);
    state.position[42] += Vec3(0.0, 0.0, -2.0 * kCell); // an inner node, two cells down through its neighbours
    report.require(measure_tets(model, state.position).inverted > 0, "tets are inverted at the start");
    const auto end = let_go(report, model, state, "pulled node");
    report.below("node pulled through its face: farthest node from rest after 3 s", farthest_from_rest(model, state), 1e-4, "m");
    report.require(end.inverted == 0, "no tet is inverted at the end");
    // 1 % of a cell: what mass damping leaves of a 5 Hz mode after 3 s is below
}

void neo_hookean_recovers_from_plane_point_inside_out_and_chaos(HardReport& report) {
    const TetMesh mesh = make_bar(3, 3, 3, kCell);
    const auto model = make_model(mesh, damped(MaterialLaw::NeoHookean), nodes_at(mesh, 2, 0.0));
    std::mt19937_64 random(7);
    const auto run = [&](const std::string& what, auto&& change) {
        TissueState state = deform_free(model, change);
        const auto end = let_go(report, model, state, what);
        report.below(what, farthest_from_rest(model, state), 1e-3, "m");
        report.require(end.inverted == 0, "no tet is inverted at the end");
        // a tenth of a cell
    };
    run("cube squashed to a plane: farthest from rest after 3 s", [&](Vec3& x) {
        x[2] = 0.0;
        x += random_vec(random, 1e-6);
    });
    run("cube squashed to a point", [&](Vec3& x) { x = Vec3(0.015, 0.015, 0.01) + random_vec(random, 1e-6); });
    run("cube inside out", [&](Vec3& x) { x = Vec3(0.03 - x[0], 0.03 - x[1], -x[2]) + random_vec(random, 1e-6); });
    run("nodes at random within two cells", [&](Vec3& x) { x += random_vec(random, 0.02); });
}

void twisted_by_a_full_turn_they_unwind(HardReport& report) {
    const auto twist = [&](Index cells, double viscosity) { // farthest from rest after 3 s
        const TetMesh mesh = make_bar(3, 3, cells, kCell);
        Material material = damped(MaterialLaw::NeoHookean);
        material.viscosity = viscosity;
        material.mass_damping = 20.0; // a long bar is slow: 3 s must be enough
        const auto model = make_model(mesh, material, nodes_at(mesh, 2, 0.0));
        TissueState state = deform_free(model, [cells](Vec3& x) {
            const double angle = 2.0 * std::numbers::pi * x[2] / (cells * kCell), u = x[0] - 1.5 * kCell, v = x[1] - 1.5 * kCell;
            x[0] = 1.5 * kCell + std::cos(angle) * u - std::sin(angle) * v;
            x[1] = 1.5 * kCell + std::sin(angle) * u + std::cos(angle) * v;
        });
        const auto end = let_go(report, model, state, fmt::format("{} cells twisted", cells));
        report.require(end.inverted == 0, "no tet is inverted at the end");
        return farthest_from_rest(model, state);
    };
    report.below("bar of 12 cells twisted by 360 degrees", twist(12, 1.0), 1e-3, "m"); // a tenth of a cell
    report.below("cube of 3 cells twisted by 360 degrees, 120 a cell", twist(3, 0.1), 1e-3, "m");
    report.note(fmt::format("the same cube of 1 Pa s, ten times as viscous, stays {:.1f} mm off, in another minimum", 1e3 * twist(3, 1.0)));
}

void st_vk_that_inverts_is_counted(HardReport& report) {
    const TetMesh mesh = make_bar(3, 3, 3, kCell);
    const auto model = make_model(mesh, damped(MaterialLaw::StVK), nodes_at(mesh, 2, 0.0));
    std::mt19937_64 random(7);
    TissueState state = deform_free(model, [&](Vec3& x) { x += random_vec(random, 0.02); });
    RkWorkspace workspace;
    StableStepWorkspace stable;
    std::uint32_t most = 0;
    double least = 1.0;
    for (int frame = 0; frame < 50; ++frame) {
        const auto done = advance(model, state, 0.01, {}, {.max_substeps = 20000}, workspace, stable);
        most = std::max(most, done.integrate.inverted);
        least = std::min(least, done.integrate.min_volume_ratio);
        const bool finite = std::all_of(state.position.begin(), state.position.end(), [](const Vec3& x) { return is_finite(x); });
        if (!report.require(finite, fmt::format("frame {}: every position is finite", frame))) return;
        if (!done.integrate.finite() || done.refused) break; // reports the element: accepted like going on
    }
    report.above("StVK from random places: tets inverted at the end of a frame", static_cast<double>(most), 0.0, "of 162");
    report.below("StVK from random places: smallest volume ratio", least, 0.0);
}

void st_vk_peaks_and_collapses(HardReport& report) {
    // Uniaxial stress of a free bar, sigma / E = stretch (stretch^2 - 1) / 2: peaks at 1/sqrt(3) with 0.19245.
    double peak = 0.0, at = 1.0;
    const auto model = make_model(make_bar(1, 1, 1, kCell), make_material(MaterialLaw::StVK, 0.3));
    for (double stretch = 0.95; stretch > 0.4; stretch -= 0.001) {
        const double across = std::sqrt(1.0 + 0.3 * (1.0 - stretch * stretch)); // free of stress for StVK
        std::vector<Vec3> position = model.rest_position;
        for (Vec3& x : position) x = x.cwiseProduct(Vec3(stretch, across, across));
        auto force = zeros(position.size());
        (void)add_tet_forces(model, position, zeros(position.size()), force);
        double pull = 0.0;
        for (std::size_t node = 0; node < force.size(); ++node)
            if (model.rest_position[node][0] > 0.5 * kCell) pull += force[node][0];
        const double stress = pull / (kCell * kCell) / model.material.young_modulus;
        if (stress > peak) {
            peak = stress;
            at = stretch;
        }
    }
    report.below("StVK: peak of uniaxial stress over E, off 0.1924500897", std::abs(peak - 0.1924500897), 1e-6);
    report.below("StVK: stretch at that peak, off 0.5773502692", std::abs(at - 0.5773502692), 1e-3);
    for (const double load : {0.12, 0.196, 0.24}) {                 // rho g H / E of a bonded slab under sudden gravity
        Material material = make_material(MaterialLaw::StVK, 0.45); // tissue's; at 0.3 it is softer, and collapses at 0.196 already
        material.young_modulus = 1000.0 * 9.81 * 0.04 / load;
        material.mass_damping = 2.0;
        const TetMesh mesh = make_bar(6, 6, 4, kCell);
        const auto slab = make_model(mesh, material, nodes_at(mesh, 2, 0.0));
        TissueState state = make_rest_state(slab);
        RkWorkspace workspace;
        StableStepWorkspace stable;
        double least = 1.0;
        std::uint32_t most = 0;
        for (int frame = 0; frame < 100; ++frame) {
            const auto done = advance(slab, state, 0.01, {.gravity = Vec3(0, 0, -9.81)}, {.max_substeps = 20000}, workspace, stable);
            if (!report.require(done.integrate.finite() && !done.refused, fmt::format("load {}: finite and not refused", load))) return;
            least = std::min(least, done.integrate.min_volume_ratio);
            most = std::max(most, done.integrate.inverted);
        }
        const std::string what = fmt::format("StVK slab at rho g H / E = {}: ", load);
        const double share = most / double(slab.tet_count());
        if (load < 0.2) {
            report.equal(what + "tets ever inverted", most, 0);
            report.above(what + "smallest volume ratio", least, load < 0.15 ? 0.8 : 0.5);
        } else {
            report.above(what + "share of tets inverted, all finite", share, 0.9);
        }
    }
}

void unlike_neighbours_in_one_body_are_stable_at_their_derived_step(HardReport& report) {
    const TetMesh mesh = make_bar(6, 2, 2, kCell);
    struct Contrast {
        const char* what;
        double stiffness, density;
    };
    for (const Contrast& c : {Contrast{"modulus contrast 1:10^6", 1e6, 1.0}, Contrast{"density contrast 1:1000", 1.0, 1e3},
                              Contrast{"stiff and light beside soft and heavy, 1:10^6 and 1:1000", 1e6, 1e-3}}) {
        std::vector<double> stiffness(mesh.tets.size(), 1.0), density(mesh.tets.size(), 1.0);
        for (std::size_t tet = 0; tet < mesh.tets.size(); ++tet) {
            double x = 0.0;
            for (const Index node : mesh.tets[tet]) x += 0.25 * mesh.vertices[node][0];
            if (x > 0.04) stiffness[tet] = c.stiffness, density[tet] = c.density;
        }
        const auto made =
            make_tissue_model(mesh, make_material(MaterialLaw::NeoHookean, 0.45), nodes_at(mesh, 0, 0.0), {stiffness, density});
        if (!report.require(made.ok(), "the contrast is taken")) return;
        TissueState state = make_rest_state(*made);
        std::mt19937_64 random(4);
        for (std::size_t node = 0; node < made->node_count(); ++node)
            if (made->inv_mass[node] > 0.0) state.velocity[node] = random_vec(random, 1e-2);
        RkWorkspace workspace;
        StableStepWorkspace stable;
        double first = 0.0, most = 0.0;
        for (std::size_t node = 0; node < made->node_count(); ++node)
            first += 0.5 * made->node_mass[node] * state.velocity[node].squaredNorm();
        for (int frame = 0; frame < 20; ++frame) {
            const auto done = advance(*made, state, 5e-4, {}, {.max_substeps = 100000}, workspace, stable);
            if (!report.require(done.integrate.finite() && !done.refused, std::string(c.what) + ": finite and not refused")) return;
            most = std::max(most, done.integrate.kinetic_j + done.integrate.elastic_j);
        }
        report.below(std::string(c.what) + ": most energy over the energy at the start", most / first, 1.01);
        // RK4 below its limit only takes energy; the rest is rounding in the stiff part's
    }
}

void rigid_rotations_by_right_angles_pull_on_nothing(HardReport& report) {
    for (const MaterialLaw law : kLaws) {
        const auto model = make_model(make_bar_mesh({4, 3, 3}, kCell, 0.15), make_material(law, 0.45));
        double worst = 0.0;
        for (const double angle : {90.0, 180.0})
            for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1), Vec3(1, 1, 1)}) {
                const Eigen::AngleAxisd turn(angle / 180.0 * std::numbers::pi, axis.normalized());
                auto position = model.rest_position;
                for (Vec3& x : position) x = turn * x + Vec3(0.1, -0.2, 0.3);
                auto force = zeros(position.size());
                (void)add_tet_forces(model, position, zeros(position.size()), force);
                for (const Vec3& f : force) worst = std::max(worst, f.norm());
            }
        const double scale = model.material.young_modulus * kCell * kCell; // N, a face under a stress of E
        report.below(fmt::format("force after a rigid turn over E times a cell's face, law {}", static_cast<int>(law)), worst / scale,
                     1e-12);
        // positions of 0.5 m carry 1e-16 of rounding, edges 1e-14
    }
}

constexpr HardCase kElementsCases[] = {
    {"elements", "ZeroVolumeAndInvertedTetsAreRefusedById", "refused at load, tet and nodes named",
     zero_volume_and_inverted_tets_are_refused_by_id},
    {"elements", "SliverOfATenthOfADegreeIsTakenSlowsTheStepAndIsNamed",
     "its step below 0.1 of the sound mesh's, since it falls with the root of the height; it is named",
     sliver_of_a_tenth_of_a_degree_is_taken_slows_the_step_and_is_named},
    {"elements", "NodePulledThroughItsFaceComesBack", "0.1 mm from rest after 3 s, 1 % of a cell", node_pulled_through_its_face_comes_back},
    {"elements", "NeoHookeanRecoversFromPlanePointInsideOutAndChaos", "1 mm from rest after 3 s, a tenth of a cell; no tet inverted",
     neo_hookean_recovers_from_plane_point_inside_out_and_chaos},
    {"elements", "BarTwistedByAFullTurnUnwinds", "the same, of a bar of 12 cells and a cube of 3", twisted_by_a_full_turn_they_unwind},
    {"elements", "StVKThatInvertsIsCountedAndNeverSpreadsNaN", "all finite, inverted tets counted", st_vk_that_inverts_is_counted},
    {"elements", "StVKPeaksAtOneFifthOfYoungsModulusAndCollapsesThere",
     "peak 0.1925 E at 0.577; a slab at 0.12 and 0.196 of rho g H / E inverts no tet, at 0.24 more than 0.9 of them, finite and counted",
     st_vk_peaks_and_collapses},
    {"elements", "UnlikeNeighboursInOneBodyAreStableAtTheirDerivedStep",
     "energy never above 1.01 of the start: RK4 below its limit only loses",
     unlike_neighbours_in_one_body_are_stable_at_their_derived_step},
    {"elements", "RigidRotationsByRightAnglesPullOnNothing", "1e-12 of E times a cell's face: edges carry 1e-14",
     rigid_rotations_by_right_angles_pull_on_nothing},
};

} // namespace

std::span<const HardCase> hard_elements() noexcept { return kElementsCases; }

} // namespace trocar::engine
