// The one contact that spheretree and collision both produce. Neither knows forces: engine/step/respond makes them.
#pragma once

#include "base/vec.hpp"

#include <compare>
#include <cstddef>
#include <cstdint>

namespace trocar {

/// A body or an instrument of a scene; what a search names its surfaces by are bodies too. Compared and ordered, bodies first, and never
/// computed with.
class Thing {
public:
    constexpr Thing() noexcept = default; // the first body
    [[nodiscard]] static constexpr Thing body(std::size_t index) noexcept { return from_code(static_cast<std::uint16_t>(index)); }
    [[nodiscard]] static constexpr Thing instrument(std::size_t index) noexcept {
        return from_code(static_cast<std::uint16_t>(index | kInstrument));
    }

    [[nodiscard]] constexpr bool is_body() const noexcept { return code_ < kInstrument; }
    /// Among the bodies, or among the instruments.
    [[nodiscard]] constexpr std::size_t index() const noexcept { return code_ & (kInstrument - 1u); }
    [[nodiscard]] constexpr auto operator<=>(const Thing&) const noexcept = default;

    /// As files and hashes hold it.
    [[nodiscard]] constexpr std::uint16_t code() const noexcept { return code_; }
    [[nodiscard]] static constexpr Thing from_code(std::uint16_t code) noexcept {
        Thing thing;
        thing.code_ = code;
        return thing;
    }

private:
    static constexpr std::uint16_t kInstrument = 0x8000;
    std::uint16_t code_ = 0;
};

enum class ContactOrigin : std::uint8_t {
    TestedSpheres,  // two leaf spheres were tested and overlap
    AssumedSpheres, // the budget ended first: an untested pair stands for whatever lies beneath it
    Proximity,      // a place of one surface and the closest point of the other, beneath a tested pair of leaves, at the end of the step
    ExactVF,        // vertex against face, continuous test
    ExactEE,        // edge against edge, continuous test
};

/// Features and frame of one contact. The normal points from b to a: moving a along it separates.
struct Contact {
    Thing a, b;
    ContactOrigin origin = ContactOrigin::TestedSpheres;
    Vec3 point = Vec3::Zero();                 // m, world
    Vec3 normal = Vec3::UnitX();               // unit
    double gap = 0.0;                          // m, negative: penetration along the normal
    double time = 1.0;                         // time of impact within the step, [0, 1]; 1 for what was tested at one instant only
    Index feature_a[2] = {kNoIndex, kNoIndex}; // sphere id | vertex id | edge's two vertex ids
    Index feature_b[3] = {kNoIndex, kNoIndex, kNoIndex}; // sphere id | triangle's vertex ids | edge's two vertex ids
    double bary_a[2] = {1.0, 0.0};                       // weights of feature_a's vertices
    double bary_b[3] = {1.0, 0.0, 0.0};                  // weights of feature_b's vertices
    Vec3 force = Vec3::Zero();                           // N, on a, mean over the step; 0 where nothing measures it

    /// Two vertices of either: an edge of a crosses an edge of b.
    [[nodiscard]] constexpr bool between_edges() const noexcept {
        return feature_a[1] != kNoIndex && feature_b[1] != kNoIndex && feature_b[2] == kNoIndex;
    }
};

/// Neither of the two is an instrument.
[[nodiscard]] constexpr bool is_between_bodies(const Contact& contact) noexcept { return contact.a.is_body() && contact.b.is_body(); }

} // namespace trocar
