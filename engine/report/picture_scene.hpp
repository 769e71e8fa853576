// Appearance of a state: bodies as colours and densities, contacts as dots, and the camera.
#pragma once

#include "engine/render/renderer.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/scene/scene.hpp"
#include "engine/step/scratch.hpp"

#include <span>

namespace trocar::engine {

/// What a picture shows. Everything must outlive the picture.
struct Moment {
    const PreparedScene& prepared;
    const State& state;
    std::span<const Contact> contacts; // of the last step
    bool markers = true;               // where walls press on instruments is shown
};

/// A scene for the renderer and the camera in front of it.
struct View {
    RenderScene scene;
    Camera camera;
    std::vector<std::vector<Vec3>> lines; // what the scene's tubes point to
};

/// width, height  pixels
[[nodiscard]] View make_view(PictureView view, const Moment& moment, unsigned width, unsigned height);

} // namespace trocar::engine
