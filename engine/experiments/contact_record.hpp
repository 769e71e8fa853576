// A contact of the exact search as the row that files and scripts read.
#pragma once

#include "collision/search/surface_pair.hpp"
#include "engine/io/contact_rows.hpp"

#include <cstdint>
#include <span>

namespace trocar::engine {

/// objects   [vertex_count] to which body a vertex belongs, where one surface stands for several; empty: the contact's own bodies
[[nodiscard]] ContactRecord record_of(const collision::SearchContact& found, std::span<const std::int32_t> objects = {});

} // namespace trocar::engine
