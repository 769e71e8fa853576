// Opaque surfaces. alpha carries the emphasis: how much of what lies in front is left out later.
#include "lighting.glsl"

in vec3 view_position;
in vec3 view_normal;

uniform vec4 base_colour; // linear rgb, unused
uniform float emphasis;
uniform float gloss;

layout(location = 0) out vec4 colour;

void main() {
    vec3 v = direction_to_eye(view_position);
    vec3 n = surface_normal(view_position, view_normal);
    if (dot(n, v) < 0.0) n = -n;
    Lit lit = light_surface(base_colour.rgb, n, v, gloss);
    float edge = mix(1.0, 0.72, pow(1.0 - lit.facing, 3.0)); // a darker rim parts thin bodies from what lies behind
    colour = vec4(lit.diffuse * edge + lit.specular, emphasis);
}
