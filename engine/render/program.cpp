#include "engine/render/program.hpp"

#include "engine/render/shader_text.hpp"

#include <fmt/format.h>

namespace trocar::engine {
namespace {

constexpr std::string_view kIncludeWord = "#include \"";
constexpr int kMaxIncludeDepth = 8;

[[nodiscard]] Result<std::string> expand(std::string_view name, int depth) {
    std::string_view text;
    for (const ShaderText& shader : shader_texts())
        if (shader.name == name) text = shader.text;
    if (text.empty() || depth > kMaxIncludeDepth)
        return Error{ErrorCode::ToolFailed, fmt::format("shader {} is not part of this build", name)};

    std::string result;
    while (!text.empty()) {
        const std::size_t end = text.find('\n');
        const std::string_view line = text.substr(0, end);
        text = end == std::string_view::npos ? std::string_view() : text.substr(end + 1);
        if (line.substr(0, kIncludeWord.size()) != kIncludeWord) {
            result.append(line).append("\n");
            continue;
        }
        const std::string_view rest = line.substr(kIncludeWord.size());
        Result<std::string> included = expand(rest.substr(0, rest.find('"')), depth + 1);
        if (!included) return included;
        result += *included;
    }
    return result;
}

[[nodiscard]] Result<GLuint> compile(const GlApi& gl, GLenum stage, std::string_view name) {
    const Result<std::string> text = assemble_shader(name);
    if (!text) return text.error();
    const GLuint shader = gl.CreateShader(stage);
    const GLchar* source = text->c_str();
    gl.ShaderSource(shader, 1, &source, nullptr);
    gl.CompileShader(shader);
    GLint compiled = GL_FALSE;
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (compiled == GL_TRUE) return shader;
    std::string log(4096, '\0');
    GLsizei length = 0;
    gl.GetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
    gl.DeleteShader(shader);
    return Error{ErrorCode::ToolFailed, fmt::format("the graphics driver cannot compile shader {}: {}", name, log)};
}

} // namespace

Result<std::string> assemble_shader(std::string_view name) {
    Result<std::string> text = expand(name, 0);
    if (!text) return text;
    return "#version 450 core\n" + *text;
}

Result<GLuint> make_program(const GlApi& gl, std::string_view vertex_name, std::string_view fragment_name) {
    const Result<GLuint> vertex = compile(gl, GL_VERTEX_SHADER, vertex_name);
    if (!vertex) return vertex;
    const Result<GLuint> fragment = compile(gl, GL_FRAGMENT_SHADER, fragment_name);
    if (!fragment) {
        gl.DeleteShader(*vertex);
        return fragment;
    }
    const GLuint program = gl.CreateProgram();
    gl.AttachShader(program, *vertex);
    gl.AttachShader(program, *fragment);
    gl.LinkProgram(program);
    gl.DeleteShader(*vertex);
    gl.DeleteShader(*fragment);
    GLint linked = GL_FALSE;
    gl.GetProgramiv(program, GL_LINK_STATUS, &linked);
    if (linked == GL_TRUE) return program;
    std::string log(4096, '\0');
    GLsizei length = 0;
    gl.GetProgramInfoLog(program, static_cast<GLsizei>(log.size()), &length, log.data());
    log.resize(static_cast<std::size_t>(length));
    gl.DeleteProgram(program);
    return Error{ErrorCode::ToolFailed, fmt::format("the graphics driver cannot link {} with {}: {}", vertex_name, fragment_name, log)};
}

} // namespace trocar::engine
