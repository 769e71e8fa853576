// Keys of places: where instruments enter, what they are driven to, where blood comes in.
#pragma once

#include "engine/scene/described.hpp"
#include "engine/scene/reader.hpp"
#include "engine/scene/scene.hpp"

namespace trocar::engine {

struct LandmarkKeys {
    using Struct = PlaceSpec;
    static auto of(auto& s) {
        return described({"landmark", "A named place of a generated patient.", "landmark"},
                         key(s.landmark, text_field("landmark", "Such as femoral_entry.").required()),
                         custom_key(text_field("body", "The recipe body it belongs to; needed where the patient is not clear without it."),
                                    kReadApart, s.body));
    }
};

struct EntryPositionKeys {
    using Struct = PlaceSpec;
    static auto of(auto& s) {
        return described(
            {"entry position", "A place inside the lumen and the direction into the vessel.", "position"},
            key(s.position, vector_field("position", Dimension::Length, coordinate(), "Where the instrument enters.").required()),
            direction_key(s.direction,
                          vector_field("direction", Dimension::None, {}, "Into the vessel; its length does not matter.").required()));
    }
};
static_assert(describes_all<LandmarkKeys, EntryPositionKeys>);

struct TargetPositionKeys {
    using Struct = PlaceSpec;
    static auto of(auto& s) {
        return described({"target position", "A place.", "position"},
                         key(s.position, vector_field("position", Dimension::Length, coordinate(), "In the lumen.").required()));
    }
};

[[nodiscard]] inline ValueSpec entry_value() {
    return any_value({object_value(table_of<LandmarkKeys>()), object_value(table_of<EntryPositionKeys>())});
}
[[nodiscard]] inline ValueSpec target_value() {
    return any_value({object_value(table_of<LandmarkKeys>()), object_value(table_of<TargetPositionKeys>())});
}

/// Rows of a time and a number.
[[nodiscard]] inline ValueSpec rows_over_time(Column value) {
    return rows_value({{"t", Dimension::Time, between(0.0, 1e6)}, std::move(value)}, 1, 1000000);
}

/// Rows of a time and a displacement.
[[nodiscard]] inline ValueSpec displacement_rows() {
    return rows_value({{"t", Dimension::Time, between(0.0, 1e6)},
                       {"x", Dimension::Length, coordinate()},
                       {"y", Dimension::Length, coordinate()},
                       {"z", Dimension::Length, coordinate()}},
                      1, 1000000);
}

} // namespace trocar::engine
