// The nearest front of any but the first.
#include "cull.glsl"

layout(binding = 0) uniform usampler2DArray first;

uniform uint first_set;

flat in uint prism;

layout(location = 0) out uvec2 who;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    if (texelFetch(first, ivec3(pixel, int(corners[prism].w - first_set)), 0).x == prism) discard;
    vec2 depths;
    if (!look_at(prism, pixel, depths)) discard;
    gl_FragDepth = depths.x;
    who = uvec2(prism, floatBitsToUint(depths.y));
}
