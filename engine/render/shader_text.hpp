// Private to engine/render: the texts of shaders/, embedded at build time.
#pragma once

#include <span>
#include <string_view>

namespace trocar::engine {

struct ShaderText {
    std::string_view name; // file name in shaders/
    std::string_view text;
};

[[nodiscard]] std::span<const ShaderText> shader_texts() noexcept;

} // namespace trocar::engine
