// Which side of the patient is where in a picture: a cube with a letter on each face, letters of the sides at the picture's edges. World: RAS.
#pragma once

#include "engine/render/camera.hpp"
#include "engine/render/picture.hpp"

namespace trocar::engine {

/// In the upper left corner; in a picture that is too small for it nothing.
void draw_orientation_cube(const ViewAxes& axes, Picture& picture);
/// In the middle of the four edges.
void draw_edge_letters(const ViewAxes& axes, Picture& picture);

} // namespace trocar::engine
