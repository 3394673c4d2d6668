// A splat as whoever composites takes it: `view`, `splats` and `tables` are bound before.

struct Staged {
    vec2 center;
    // First two numbers of the conic.
    vec2 conic;
    // Its last, peak, depth of the centre, extent.
    vec4 peak;
    // As `Shape` has it.
    vec2 slope;
    uint material;
    // footprint | kind << 8.
    uint look;
    // Columns and rows of pixels [x0, x1, y0, y1).
    uvec4 bounds;
};

Staged staged_of(uint id) {
    uint at = id * view.splat_words;
    vec2 center = uintBitsToFloat(uvec2(splats[at], splats[at + 1u]));
    uint look = splats[at + SPLAT_TABLES];
    vec4 depth = vec4(0.0, 0.0, 0.0, 1.0);
    if (view.splat_words > SPLAT_DEPTH) {
        depth = uintBitsToFloat(
            uvec4(splats[at + SPLAT_DEPTH], splats[at + 9u], splats[at + 10u], splats[at + 11u]));
    }
    vec4 shape = uintBitsToFloat(uvec4(splats[at + 2u], splats[at + 3u], splats[at + 4u], splats[at + SPLAT_PEAK]));
    Staged s;
    s.center = center;
    s.conic = shape.xy;
    s.peak = vec4(shape.zw, depth.x, depth.w);
    s.slope = depth.yz;
    s.material = look & 0xffffu;
    s.look = look >> 16;
    s.bounds = bounds_of(center, splats[at + SPLAT_EXTENTS], view.size);
    return s;
}

vec4 extinction_of(uint material) {
    return uintBitsToFloat(tables[FOOTPRINT_VECTORS * view.footprints + material]);
}
