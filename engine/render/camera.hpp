// Where a picture is taken from. Right-handed; the picture's vertical axis is `up` made perpendicular to the view.
#pragma once

#include "base/box.hpp"
#include "base/vec.hpp"

#include <span>

namespace trocar::engine {

struct Camera {
    Vec3 eye = Vec3(0.0, 1.0, 0.0); // m
    Vec3 look_at = Vec3::Zero();    // m
    Vec3 up = Vec3::UnitZ();        // need not be a unit vector, nor perpendicular to the view
    double field_of_view_rad = 0.5; // vertical opening angle; perspective only
    bool orthographic = false;
    double height = 1.0; // m, visible height; orthographic only
};

/// Standard views of a patient whose y points forwards and whose z points to the head: unit vectors from the eye into the scene. Pictures,
/// the report and the viewer's page begin with the same.
inline const Vec3 kFrontView = Vec3(0.0, -1.0, -0.22).normalized(); // the anatomy, slightly from above
inline const Vec3 kAnteroPosteriorView(0.0, -1.0, 0.0);             // fluoroscopy

/// Unit axes of a view: right-handed, forward along the view.
struct ViewAxes {
    Vec3 right, up, forward;
};
/// Never fails: directions without length, or an up along the view, are replaced by an axis that works.
[[nodiscard]] ViewAxes make_view_axes(const Vec3& direction, const Vec3& up) noexcept;

/// How frame_camera fills the picture.
struct Framing {
    Vec3 direction = kAnteroPosteriorView; // from the eye into the scene
    Vec3 up = Vec3::UnitZ();
    double aspect = 1280.0 / 720.0; // width / height
    double field_of_view_rad = 0.5;
    bool orthographic = false;
    double margin = 0.06; // share of the picture left free on each side
};

/// A camera that shows every point, as close as the margin allows. An empty span or non-finite points are left out;
/// with nothing to show the camera looks at the origin from 1 m.
/// cost     O(points), no allocation
[[nodiscard]] Camera frame_camera(std::span<const Vec3> points, const Framing& framing);

/// The same for a box: its eight corners.
[[nodiscard]] Camera frame_camera(const Box3& bounds, const Framing& framing);

} // namespace trocar::engine
