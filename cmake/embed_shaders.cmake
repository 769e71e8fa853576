# Script: cmake -DOUTPUT=file.cpp -DSHADERS="a.glsl;b.glsl" -P embed_shaders.cmake
# Writes every shader's text into one C++ source, so that the program needs no files beside it.
set(entries "")
foreach(shader IN LISTS SHADERS)
    get_filename_component(name ${shader} NAME)
    file(READ ${shader} text)
    string(APPEND entries "    {\"${name}\", R\"glsl(${text})glsl\"},\n")
endforeach()
file(WRITE ${OUTPUT} "// Generated from shaders/ by cmake/embed_shaders.cmake.
#include \"engine/render/shader_text.hpp\"

namespace trocar::engine {
namespace {

constexpr ShaderText kShaders[] = {
${entries}};

} // namespace

std::span<const ShaderText> shader_texts() noexcept { return kShaders; }

} // namespace trocar::engine
")
