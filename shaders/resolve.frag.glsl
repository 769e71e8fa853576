// Front to back over a pixel's list, then the opaque surface, then the background; display curve at the end, so that
// the reduction averages what is seen. Picks the next layer by (depth, colour): the result does not depend on the order
// of the list, and no list is too long for a local array.
layout(binding = 0) uniform sampler2D opaque_colour;
layout(binding = 1) uniform sampler2D opaque_depth;
layout(binding = 0, r32ui) uniform readonly uimage2D heads;
layout(binding = 1, std430) readonly buffer Nodes { uvec4 nodes[]; };

uniform vec2 tile_offset;  // of this tile in the supersampled picture, pixels
uniform vec2 picture_size; // supersampled
uniform uint has_layers;

layout(location = 0) out vec4 colour;

const uint kEnd = 0xffffffffu;
const int kMaxLayers = 200; // llvmpipe ends a shader's loops after 65,535 rounds in all: 200 * 200 stays below

bool before(uvec4 a, uvec4 b) { // nearer, or the same depth and smaller bits
    if (a.z != b.z) return a.z < b.z; // positive floats order as their bits
    return a.x != b.x ? a.x < b.x : a.y < b.y;
}

vec3 background(vec2 at) { // 0..1, from the lower left
    vec2 d = (at - vec2(0.5, 0.56)) * vec2(picture_size.x / picture_size.y, 1.0);
    return mix(vec3(0.985, 0.988, 0.990), vec3(0.800, 0.832, 0.862), smoothstep(0.0, 1.25, length(d)));
}

vec3 displayed(vec3 c) { // soft shoulder above 0.75, so that highlights keep their hue; white stays white
    vec3 over = max(c - 0.75, 0.0);
    return min(c, 0.75) + 0.25 * (1.0 - exp(-over / 0.25));
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    bool covered = texelFetch(opaque_depth, pixel, 0).r < 1.0;
    vec4 opaque = texelFetch(opaque_colour, pixel, 0);
    float strength = covered ? 1.0 - opaque.a : 1.0;

    vec3 sum = vec3(0.0);
    float left = 1.0; // what still shines through
    if (has_layers != 0u) {
        uint head = imageLoad(heads, pixel).r;
        uvec4 last = uvec4(0u);
        for (int layer = 0; layer < kMaxLayers && left > 0.003; ++layer) {
            uvec4 next = uvec4(kEnd);
            int count = 0;
            for (uint at = head; at != kEnd && count < kMaxLayers; ++count) {
                uvec4 node = nodes[at];
                if ((layer == 0 || before(last, node)) && before(node, next)) next = node;
                at = node.w;
            }
            if (next.z == kEnd) break;
            vec4 c = vec4(unpackHalf2x16(next.x), unpackHalf2x16(next.y)) * strength;
            sum += left * c.rgb;
            left *= 1.0 - c.a;
            last = next;
        }
    }
    vec3 behind = covered ? displayed(opaque.rgb) : background((tile_offset + gl_FragCoord.xy) / picture_size);
    colour = vec4(displayed(sum) + left * behind, 1.0);
}
