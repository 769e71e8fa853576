#include "engine/io/contact_rows.hpp"

#include "engine/io/atomic_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace trocar::engine {
namespace {

constexpr std::string_view kHeader =
    "kind,body_a,feature_a0,feature_a1,body_b,feature_b0,feature_b1,feature_b2,time,bary_a,bary_b0,bary_b1,normal_x,normal_y,normal_z";

const char* name_of(ContactKind kind) noexcept { return kind == ContactKind::EE ? "EE" : kind == ContactKind::TT ? "TT" : "VF"; }

void append_id(std::string& text, std::int64_t id) {
    if (id != ContactRecord::kNone) fmt::format_to(std::back_inserter(text), "{}", id);
    text += ',';
}

void append_row(std::string& text, const ContactRecord& row) {
    text += name_of(row.kind);
    text += ',';
    for (const std::int64_t id : {row.body_a, row.feature_a0, row.feature_a1, row.body_b, row.feature_b0, row.feature_b1, row.feature_b2})
        append_id(text, id);
    if (row.kind == ContactKind::TT)
        text += ",,,,,,";
    else
        fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{}", row.time, row.bary_a, row.bary_b0, row.bary_b1, row.normal[0],
                       row.normal[1], row.normal[2]);
}

} // namespace

std::strong_ordering ContactRecord::compare_ids(const ContactRecord& other) const noexcept {
    const auto key = [](const ContactRecord& r) {
        return std::array<std::int64_t, 8>{
            static_cast<std::int64_t>(r.kind), r.body_a, r.feature_a0, r.feature_a1, r.body_b, r.feature_b0, r.feature_b1, r.feature_b2};
    };
    return key(*this) <=> key(other);
}

std::string contact_csv(std::span<const ContactStep> steps, bool with_frame) {
    std::string text(kHeader);
    text += with_frame ? ",frame\n" : "\n";
    for (const ContactStep& step : steps) {
        std::vector<const ContactRecord*> order;
        for (const ContactRecord& row : step.rows) order.push_back(&row);
        std::stable_sort(order.begin(), order.end(), [](const ContactRecord* a, const ContactRecord* b) { return a->compare_ids(*b) < 0; });
        for (const ContactRecord* row : order) {
            append_row(text, *row);
            if (with_frame) fmt::format_to(std::back_inserter(text), ",{}", step.frame);
            text += '\n';
        }
    }
    return text;
}

Result<void> write_hits(const std::filesystem::path& path, std::span<const HitRecord> hits) {
    return write_file_atomically(path, {reinterpret_cast<const char*>(hits.data()), hits.size_bytes()});
}

} // namespace trocar::engine
