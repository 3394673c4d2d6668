// What a particle that is shown as it is adds to its pixel. Bound before: `view`, `objects`, `particles`, `sums`; sums.glsl
// comes before.

// Its colour in the unit of radiance, and the square of its luminance in steps of 2^-24.
struct Shown {
    vec3 color;
    float square;
};

Shown shown_by(uint word) {
    vec4 emission = objects[particles[word + 6u]].emission;
    precise vec3 radiance = unpack_color(particles[word + 4u]) * emission.w + emission.xyz;
    vec3 v = in_unit(radiance);
    return Shown(v, square_of(luminance_of(v)));
}

void add_hit(uint pixel, Shown hit) {
    uint at = sums_at(pixel);
    sums[at] += 1u;
    add(at + 1u, fixed_point(hit.color.x));
    add(at + 3u, fixed_point(hit.color.y));
    add(at + 5u, fixed_point(hit.color.z));
    add(at + 7u, whole(hit.square));
}
