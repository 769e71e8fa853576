#include "cull.glsl"

uniform vec2 picture; // pixels

flat out uint prism;

void main() {
    prism = uint(gl_VertexID) / 6u;
    gl_Position = rectangle_corner(rectangle(prism), uint(gl_VertexID) % 6u, picture);
}
