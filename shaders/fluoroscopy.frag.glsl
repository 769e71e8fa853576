// Last pass of the X-ray picture: detector noise, vignette, grey levels.
#include "reduce.glsl"

uniform vec2 picture_size; // pixels

layout(location = 0) out vec4 colour;

void main() {
    float intensity = reduced().r;
    // quantum noise: grows as the square root of the dose that arrives; three uniform numbers are near enough to a normal one
    float normal = 2.0 * (noise(1u) + noise(2u) + noise(3u)) - 3.0;
    intensity += 0.010 * normal * sqrt(max(intensity, 0.02));
    vec2 at = (gl_FragCoord.xy + tile_offset) / picture_size - 0.5;
    float vignette = 1.0 - 0.30 * smoothstep(0.35, 1.15, length(at * vec2(picture_size.x / picture_size.y, 1.0)));
    float grey = 0.84 * max(intensity, 0.0) * vignette + 0.02;
    colour = vec4(vec3(grey + (noise(0u) - 0.5) / 255.0), 1.0);
}
