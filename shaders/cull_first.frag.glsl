// The nearest front of a set in each pixel: depth, and who it is and its back.
#include "cull.glsl"

flat in uint prism;

layout(location = 0) out uvec2 who; // prism, back

void main() {
    vec2 depths;
    if (!look_at(prism, ivec2(gl_FragCoord.xy), depths)) discard;
    gl_FragDepth = depths.x;
    who = uvec2(prism, floatBitsToUint(depths.y));
}
