// Beer-Lambert for every sample: intensity, not absorbance, is what a detector's pixel averages.
layout(binding = 0) uniform sampler2D absorbance;

layout(location = 0) out vec4 intensity;

void main() {
    float a = max(texelFetch(absorbance, ivec2(gl_FragCoord.xy), 0).r, 0.0);
    intensity = vec4(exp(-a));
}
