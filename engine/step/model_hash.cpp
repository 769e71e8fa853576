#include "engine/step/model_hash.hpp"

#include "engine/step/bit_hash.hpp"

namespace seldinger::engine {

namespace {

void add_count(std::size_t count, BitHash& hash) noexcept { hash.add(static_cast<std::uint64_t>(count)); }

void add_triangles(const std::vector<Triangle>& triangles, BitHash& hash) noexcept {
    add_count(triangles.size(), hash);
    for (const Triangle& t : triangles) hash.add(std::uint64_t{t[0]} ^ (std::uint64_t{t[1]} << 21) ^ (std::uint64_t{t[2]} << 42));
}

void add_tissue(const fem::TissueModel& tissue, BitHash& hash) noexcept {
    const fem::Material& material = tissue.material;
    add_count(static_cast<std::size_t>(material.law), hash);
    for (const double value : {material.young_modulus, material.poisson_ratio, material.density, material.viscosity, material.mass_damping})
        hash.add(value);
    hash.add(tissue.rest_position);
    add_count(tissue.tet_nodes.size(), hash);
    for (const Tet& tet : tissue.tet_nodes)
        for (const Index node : tet) hash.add(std::uint64_t{node});
    for (const Index node : tissue.pinned) hash.add(std::uint64_t{node});
}

void add_body(const BodyModel& body, BitHash& hash) noexcept {
    hash.add_text(body.name);
    add_count(static_cast<std::size_t>(body.motion) + (body.hollow ? 8u : 0u), hash);
    add_count(body.carrier, hash);
    hash.add(body.surface.vertices);
    add_triangles(body.surface.triangles, hash);
    add_count(body.covering.tree.sphere_count(), hash);
    add_count(body.lumen ? body.lumen->tree.sphere_count() : 0, hash);
    for (const MotionRow& row : body.path) {
        hash.add(row.time);
        hash.add(row.displacement);
    }
    hash.add(body.pulse_reach);
    if (body.blood) {
        hash.add(body.blood->points);
        for (const double speed : body.blood->speeds) hash.add(speed);
    }
    if (body.tissue) add_tissue(*body.tissue, hash);
}

void add_instrument(const InstrumentModel& instrument, BitHash& hash) noexcept {
    hash.add_text(instrument.name);
    const fem::RodDesign& design = instrument.rod.design;
    for (const double value :
         {design.length, design.radius, design.segment, design.young_modulus, design.density, design.drag, design.whip_drag,
          design.tip_length, design.tip_angle, design.tip_stiffness, instrument.friction, instrument.inserted, instrument.limits.speed,
          instrument.limits.rotation, instrument.follow.speed, instrument.follow.look_ahead, instrument.follow.tolerance})
        hash.add(value);
    add_count(static_cast<std::size_t>(design.tip), hash);
    if (design.torsion) hash.add(design.poisson_ratio);
    for (const fem::StiffnessRow& row : design.stiffness)
        for (const double value : {row.from_tip, row.factor}) hash.add(value);
    if (instrument.mass_spring_substeps > 0) add_count(instrument.mass_spring_substeps, hash);
    if (instrument.inside != SIZE_MAX) add_count(instrument.inside, hash);
    add_count(instrument.lumen, hash);
    hash.add(instrument.port.position);
    hash.add(instrument.port.direction);
    add_triangles(instrument.skin.triangles, hash);
    for (const DriveRow& row : instrument.path)
        for (const double value : {row.time, row.insertion, row.rotation}) hash.add(value);
    if (instrument.route) hash.add(instrument.route->points);
}

} // namespace

std::uint64_t hash_model(const SceneModel& model) noexcept {
    BitHash hash;
    hash.add_text(model.name);
    hash.add(model.step_s);
    add_count(static_cast<std::size_t>(model.integrator), hash);
    add_count(model.fixed_substeps, hash);
    add_count(model.max_substeps, hash);
    for (const bool on : {model.effects.elasticity, model.effects.coarse_contact, model.effects.exact_contact, model.effects.self_contact})
        add_count(on ? 1 : 0, hash);
    hash.add(model.effects.gravity.value_or(Vec3(Vec3::Zero())));
    if (model.effects.breathing) {
        hash.add(model.effects.breathing->amplitude);
        hash.add(model.effects.breathing->period);
        hash.add(model.effects.breathing->direction);
    }
    if (model.effects.pulse) hash.add(model.effects.pulse->period);
    if (const auto& blood = model.effects.blood_drag)
        for (const double value : {blood->density, blood->viscosity, blood->pulsatility, blood->period}) hash.add(value);
    const ContactSettings& contact = model.contact;
    for (const double value : {contact.clearance, contact.exact_distance, contact.margin, contact.rod_stiffness, contact.wall_stiffness,
                               contact.solid_stiffness, contact.assumed_depth, contact.solid_damping, contact.solid_friction})
        hash.add(value);
    for (const int choice : {static_cast<int>(contact.solid_response), static_cast<int>(contact.sphere_trees),
                             static_cast<int>(contact.descent_order), contact.depth_cap})
        add_count(static_cast<std::size_t>(choice), hash);
    if (contact.culling != Culling::Auto) add_count(static_cast<std::size_t>(contact.culling), hash); // what it spends, under `work`
    for (const BodyModel& body : model.bodies) add_body(body, hash);
    for (const InstrumentModel& instrument : model.instruments) add_instrument(instrument, hash);
    return hash.value();
}

} // namespace seldinger::engine
