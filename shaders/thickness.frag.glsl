// Adds up attenuation * way through a closed body: far walls count plus, near walls minus, so that the sum over a body is
// the length of the ray inside it, however the body folds. Distances start at the picture's centre to keep floats short.
in vec3 view_position;
in vec3 view_normal;

uniform float attenuation; // 1/m
uniform float reference;   // m
uniform float orthographic;

layout(location = 0) out float absorbance;

void main() {
    float along = orthographic > 0.5 ? -view_position.z : length(view_position);
    absorbance = attenuation * (gl_FrontFacing ? reference - along : along - reference);
}
