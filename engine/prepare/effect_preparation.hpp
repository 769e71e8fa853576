// What an effect may read and add to while a scene is prepared: EffectDescriptor::prepare.
#pragma once

#include "engine/prepare/load_surface.hpp"
#include "engine/prepare/prepare_body.hpp"
#include "engine/prepare/prepared_scene.hpp"
#include "engine/scene/effect.hpp"

namespace trocar::engine {

struct EffectPreparation {
    const Scene& scene;
    const CoarseBodies& coarse; // tetrahedra of the deformable bodies
    PatientShelf& shelf;        // landmarks
    PreparedScene& prepared;    // bodies and instruments are in place
};

} // namespace trocar::engine
