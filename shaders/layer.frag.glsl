// Transparent surfaces: every fragment in front of the opaque ones joins its pixel's list. The order of a list depends
// on the hardware; resolve.frag.glsl sorts, so that the picture does not.
// Based on: Yang, Hensley, Gruen, Thibieroz 2010, Real-time concurrent linked list construction on the GPU.
#include "lighting.glsl"

layout(early_fragment_tests) in;

in vec3 view_position;
in vec3 view_normal;

uniform vec4 base_colour; // linear rgb, opacity seen face-on
uniform float gloss;
uniform uint capacity;    // nodes that fit

layout(binding = 0, r32ui) uniform coherent uimage2D heads;
layout(binding = 0, std430) coherent buffer Counter { uint node_count; };
layout(binding = 1, std430) writeonly buffer Nodes { uvec4 nodes[]; }; // premultiplied rgba as halves, depth, next

void main() {
    vec3 v = direction_to_eye(view_position);
    vec3 n = surface_normal(view_position, view_normal);
    bool front = dot(n, v) >= 0.0;
    if (!front) n = -n;
    Lit lit = light_surface(base_colour.rgb, n, v, gloss);

    // the way through a thin shell grows as 1 / cos: face-on opacity a becomes 1 - (1 - a)^(1 / cos)
    float opacity = 1.0 - pow(1.0 - base_colour.a, 1.0 / max(lit.facing, 0.22));
    if (!front) opacity *= 0.55; // the far wall only hints at the shape
    vec3 colour = lit.diffuse * mix(1.0, 0.80, pow(1.0 - lit.facing, 2.0)) * opacity + lit.specular * (front ? 0.9 : 0.1);

    uint node = atomicAdd(node_count, 1u);
    if (node >= capacity) return; // counted, so that the caller draws again in smaller tiles
    uint next = imageAtomicExchange(heads, ivec2(gl_FragCoord.xy), node);
    nodes[node] = uvec4(packHalf2x16(colour.rg), packHalf2x16(vec2(colour.b, opacity)), floatBitsToUint(gl_FragCoord.z), next);
}
