// Splats in the light's frame, as `tsm::frame` has them; `view`, `positions` and `frames` are bound before.

// A difference a - b rounded once, and what rounding left of it (D. E. Knuth 1969).
precise vec3 difference(vec3 a, vec3 b, out vec3 rest) {
    precise vec3 d = a - b;
    precise vec3 part = d - a;
    precise vec3 left = (a - (d - part)) - (b + part);
    rest = left;
    return d;
}

precise vec3 turned(vec3 p) {
    precise float x = view.axis_x.x * p.x + view.axis_y.x * p.y + view.axis_z.x * p.z;
    precise float y = view.axis_x.y * p.x + view.axis_y.y * p.y + view.axis_z.y * p.z;
    precise float z = view.axis_x.z * p.x + view.axis_y.z * p.y + view.axis_z.z * p.z;
    return vec3(x, y, z);
}

// The light's position is a sum of two numbers, so that what is near it keeps its digits.
vec3 position_of(uint splat) {
    vec3 p = vec3(positions[3u * splat], positions[3u * splat + 1u], positions[3u * splat + 2u]);
    vec3 rest;
    vec3 coarse = difference(p, view.light_high.xyz, rest);
    precise vec3 offset = coarse + (rest - view.light_low.xyz);
    return turned(offset * view.unit);
}

vec3 frame_at(uint splat, uint word) {
    if (word >= view.frame_words) {
        return vec3(0.0);
    }
    uint at = splat * view.frame_words + word;
    return vec3(frames[at], frames[at + 1u], frames[at + 2u]);
}
