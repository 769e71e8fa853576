// Plain closed surfaces for simple scenes and tests. All are manifold and oriented outwards. Lengths in m.
#pragma once

#include "base/mesh.hpp"

#include <span>

namespace trocar::anatomy {

/// Icosahedron, each triangle split `subdivisions` times into four: 20 * 4^subdivisions triangles, vertices on the sphere.
[[nodiscard]] TriMesh make_icosphere(const Vec3& centre, double radius, int subdivisions);

/// Box around `centre`, every face a grid of cells x cells squares: 12 * cells^2 triangles.
[[nodiscard]] TriMesh make_box(const Vec3& centre, const Vec3& extent, int cells = 1);

/// Tube around an open polyline with one radius per point and rounded ends. sides >= 3, rings of the caps sides / 4.
/// points  at least 2, no two neighbours equal; bends gentler than the radius, or the wall crosses itself
[[nodiscard]] TriMesh make_tube(std::span<const Vec3> points, std::span<const double> radii, int sides = 24);

/// Straight tube with rounded ends from `from` to `to`, rings about as far apart as the sides are wide.
[[nodiscard]] TriMesh make_capsule(const Vec3& from, const Vec3& to, double radius, int sides = 24);

/// Torus around the z axis of its centre: a closed surface of genus 1.
[[nodiscard]] TriMesh make_torus(const Vec3& centre, double ring_radius, double tube_radius, int rings, int sides);

} // namespace trocar::anatomy
