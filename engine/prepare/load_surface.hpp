// From a scene's words to a surface in metres that its use allows: read or made, repaired as asked, checked.
#pragma once

#include "assets/anatomy/anatomy.hpp"
#include "base/topology.hpp"
#include "engine/prepare/model.hpp"
#include "engine/scene/scene.hpp"

#include <memory>
#include <span>
#include <vector>

namespace trocar::engine {

struct LoadedSurface {
    TriMesh mesh;                   // m, scaled and moved as the scene says
    SurfaceReport report;           // of that mesh
    std::vector<std::string> notes; // repairs done with their counts, and accepted defects
};

/// Generated patients of one preparation, each made once; kept on disk by content.
class PatientShelf {
public:
    [[nodiscard]] Result<const anatomy::Anatomy*> find(const anatomy::Recipe& recipe);

private:
    struct Entry {
        std::string key;
        std::unique_ptr<anatomy::Anatomy> patient;
    };
    std::vector<Entry> entries_;
};

/// Deformable bodies and lumens are closed, manifold, outward; a lumen does not pass through itself unless the scene lets it. Obstacles
/// are anything whose numbers are finite; closed ones must not be inside out.
/// fails  with the scene's file, line and key: BadMesh with the first bad triangles and the whole chain of repairs that would fix it,
///        BadValue for a size that no body has (a mistaken unit), or the reader's own error
///        BadValue as well where the surface alone has more triangles than `room`, before anything else is made of it
/// before  the bodies that stand before it, as they were prepared
[[nodiscard]] Result<LoadedSurface> load_surface(const Scene& scene, const SceneBody& body, std::size_t room, std::span<const BodyModel> before,
                                                 PatientShelf& shelf);

/// Position and direction of a place in a scene, landmarks looked up in the patient of their body.
[[nodiscard]] Result<Place> find_place(const Scene& scene, const PlaceSpec& spec, const std::string& key, PatientShelf& shelf);

} // namespace trocar::engine
