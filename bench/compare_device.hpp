// Private to bench: stage II by OpenGL beside the CPU twin.
#pragma once

#include "bench/chromatic_table.hpp"
#include "engine/render/gl_cull_backend.hpp"

namespace trocar::engine {

/// The same pictures by OpenGL and by the CPU twin, over sizes, into rows; and a note from which size on the device is faster.
void compare_with_device(ChromaticTable& table, BenchTable& result, const GlCullBackend& device, std::size_t steps);

} // namespace trocar::engine
