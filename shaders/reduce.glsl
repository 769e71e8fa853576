// Two by two samples to a pixel with the tent (1 3 3 1) x (1 3 3 1) / 64, and 8-bit output with a small dither.
layout(binding = 0) uniform sampler2D samples;

uniform vec2 tile_offset; // of this tile in the picture, pixels

vec4 reduced() { // samples carry a border of one
    ivec2 corner = 2 * ivec2(gl_FragCoord.xy);
    const float weight[4] = float[4](0.125, 0.375, 0.375, 0.125);
    vec4 sum = vec4(0.0);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 4; ++x) sum += weight[x] * weight[y] * texelFetch(samples, corner + ivec2(x, y), 0);
    return sum;
}

uint hashed(uvec2 at) { // a fixed pattern: the same picture gives the same file. Source: O'Neill 2014, PCG
    uint state = (at.x * 1664525u + at.y * 22695477u + 1013904223u) * 747796405u + 2891336453u;
    uint word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

float noise(uint salt) { // 0..1
    uvec2 at = uvec2(gl_FragCoord.xy + tile_offset);
    return float(hashed(at + uvec2(salt * 7919u, salt * 104729u)) >> 8u) / 16777216.0;
}

vec3 encoded(vec3 linear) { // sRGB
    vec3 c = clamp(linear, 0.0, 1.0);
    vec3 srgb = mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
    return srgb + (noise(0u) - 0.5) / 255.0;
}
