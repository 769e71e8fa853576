// Last pass of the shaded picture.
#include "reduce.glsl"

layout(location = 0) out vec4 colour;

void main() {
    colour = vec4(encoded(reduced().rgb), 1.0);
}
