#include "engine/prepare/tissue_steps.hpp"

#include "engine/prepare/wall_ties.hpp"
#include "fem/tissue/relaxation.hpp"
#include "fem/tissue/stable_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Beyond this the factor takes minutes, and a step seconds.
constexpr std::size_t kMostImplicit = 5000;

/// Fewer sub-steps of a step than this are never dearer than an implicit one.
constexpr double kManySubsteps = 100.0;

/// A body of a group: what it would take to advance it explicitly.
struct Member {
    std::size_t body = 0;
    fem::StableStep stable;
    double viscosity = 0.0; // Pa s, that explicit sub-steps would take
    std::vector<std::string> notes;
};

/// Bodies that are advanced together, ascending.
struct Group {
    std::vector<Member> members;

    [[nodiscard]] bool is_joined() const noexcept { return members.size() > 1; }
    [[nodiscard]] const Member& stiffest() const {
        return *std::min_element(members.begin(), members.end(), [](const Member& a, const Member& b) { return a.stable.step < b.stable.step; });
    }
};

/// Each wall with the organ that it is joined to, every other body by itself.
std::vector<Group> list_groups(const SceneModel& model) {
    std::vector<std::size_t> group_of(model.bodies.size());
    std::vector<Group> groups;
    for (std::size_t i = model.bodies.size(); i-- > 0;) { // an organ stands after its walls
        if (!model.bodies[i].tissue) continue;
        if (model.bodies[i].joint) {
            group_of[i] = group_of[model.bodies[i].joint->host];
        } else {
            group_of[i] = groups.size();
            groups.emplace_back();
        }
        std::vector<Member>& members = groups[group_of[i]].members;
        members.insert(members.begin(), Member{});
        members.front().body = i;
    }
    std::reverse(groups.begin(), groups.end());
    return groups;
}

/// A viscosity that would set the step is lowered to what costs a tenth of it; asked for by name, it stays.
void cap_viscosity(const SceneBody& body, fem::Integrator rule, const fem::ContactSprings& ties, fem::TissueModel& tissue, fem::StableStepWorkspace& workspace,
                   Member& member) {
    const double asked = tissue.material.viscosity;
    member.viscosity = asked;
    const double capped = fem::cap_viscosity(tissue, member.stable, rule);
    if (!body.cap_viscosity || !(capped < asked)) return;
    const double slow = member.stable.step;
    tissue.material.viscosity = member.viscosity = capped;
    workspace.warm = false;
    member.stable = fem::find_stable_step(tissue, tissue.rest_position, &ties, workspace, rule);
    tissue.material.viscosity = asked;
    member.notes.push_back(fmt::format("viscosity {:g} Pa s lowered to {:.3g} Pa s: the stable step is {:.3g} ms instead of {:.3g} ms "
                                       "(material.cap_viscosity false keeps it)",
                                       asked, capped, 1e3 * member.stable.step, 1e3 * slow));
}

void measure_explicit(const Scene& scene, SceneModel& model, Group& group) {
    const fem::Integrator rule = group.is_joined() ? fem::Integrator::Leapfrog : scene.time.explicit_rule();
    for (Member& member : group.members) {
        BodyModel& body = model.bodies[member.body];
        fem::ContactSprings ties;
        ties.tied = body.tied;
        fem::StableStepWorkspace workspace;
        member.stable = fem::find_stable_step(*body.tissue, body.tissue->rest_position, &ties, workspace, rule);
        cap_viscosity(scene.bodies[member.body], rule, ties, *body.tissue, workspace, member);
    }
}

/// Whether "auto" may choose implicit steps: of bodies that are held somewhere, since others lose their spin in long steps, without branches that relax.
bool may_be_implicit(const SceneModel& model, const Group& group) {
    const auto tissue_of = [&](const Member& member) -> const fem::TissueModel& { return *model.bodies[member.body].tissue; };
    return std::any_of(group.members.begin(), group.members.end(), [&](const Member& m) { return !tissue_of(m).pinned.empty(); }) &&
           std::all_of(group.members.begin(), group.members.end(),
                       [&](const Member& m) { return tissue_of(m).node_count() <= kMostImplicit && fem::relaxation_size(tissue_of(m)) == 0; });
}

/// The branch that relaxes fastest; infinite: there is none.
double least_tau(const fem::Material& m) noexcept {
    double least = std::numeric_limits<double>::infinity();
    for (const auto& [share, tau] : {std::pair{m.g1, m.tau1}, {m.g2, m.tau2}, {m.g3, m.tau3}})
        if (share > 0.0) least = std::min(least, tau);
    return least;
}

