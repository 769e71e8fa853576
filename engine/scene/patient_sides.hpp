// The letters of the patient's sides. World: RAS, +x patient's right, +y anterior, +z head.
#pragma once

#include "base/vec.hpp"

#include <string>

namespace trocar::engine {

/// Of a direction, as DICOM names a picture's edges (PS3.3 C.7.6.1.1.1): R, L, A, P, H or F, the nearest side, then a second one where it leans to that.
[[nodiscard]] std::string side_letters(const Vec3& direction);

} // namespace trocar::engine
