// Attenuation along the rays of a cone beam through closed surfaces, on the CPU, without any order of triangles: a ray's length in a
// body is the sum of the depths at which it leaves minus those at which it enters (Freud & al. 2006, "Fast and robust ray casting
// algorithms for virtual X-ray imaging").
//
// Watertight: vertices are snapped to 1/256 of a pixel, edges are tested in integers with a rule for ties, so that of the triangles
// round an edge or a vertex exactly one has the ray. Sums are integers: they do not depend on the order, nor on the number of threads,
// nor on the instruction set.
#pragma once

#include "base/mesh.hpp"
#include "engine/fluoroscopy/cone_beam.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace trocar::engine {

/// Sums of attenuation along the axis, a pixel each, in 1 / kAttenuationUnit.
using AttenuationSums = std::vector<std::int64_t>;
inline constexpr double kAttenuationUnit = 4294967296.0; // 2^32: half of the whole range is 10^9 attenuations

/// A surface whose inside attenuates.
struct XraySurface {
    std::span<const Vec3> vertices; // m
    std::span<const Triangle> triangles;
    double attenuation = 0.0;                  // 1/m, of its inside
    std::span<const double> per_triangle = {}; // 1/m in place of that: of what is behind a triangle minus what is before it
    double shell = 0.0;                        // m; > 0: not closed, each crossing attenuates as a sheet this thick
};

class Projector {
public:
    /// threads   1: none beside the caller's
    explicit Projector(const ConeBeam& beam, unsigned threads = 1);

    /// Adds what the surface attenuates.
    /// sums      [rows * columns]
    /// cost      O(vertices + triangles + pixels covered)
    void add(const XraySurface& surface, AttenuationSums& sums);

    /// The depth along the axis, in metres, at which rays first meet the surface, where nearer than what is there.
    /// depth     [rows * columns]; infinite: nothing so far
    void add_depth(const XraySurface& surface, std::vector<double>& depth);

    /// [rows * columns] attenuation along each ray: the sums times the ray's length over its length along the axis.
    void attenuations(const AttenuationSums& sums, std::vector<double>& attenuation) const;

private:
    template <class Pixel>
    void draw(const XraySurface& surface, const Pixel& pixel);
    void snap(std::span<const Vec3> vertices);

    ConeBeam beam_;
    unsigned threads_;
    std::vector<std::int32_t> x_, y_; // [vertices] 1/256 pixel
    std::vector<double> near_;        // [vertices] 1/m, one over the depth; <= 0: behind the nearest plane
};

} // namespace trocar::engine