/// Of a scene that asks for implicit steps by name.
Result<void> check_implicit(const Scene& scene, const SceneModel& model, const Group& group) {
    const double substep = scene.time.step / std::max(1u, scene.time.substeps);
    for (const Member& member : group.members) {
        const BodyModel& body = model.bodies[member.body];
        const std::string key = "bodies." + body.name;
        if (body.tissue->node_count() > kMostImplicit)
            return scene_error(scene, key + ".coarse",
                               fmt::format("found {} nodes; expected at most {} of a body that is advanced implicitly, as time.integrator says",
                                           body.tissue->node_count(), kMostImplicit));
        if (const double tau = least_tau(body.tissue->material); tau < substep)
            return scene_error(scene, key + ".material",
                               fmt::format("found a branch that relaxes in {:.3g} s; expected at least a sub-step of {:g} s of a body that is advanced implicitly, as "
                                           "time.integrator says",
                                           tau, substep));
    }
    return {};
}

/// One for each member.
Result<std::vector<fem::ImplicitSystem>> make_systems(const Scene& scene, const SceneModel& model, const Group& group) {
    const double substep = scene.time.step / std::max(1u, scene.time.substeps);
    std::vector<fem::ImplicitSystem> systems;
    for (const Member& member : group.members) {
        std::vector<fem::TieLoad> ties;
        if (const auto& own = model.bodies[member.body].joint) ties.push_back({own->ties, false});
        for (const Member& other : group.members)
            if (const auto& joint = model.bodies[other.body].joint; joint && joint->host == member.body) ties.push_back({joint->ties, true});
        Result<fem::ImplicitSystem> system = fem::make_implicit_system(*model.bodies[member.body].tissue, substep, ties);
        if (!system.ok()) return scene_error(scene, "bodies." + model.bodies[member.body].name + ".coarse", system.error().message);
        systems.push_back(std::move(*system));
    }
    return systems;
}

/// Explicit sub-steps of a step from which on an implicit one is cheaper: about 80 force evaluations and 80 solves against four evaluations each
/// (docs/tissue.md).
double many_substeps(const SceneModel& model, const Group& group, std::span<const fem::ImplicitSystem> systems) {
    double below = 0.0, tets = 0.0;
    for (const fem::ImplicitSystem& system : systems) below += static_cast<double>(system.factor.below.size());
    for (const Member& member : group.members) tets += static_cast<double>(model.bodies[member.body].tissue->tet_count());
    return std::max(kManySubsteps, 40.0 + 8.0 * below / tets);
}

std::string names_beside(const SceneModel& model, const Group& group, const Member& own) {
    std::string names;
    for (const Member& member : group.members)
        if (member.body != own.body) names += (names.empty() ? "" : ", ") + model.bodies[member.body].name;
    return names;
}

/// As the scene asks, or as "auto" finds it cheaper, with a note. Returns whether the group is advanced implicitly.
Result<bool> choose_implicit(const Scene& scene, Group& group, PreparedScene& prepared) {
    SceneModel& model = prepared.model;
    const double count = std::ceil(scene.time.step / group.stiffest().stable.step);
    const bool asked = scene.time.integrator == TissueSteps::Implicit, may = scene.time.integrator == TissueSteps::Auto && scene.time.substeps == 0;
    const auto note = [&](const auto& text) { // text(the others of the group)
        for (const Member& member : group.members)
            prepared.bodies[member.body].notes.push_back(text(group.is_joined() ? " with " + names_beside(model, group, member) : ""));
    };
    const std::string many = fmt::format("{:.0f} explicit sub-steps in a step of {:g} ms", count, 1e3 * scene.time.step);
    if (asked) {
        if (const Result<void> fine = check_implicit(scene, model, group); !fine.ok()) return fine.error();
    } else if (!(count > kManySubsteps) || !may_be_implicit(model, group)) {
        return false;
    } else if (!may) {
        note([&](const std::string& with) { return fmt::format("{}{}; \"integrator\": \"implicit\" (of \"time\") takes one as a rule", many, with); });
        return false;
    }
    Result<std::vector<fem::ImplicitSystem>> systems = make_systems(scene, model, group);
    if (!systems.ok()) return systems.error();
    if (!asked) {
        if (!(count > many_substeps(model, group, *systems))) return false;
        const char* rule = group.is_joined() ? "leapfrog" : "rk4";
        note([&](const std::string& with) {
            const std::string most = count > scene.time.max_substeps ? ", with a \"max_substeps\" of as many" : "";
            return fmt::format("advanced implicitly{}, since there would be {}; \"integrator\": \"{}\" (of \"time\") takes them{}", with, many, rule, most);
        });
    }
    for (std::size_t k = 0; k < group.members.size(); ++k) model.bodies[group.members[k].body].implicit = std::move((*systems)[k]);
    return true;
}

