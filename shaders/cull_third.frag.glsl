// The nearest front of any but the first and the second: its depth alone.
#include "cull.glsl"

layout(binding = 0) uniform usampler2DArray first;
layout(binding = 1) uniform usampler2DArray second;

uniform uint first_set;

flat in uint prism;

void main() {
    ivec3 at = ivec3(gl_FragCoord.xy, int(corners[prism].w - first_set));
    if (texelFetch(first, at, 0).x == prism || texelFetch(second, at, 0).x == prism) discard;
    vec2 depths;
    if (!look_at(prism, at.xy, depths)) discard;
    gl_FragDepth = depths.x;
}
