// Generated patients on disk: made at first use, read back bit for bit afterwards.
#pragma once

#include "assets/anatomy/anatomy.hpp"

#include <string>

namespace trocar::engine {

/// Hash of every number of the recipe and of the generator's version.
[[nodiscard]] std::string patient_key(const anatomy::Recipe& recipe);

/// From the cache, or generated and put there. Only surfaces and landmarks are kept: a cached patient has no centreline.
[[nodiscard]] Result<anatomy::Anatomy> make_patient(const anatomy::Recipe& recipe, const std::string& key);

} // namespace trocar::engine
