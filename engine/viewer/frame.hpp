// Snapshots on the wire. Positions take 16 bits an axis in the box of their surface, a hundredth of a millimetre in half a
// metre; a frame says what changed since an earlier one that the viewer has, in one byte an axis where that is enough.
//
// Message, little endian, every part at a multiple of four bytes:
//   u8 kind (1), u8 version (2), u16 parts, u32 id, u32 base (0: none), u32 dots, f64 time [s], u32 spheres, u32 rod points
//   part:    f32 low[3] [m], f32 unit[3] [m], u32 vertices, u8 coding[ceil(vertices / 512)]; then block by block
//            coding 0: as in the base; 1: u16 xyz per vertex; 2: i8 xyz per vertex, added to the base's numbers
//   dots:    f32 x, y, z, depth [m];   rod: f32 x, y, z;   spheres: f32 x, y, z, radius; then u8 kind each
// A model message (kind 2) gives a part's triangles once: u8 kind, u8 version, u16 part, u32 triangles, u32 corners[3 n], u32 far
// triangles, u32 corners[3 n] of those, fewer on some of the same vertices (0: there are none).
#pragma once

#include "base/mesh.hpp"
#include "engine/viewer/snapshot.hpp"

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>

namespace trocar::engine::viewer {

inline constexpr std::uint8_t kFrameMessage = 1, kModelMessage = 2, kWireVersion = 2;
inline constexpr std::size_t kBlockVertices = 512;

/// Numbers of one surface: low + unit * number.
struct QuantisedPart {
    Point low{}, unit{};                // m
    std::vector<std::uint16_t> numbers; // [3 vertex_count]
};

/// Where the surface is, in a box that stays while it holds it: a quarter wider than the surface when it was made. Vertices
/// that are not finite sit at the box's low corner.
[[nodiscard]] QuantisedPart quantise(const std::vector<Point>& surface, const QuantisedPart* before);

/// The latest frame and a few before it, encoded against the base that each viewer has. One thread.
class FrameStore {
public:
    /// Frames that may serve as a base.
    static constexpr std::size_t kKept = 12;

    void add(const Snapshot& snapshot);
    [[nodiscard]] std::uint32_t latest() const noexcept { return next_id_ - 1; } // 0: none yet
    /// The latest frame for a viewer that has `base`; whole where that is 0 or forgotten.
    [[nodiscard]] std::shared_ptr<const std::string> encode(std::uint32_t base);

private:
    struct Frame {
        std::uint32_t id = 0;
        std::vector<std::shared_ptr<const QuantisedPart>> parts;
    };
    [[nodiscard]] const Frame* find(std::uint32_t id) const noexcept;

    std::deque<Frame> frames_; // ascending ids
    std::uint32_t next_id_ = 1;
    double time_s_ = 0.0; // of the latest
    std::string tail_;    // dots, rod and spheres of the latest
    std::uint32_t dots_ = 0, spheres_ = 0, rod_points_ = 0;
    std::map<std::uint32_t, std::shared_ptr<const std::string>> encoded_; // by base
};

[[nodiscard]] std::string encode_model(std::size_t part, const std::vector<Triangle>& triangles, const std::vector<Triangle>& far = {});

} // namespace trocar::engine::viewer
