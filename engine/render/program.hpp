// Private to engine/render: shader programs from the embedded texts.
#pragma once

#include "base/result.hpp"
#include "engine/render/gl_api.hpp"

#include <string>
#include <string_view>

namespace trocar::engine {

/// The text of a shader with its `#include "name"` lines replaced, headed by the version line.
/// failure  ToolFailed for a name that is not among the embedded texts
[[nodiscard]] Result<std::string> assemble_shader(std::string_view name);

/// Compiles and links; the context must be current. Belongs to the context, which frees it.
/// failure  ToolFailed with the driver's log
[[nodiscard]] Result<GLuint> make_program(const GlApi& gl, std::string_view vertex_name, std::string_view fragment_name);

} // namespace trocar::engine
