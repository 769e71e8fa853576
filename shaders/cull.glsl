// Footprints of swept triangles as collision/cull_frame.hpp makes them, evaluated in its order: without fused products, so that the
// CPU reference gets the same bits. Every rectangle is drawn from whole pixel to whole pixel; which pixels the prism may reach is decided
// here, for the whole square of a pixel, so sample positions and vertex snapping do not matter.
layout(binding = 0, std430) readonly buffer Footprints { uint words[]; }; // 32 to a prism
layout(binding = 1, std430) readonly buffer Corners { uvec4 corners[]; }; // vertex ids, set

ivec4 rectangle(uint prism) {
    uint at = 32u * prism;
    return ivec4(words[at], words[at + 1u], words[at + 2u], words[at + 3u]);
}

float number(uint at) { return uintBitsToFloat(words[at]); }

/// False: nothing of the prism can be in this pixel. Otherwise depths = (front, back).
bool look_at(uint prism, ivec2 pixel, out vec2 depths) {
    uint at = 32u * prism;
    precise float u = float(pixel.x - int(words[at]));
    precise float v = float(pixel.y - int(words[at + 1u]));
    bool inside = true;
    for (uint k = 0u; k < 6u; ++k) {
        uint e = at + 4u + 3u * k;
        precise float x = number(e) * u;
        precise float y = number(e + 1u) * v;
        precise float sum = x + y;
        inside = inside && sum <= number(e + 2u);
    }
    precise float fx = number(at + 23u) * u;
    precise float fy = number(at + 24u) * v;
    precise float bx = number(at + 26u) * u;
    precise float by = number(at + 27u) * v;
    precise float front = (number(at + 22u) + fx) + fy;
    precise float back = (number(at + 25u) + bx) + by;
    depths = vec2(front > number(at + 28u) ? front : number(at + 28u), back < number(at + 29u) ? back : number(at + 29u));
    return inside && depths.x <= depths.y;
}

bool are_adjacent(uint a, uint b) {
    uvec3 p = corners[a].xyz, q = corners[b].xyz;
    return any(equal(p, q.xyz)) || any(equal(p, q.yzx)) || any(equal(p, q.zxy));
}

/// Corner k of the two triangles of a rectangle, in clip space.
vec4 rectangle_corner(ivec4 r, uint k, vec2 picture) {
    bool right = k == 1u || k == 3u || k == 4u, top = k == 2u || k == 4u || k == 5u;
    return vec4(2.0 * vec2(right ? r.z : r.x, top ? r.w : r.y) / picture - 1.0, 0.5, 1.0);
}
