// Sequences of frames of one mesh, as benchmarks of continuous collision detection keep them: a folder with meta.txt
// (lines `name`, `nV`, `nT`, `frames`), tris.i32 (int32 [nT][3]), obj.i32 (int32 [nV], the object of each vertex) and pos.f64
// (float64 [frames][nV][3]), all little-endian. Motion is linear from each frame to the next.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <filesystem>
#include <span>
#include <string>

namespace trocar::engine {

struct FrameSequence {
    std::string name;
    std::vector<Triangle> triangles;   // [triangle_count]
    std::vector<std::int32_t> objects; // [vertex_count] >= 0
    std::vector<Vec3> positions;       // [frame_count][vertex_count]
    std::size_t frame_count = 0;

    [[nodiscard]] std::size_t vertex_count() const noexcept { return objects.size(); }
    [[nodiscard]] std::span<const Vec3> frame(std::size_t k) const noexcept {
        return {positions.data() + k * vertex_count(), vertex_count()};
    }
};

/// fails   with the file at fault: a part missing, a size that is not what meta.txt says, an index out of range, a negative object,
///         a coordinate that is not finite (frame and vertex named), fewer than two frames
[[nodiscard]] Result<FrameSequence> read_frames(const std::filesystem::path& folder);

/// Writes the four files; the folder is made where it is missing, and meta.txt comes last.
[[nodiscard]] Result<void> write_frames(const std::filesystem::path& folder, const FrameSequence& frames);

} // namespace trocar::engine