constexpr double kSliverHeight = 0.05; // [-] of the longest edge; a regular tetrahedron has 0.82

/// The tet that sets the step, where it does so by being thin.
void note_sliver(const TetMesh& mesh, const fem::StableStep& stable, std::vector<std::string>& notes) {
    if (stable.worst_tet == kNoIndex) return;
    const Tet& t = mesh.tets[stable.worst_tet];
    double longest = 0.0, face = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
        const Vec3 &a = mesh.vertices[t[(k + 1) % 4]], &b = mesh.vertices[t[(k + 2) % 4]], &c = mesh.vertices[t[(k + 3) % 4]];
        longest = std::max({longest, (b - a).norm(), (c - a).norm(), (c - b).norm()});
        face = std::max(face, (b - a).cross(c - a).norm());
    }
    const Vec3& o = mesh.vertices[t[0]];
    const double volume = (mesh.vertices[t[1]] - o).dot((mesh.vertices[t[2]] - o).cross(mesh.vertices[t[3]] - o));
    if (!(volume < kSliverHeight * longest * face)) return;
    notes.push_back(fmt::format(
        "tetrahedron {} (nodes {}, {}, {}, {}) is a sliver, {:.3g} of its longest edge high, and sets the stable step of {:.3g} s",
        stable.worst_tet, t[0], t[1], t[2], t[3], volume / (longest * face), stable.step));
}

Result<void> settle_explicit(const Scene& scene, const CoarseBodies& coarse, Group& group, PreparedScene& prepared) {
    for (Member& member : group.members) {
        std::vector<std::string>& notes = prepared.bodies[member.body].notes;
        prepared.model.bodies[member.body].tissue->material.viscosity = member.viscosity;
        notes.insert(notes.end(), member.notes.begin(), member.notes.end());
        note_sliver(coarse.meshes[member.body], member.stable, notes);
    }
    const Member& stiffest = group.stiffest();
    if (scene.time.substeps == 0 || !(scene.time.step / scene.time.substeps > stiffest.stable.step)) return {};
    return scene_error(scene, "time.substeps",
                       fmt::format("{} sub-steps of {:g} s are longer than the stable step of {} ({:.3g} s): {} would work, "
                                   "or \"auto\"",
                                   scene.time.substeps, scene.time.step / scene.time.substeps, prepared.bodies[stiffest.body].name, stiffest.stable.step,
                                   std::ceil(scene.time.step / stiffest.stable.step)));
}

/// What a node gives way by within a step, its neighbours as they are: by inertia where the step is short, by the tissue's stiffness where it is long.
std::vector<double> find_node_give(const BodyModel& body, double step) {
    const fem::TissueModel& tissue = *body.tissue;
    std::vector<double> give = fem::find_node_stiffness(tissue);
    if (body.joint)
        for (const fem::Tie& tie : body.joint->ties) give[tie.node] += tie.stiffness;
    for (std::size_t n = 0; n < give.size(); ++n)
        give[n] = tissue.inv_mass[n] > 0.0 ? 1.0 / (give[n] + 2.0 * tissue.node_mass[n] / (step * step)) : 0.0;
    return give;
}

} // namespace

Result<void> choose_tissue_steps(const Scene& scene, const CoarseBodies& coarse, PreparedScene& prepared) {
    bound_ties(prepared.model);
    for (Group& group : list_groups(prepared.model)) {
        measure_explicit(scene, prepared.model, group);
        for (const Member& member : group.members) {
            prepared.bodies[member.body].stable_step_s = member.stable.step;
            BodyModel& body = prepared.model.bodies[member.body];
            body.node_give = find_node_give(body, scene.time.step);
        }
        const Result<bool> implicit = choose_implicit(scene, group, prepared);
        if (!implicit.ok()) return implicit.error();
        if (*implicit) continue;
        if (const Result<void> fine = settle_explicit(scene, coarse, group, prepared); !fine.ok()) return fine;
    }
    return {};
}

} // namespace trocar::engine
