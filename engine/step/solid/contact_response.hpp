// How contacts between solid bodies become forces. A response turns contacts into springs that the next step's integration feels; another
// one is another class here and a choice of the scene's contact.solid_response.
#pragma once

#include "engine/step/solid/spring_sink.hpp"

namespace trocar::engine {

class ContactResponse {
public:
    virtual ~ContactResponse() = default;

    /// contacts   places where surfaces touch or are about to (find_touches): signed gap at the step's end, normal towards the first body
    /// sink       what the springs are added to; sphere pairs of the traversal, for what has no inside, are in sink.solids.coarse
    virtual void respond(std::span<const Contact> contacts, SpringSink& sink) const = 0;
};

/// Surfaces push by their depth, spheres where a surface has none (solid_hold.hpp): `surface`. Or spheres alone, as in the sphere-tree
/// paper: `spheres`, of which there are no places of surfaces.
[[nodiscard]] const ContactResponse& response_of(SolidResponse response) noexcept;

} // namespace trocar::engine
