// Three lights that travel with the camera (key from the upper left, fill from the right, rim from behind), sky and
// ground ambient, and two highlights: a broad sheen and a sharp one, as moist tissue has. Linear colours.
uniform vec3 to_eye_orthographic; // (0,0,1) for an orthographic camera, 0 for a perspective one

struct Lit {
    vec3 diffuse;  // scales with the surface's opacity
    vec3 specular; // does not: a highlight sits on the surface even where it is clear
    float facing;  // |n . v|
};

vec3 surface_normal(vec3 position, vec3 normal) {
    float size = dot(normal, normal);
    return size > 1e-6 ? normal * inversesqrt(size) : normalize(cross(dFdx(position), dFdy(position)));
}

vec3 direction_to_eye(vec3 position) {
    return dot(to_eye_orthographic, to_eye_orthographic) > 0.5 ? to_eye_orthographic : normalize(-position);
}

float lobe(vec3 n, vec3 l, vec3 v, float power) {
    vec3 h = normalize(l + v);
    return pow(max(dot(n, h), 0.0), power) * step(0.0, dot(n, l));
}

float wrapped(vec3 n, vec3 l, float wrap) {
    return max((dot(n, l) + wrap) / (1.0 + wrap), 0.0);
}

Lit light_surface(vec3 base, vec3 n, vec3 v, float gloss) {
    const vec3 key = normalize(vec3(-0.55, 0.75, 0.65));
    const vec3 fill = normalize(vec3(0.85, 0.05, 0.45));
    const vec3 rim = normalize(vec3(0.25, 0.55, -0.85));
    vec3 sky = mix(vec3(0.30, 0.27, 0.26), vec3(0.50, 0.53, 0.57), 0.5 + 0.5 * n.y);
    vec3 light = 0.62 * sky + vec3(1.00, 0.97, 0.93) * 1.10 * wrapped(n, key, 0.15) +
                 vec3(0.80, 0.88, 1.00) * 0.26 * wrapped(n, fill, 0.35);
    float facing = abs(dot(n, v));
    float fresnel = pow(1.0 - facing, 4.0);
    Lit lit;
    lit.diffuse = base * light;
    lit.specular = gloss * (vec3(0.05 * lobe(n, key, v, 20.0) + 0.26 * lobe(n, key, v, 110.0) + 0.04 * lobe(n, fill, v, 60.0)) +
                            vec3(0.9, 0.95, 1.0) * fresnel * 0.25 * wrapped(n, rim, 0.4));
    lit.facing = facing;
    return lit;
}
