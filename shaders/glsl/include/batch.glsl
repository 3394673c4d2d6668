// The splats of a tile in shared memory, batch by batch, and what a pixel sees of each. Bound before: `view`, `splats`,
// `tables`.

// Splats that are looked at together. Also how often a tile is looked at for being done.
const uint BATCH = 128u;

// Tiles of the processor's twin: offsets are counted from their corners, so that they have its bits.
const uint TWIN_TILE = 32u;

// Vectors of a footprint in the tables.
const uint FOOTPRINT_VECTORS = 3u;

const uint MEDIUM = 0u;

shared uint batch_ids[BATCH];
// Blocks of 4 by 4 pixels that the splat reaches: columns and rows [x0, x1, y0, y1) of pixels.
shared uvec4 batch_reach[BATCH];
// Offset of the twin's corner from the centre, first numbers of the conic; its last, peak, depth of the centre, extent.
shared vec4 batch_shape[BATCH];
shared vec4 batch_peak[BATCH];
// Slope of the depth, 1/extent.
shared vec3 batch_slope[BATCH];
// footprint | kind << 8.
shared uint batch_look[BATCH];

// Puts a splat into the batch, and gives its material.
uint stage(uint k, uint id, uvec2 corner) {
    uint at = id * view.splat_words;
    precise vec2 center = vec2(uintBitsToFloat(splats[at]), uintBitsToFloat(splats[at + 1u]));
    uint look = splats[at + SPLAT_TABLES];
    uvec4 bounds = bounds_of(center, splats[at + SPLAT_EXTENTS], view.size);
    precise vec2 origin = vec2(corner / TWIN_TILE * TWIN_TILE) + 0.5 - center;
    vec4 depth = vec4(0.0, 0.0, 0.0, 1.0);
    if (view.splat_words > SPLAT_DEPTH) {
        depth = uintBitsToFloat(
            uvec4(splats[at + SPLAT_DEPTH], splats[at + 9u], splats[at + 10u], splats[at + 11u]));
    }
    vec3 conic = uintBitsToFloat(uvec3(splats[at + 2u], splats[at + 3u], splats[at + 4u]));
    batch_ids[k] = id;
    batch_reach[k] = uvec4(bounds.x & ~3u, (bounds.y + 3u) & ~3u, bounds.z & ~3u, (bounds.w + 3u) & ~3u);
    batch_shape[k] = vec4(origin, conic.x, conic.y);
    batch_peak[k] = vec4(conic.z, uintBitsToFloat(splats[at + SPLAT_PEAK]), depth.x, depth.w);
    batch_slope[k] = vec3(depth.yz, 1.0 / depth.w);
    batch_look[k] = look >> 16;
    return look & 0xffffu;
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

// Offset of a pixel from the centre of splat k.
precise vec2 offset_of(uint k, uvec2 at) {
    precise vec2 d = batch_shape[k].xy + vec2(at % TWIN_TILE);
    return d;
}

// s at an offset; for a medium in perspective yet to be multiplied by the ray's factor.
precise float distance_sq(uint k, vec2 d) {
    precise float along = batch_shape[k].z * d.x + batch_shape[k].w * d.y;
    precise float across = batch_peak[k].x * d.y * d.y;
    return fma(along, d.x, across);
}

// View depth: the plane of a disc, the centre of a medium.
precise float depth_of(uint k, vec2 d) {
    precise float offset = batch_slope[k].x * d.x + batch_slope[k].y * d.y;
    return batch_peak[k].z + clamp(offset, -batch_peak[k].w, batch_peak[k].w);
}

// Optical depth or weight at s.
precise float amount_of(uint k, float s) {
    uint footprint = FOOTPRINT_VECTORS * (batch_look[k] & 255u);
    float t = max(1.0 - s, 0.0);
    return batch_peak[k].y * profile(
        uintBitsToFloat(tables[footprint]), uintBitsToFloat(tables[footprint + 1u]), uintBitsToFloat(tables[footprint + 2u]), t);
}

// The object of a splat: they come behind footprints and materials, four to a vector.
uint object_of(uint id) {
    return tables[FOOTPRINT_VECTORS * view.footprints + view.materials + id / 4u][id % 4u];
}
