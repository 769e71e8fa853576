// Every triangle surface: positions relative to the scene's origin, normals in world axes.
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;

uniform mat4 view_from_origin;
uniform mat4 clip_from_view;

out vec3 view_position; // m, eye at 0, looking along -z
out vec3 view_normal;

invariant gl_Position; // the same depth in every pass

void main() {
    vec4 p = view_from_origin * vec4(position, 1.0);
    view_position = p.xyz;
    view_normal = mat3(view_from_origin) * normal;
    gl_Position = clip_from_view * p;
}
