// What the kernels of splatting share: the words of a splat and the pixels that it reaches.

// Words of a splat: centre (2 f32), conic (3), peak, halves of its extents, material | footprint << 16 | kind << 24; then
// with depths: depth of the centre, its slope (2; of a medium as `ProjectedDepth` has it), extent,
// conic of a disc without the filter (3). A splat without an image has the peak 0.
const uint SPLAT_PEAK = 5u;
const uint SPLAT_EXTENTS = 6u;
const uint SPLAT_TABLES = 7u;
const uint SPLAT_DEPTH = 8u;
const uint SPLAT_CORE = 12u;

// Side of a tile, pixels.
const uint TILE = 16u;

// The pixels [x, y) of one axis that a splat reaches, as `ProjectedSplat::bounds`.
precise uvec2 reach_of(float center, float extent, float size) {
    precise float middle = center + 0.5;
    precise float low = middle - extent;
    precise float high = middle + extent;
    return uvec2(uint(clamp(low, 0.0, size)), uint(clamp(high, 0.0, size)));
}

// Columns and rows of pixels [x0, x1, y0, y1).
uvec4 bounds_of(vec2 center, uint extents, vec2 size) {
    uvec2 x = reach_of(center.x, uintBitsToFloat(extents << 16), size.x);
    uvec2 y = reach_of(center.y, uintBitsToFloat(extents & 0xffff0000u), size.y);
    return uvec4(x, y);
}

// First column and row of tiles, and how many across and down; none where there are no pixels.
uvec4 tiles_of(uvec4 bounds) {
    if (bounds.x >= bounds.y || bounds.z >= bounds.w) {
        return uvec4(0u);
    }
    uvec2 first = bounds.xz / TILE;
    return uvec4(first, (bounds.yw - 1u) / TILE - first + 1u);
}
