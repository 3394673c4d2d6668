// The splats of a tile in shared memory, batch by batch. Bound before: `view`, `splats`, `tables`.

#include "fragment.glsl"

// Splats that are looked at together. Also how often a tile is looked at for being done.
const uint BATCH = 128u;

shared uint batch_ids[BATCH];
// Blocks of 4 by 4 pixels that the splat reaches: columns and rows [x0, x1, y0, y1) of pixels.
shared uvec4 batch_reach[BATCH];
// As `Shape` has them.
shared vec4 batch_conic[BATCH];
shared vec4 batch_peak[BATCH];
shared vec2 batch_slope[BATCH];
shared uint batch_look[BATCH];

// Puts a splat into the batch, and gives its material.
uint stage(uint k, uint id, uvec2 corner) {
    uint at = id * view.splat_words;
    vec2 center = uintBitsToFloat(uvec2(splats[at], splats[at + 1u]));
    uint look = splats[at + SPLAT_TABLES];
    uvec4 bounds = bounds_of(center, splats[at + SPLAT_EXTENTS], view.size);
    vec4 depth = vec4(0.0, 0.0, 0.0, 1.0);
    if (view.splat_words > SPLAT_DEPTH) {
        depth = uintBitsToFloat(
            uvec4(splats[at + SPLAT_DEPTH], splats[at + 9u], splats[at + 10u], splats[at + 11u]));
    }
    vec4 shape = uintBitsToFloat(uvec4(splats[at + 2u], splats[at + 3u], splats[at + 4u], splats[at + SPLAT_PEAK]));
    batch_ids[k] = id;
    batch_reach[k] = uvec4(bounds.x & ~3u, (bounds.y + 3u) & ~3u, bounds.z & ~3u, (bounds.w + 3u) & ~3u);
    batch_conic[k] = vec4(origin_of(corner, center), shape.xy);
    batch_peak[k] = vec4(shape.zw, depth.x, depth.w);
    batch_slope[k] = depth.yz;
    // footprint | kind << 8.
    batch_look[k] = look >> 16;
    return look & 0xffffu;
}

Shape shape_of(uint k) {
    return Shape(batch_conic[k], batch_peak[k], batch_slope[k], batch_look[k]);
}

// The pixel of a thread: 32 neighbours are 8 by 4 pixels, which enter and leave a footprint together.
uvec2 pixel_of(uint lane, uvec2 corner) {
    uint eighth = lane >> 5;
    return corner + uvec2((lane & 7u) + 8u * (eighth & 1u), ((lane >> 3) & 3u) + 4u * (eighth >> 1));
}

bool reaches(uint k, uvec2 at) {
    uvec4 reach = batch_reach[k];
    return at.x >= reach.x && at.x < reach.y && at.y >= reach.z && at.y < reach.w;
}

// The object of a splat: they come behind footprints and materials, four to a vector.
uint object_of(uint id) {
    return tables[FOOTPRINT_VECTORS * view.footprints + view.materials + id / 4u][id % 4u];
}
