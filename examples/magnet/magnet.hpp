// An effect of the program's own: a magnet outside of the patient pulls at the tips of instruments, as in magnetic navigation.
#pragma once

#include <trocar.hpp>

/// Scenes may name it once it was added: "effects": {..., "magnet": {"force": 0.02, "place": [20, 0, 80]}}.
extern const trocar::engine::EffectDescriptor magnet;
