// Files of surfaces say no unit: recognised by size, and said.
#pragma once

#include <string>

namespace trocar::engine {

struct UnitGuess {
    std::string name;    // m, cm, mm, um
    double metres = 1.0; // of one unit
};

/// longest  longest side of the anatomy's box, in the file's unit: vessels and organs that are imported measure 3 cm to 3 m
[[nodiscard]] inline UnitGuess guess_unit(double longest) {
    if (longest < 3.0) return {"m", 1.0};
    if (longest < 30.0) return {"cm", 1e-2};
    if (longest < 3e3) return {"mm", 1e-3};
    return {"um", 1e-6};
}

} // namespace trocar::engine
