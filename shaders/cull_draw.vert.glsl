#extension GL_ARB_shader_viewport_layer_array : require
#include "cull.glsl"

layout(binding = 2, std430) readonly buffer Members { uint members[]; };

uniform vec2 picture; // pixels
uniform uint first_set; // of those in the layers

flat out uint prism;

void main() {
    prism = members[uint(gl_VertexID) / 6u];
    gl_Layer = int(corners[prism].w - first_set);
    gl_Position = rectangle_corner(rectangle(prism), uint(gl_VertexID) % 6u, picture);
}
