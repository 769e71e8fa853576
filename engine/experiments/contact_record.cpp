#include "engine/experiments/contact_record.hpp"

namespace trocar::engine {

ContactRecord record_of(const collision::SearchContact& found, std::span<const std::int32_t> objects) {
    const Contact& c = found.contact;
    const bool vertex_face = c.origin == ContactOrigin::ExactVF;
    ContactRecord row;
    row.kind = vertex_face ? ContactKind::VF : ContactKind::EE;
    row.body_a = objects.empty() ? c.a.code() : objects[c.feature_a[0]];
    row.body_b = objects.empty() ? c.b.code() : objects[c.feature_b[0]];
    row.feature_a0 = c.feature_a[0];
    row.feature_b0 = c.feature_b[0];
    row.feature_b1 = c.feature_b[1];
    if (vertex_face)
        row.feature_b2 = c.feature_b[2];
    else
        row.feature_a1 = c.feature_a[1];
    row.time = c.time;
    row.bary_a = vertex_face ? 0.0 : c.bary_a[1];
    row.bary_b0 = c.bary_b[0];
    row.bary_b1 = c.bary_b[1];
    row.normal = c.normal;
    return row;
}

} // namespace trocar::engine
