#include "cull.glsl"

layout(binding = 3, std430) readonly buffer Questions { uvec2 questions[]; }; // prism, set

uniform vec2 picture;
uniform uint first_set;

flat out uint question;
flat out uint prism;
flat out int layer;

void main() {
    question = uint(gl_VertexID) / 6u;
    prism = questions[question].x;
    layer = int(questions[question].y - first_set);
    gl_Position = rectangle_corner(rectangle(prism), uint(gl_VertexID) % 6u, picture);
}
