// The front of one prism, to be drawn, or its back, to be asked about.
#include "cull.glsl"

uniform uint with_back;

flat in uint prism;

void main() {
    vec2 depths;
    if (!look_at(prism, ivec2(gl_FragCoord.xy), depths)) discard;
    gl_FragDepth = with_back != 0u ? depths.y : depths.x;
}
