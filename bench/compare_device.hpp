// Private to bench: stage II by OpenGL beside the CPU reference.
#pragma once

#include "bench/chromatic_table.hpp"
#include "engine/render/gl_cull_backend.hpp"

namespace trocar::engine {

/// The same views by OpenGL and by the CPU reference, over sizes, into rows; and a note from which size on the device is faster.
void compare_with_device(ChromaticTable& table, BenchTable& result, const GlCullBackend& device, std::size_t steps);

} // namespace trocar::engine
