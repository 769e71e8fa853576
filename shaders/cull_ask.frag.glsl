// Is the prism free of all of the set but its neighbour, in this pixel? As CpuCullBackend::is_hit.
#include "cull.glsl"

layout(binding = 0) uniform usampler2DArray first;
layout(binding = 1) uniform usampler2DArray second;
layout(binding = 2) uniform sampler2DArray first_front;
layout(binding = 3) uniform sampler2DArray second_front;
layout(binding = 4) uniform sampler2DArray third_front;
layout(binding = 4, std430) buffer Hits { uint hits[]; };

uniform uint with_intervals; // 0: fronts alone

flat in uint question;
flat in uint prism;
flat in int layer;

const uint kNobody = 0xffffffffu;

bool is_free(ivec3 at, vec2 depths) {
    uvec2 one = texelFetch(first, at, 0).xy;
    if (one.x == kNobody || depths.y < texelFetch(first_front, at, 0).x) return true;
    bool neighbour = are_adjacent(prism, one.x);
    if (with_intervals == 0u) return neighbour && depths.y < texelFetch(second_front, at, 0).x;
    if (!neighbour && depths.x <= uintBitsToFloat(one.y)) return false;
    if (depths.y < texelFetch(second_front, at, 0).x) return true;
    uvec2 two = texelFetch(second, at, 0).xy;
    if (two.x == kNobody) return true;
    if (depths.x <= uintBitsToFloat(two.y) && !are_adjacent(prism, two.x)) return false;
    return depths.y < texelFetch(third_front, at, 0).x;
}

void main() {
    if (hits[question] != 0u) return;
    vec2 depths;
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (look_at(prism, pixel, depths) && !is_free(ivec3(pixel, layer), depths)) hits[question] = 1u;
}
