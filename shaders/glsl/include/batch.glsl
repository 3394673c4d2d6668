// The splats of a tile in shared memory, batch by batch. Bound before: `view`, `splats`, `tables`.

#include "fragment.glsl"
#include "staged.glsl"

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
    Staged s = staged_of(id);
    batch_ids[k] = id;
    batch_reach[k] = uvec4(s.bounds.x & ~3u, (s.bounds.y + 3u) & ~3u, s.bounds.z & ~3u, (s.bounds.w + 3u) & ~3u);
    batch_conic[k] = vec4(origin_of(corner, s.center), s.conic);
    batch_peak[k] = s.peak;
    batch_slope[k] = s.slope;
    batch_look[k] = s.look;
    return s.material;
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
