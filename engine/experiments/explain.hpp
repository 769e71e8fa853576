// What a scene will simulate and why, what it will not, how many sub-steps, how much memory, what it will cost.
#pragma once

#include "engine/prepare/prepare_scene.hpp"

#include <functional>
#include <string>

namespace trocar::engine {

/// Tells it in parts, the quick ones first: the cost is found by trials of the first steps, at most about half a minute.
/// tell      called with each part, lines that end in a line break
/// progress  called before each trial
void explain_scene(const Scene& scene, const PreparedScene& prepared, const std::function<void(const std::string&)>& tell,
                   const Progress& progress);

} // namespace trocar::engine
