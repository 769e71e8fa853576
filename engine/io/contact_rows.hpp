// Contacts as files: the CSV that `contacts --out` promises, and the binary hit dump of the benchmark's frame sequences.
#pragma once

#include "base/result.hpp"
#include "base/vec.hpp"

#include <compare>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace trocar::engine {

enum class ContactKind : std::uint8_t { EE, TT, VF }; // in alphabetical order, as rows are sorted

/// One row. Ids that a kind does not have are kNone and stay empty in the file.
struct ContactRecord {
    static constexpr std::int64_t kNone = -1;

    ContactKind kind = ContactKind::VF;
    std::int64_t body_a = 0, feature_a0 = kNone, feature_a1 = kNone;
    std::int64_t body_b = 0, feature_b0 = kNone, feature_b1 = kNone, feature_b2 = kNone;
    double time = 0.0;
    double bary_a = 0.0;                 // weight of feature_a1; 0 for a vertex
    double bary_b0 = 0.0, bary_b1 = 0.0; // weights of feature_b0 and feature_b1; the rest is feature_b2's (VF)
    Vec3 normal = Vec3::Zero();          // unit, from b to a

    /// By kind, then by all ids in the order of the columns; empty before any number.
    [[nodiscard]] std::strong_ordering compare_ids(const ContactRecord& other) const noexcept;
};

/// Rows of a step; `frame` is the number of the step's first frame.
struct ContactStep {
    std::size_t frame = 0;
    std::vector<ContactRecord> rows;
};

/// Header and rows, sorted by compare_ids. with_frame adds a last column `frame`.
[[nodiscard]] std::string contact_csv(std::span<const ContactStep> steps, bool with_frame);

/// One record of a hit dump: int32 frame, int32 type (0 vertex-face, 1 edge-edge), int32 a, int32 b, float64 time.
struct HitRecord {
    std::int32_t frame, type, a, b;
    double time;
};
static_assert(sizeof(HitRecord) == 24);

[[nodiscard]] Result<void> write_hits(const std::filesystem::path& path, std::span<const HitRecord> hits);

} // namespace trocar::engine
