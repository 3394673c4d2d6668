#version 450
// An entry (tile, splat) for each tile that a splat reaches, in the order of splats. A workgroup writes the entries of 256
// neighbours of the order together, entry by entry: one that covers the image does not keep a single thread busy.

#include "blocks.glsl"
#include "layouts.glsl"
#include "splats.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint order[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint splats[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint places[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { Scan scan; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { SortState sort; };
layout(set = 0, binding = 6, std430) buffer Bound6 { uint tiles[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { uint ids[]; };

// First entry, id, first tile and tiles across of each splat of the block.
shared uint firsts[256];
shared uint block_ids[256];
shared uint corners[256];
shared uint across[256];

void main() {
    uint block = block_index();
    // Without entries that fit there is nothing to write.
    if (sort.sorted == 0u || block >= ceil_div(view.ordered, 256u)) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    uint begin = block * 256u;
    uint next = begin + 256u;
    uint end = next < view.ordered ? places[next] : scan.total;
    firsts[lane] = end;
    if (begin + lane < view.ordered) {
        uint id = order[begin + lane];
        uint at = id * view.splat_words;
        vec2 center = vec2(uintBitsToFloat(splats[at]), uintBitsToFloat(splats[at + 1u]));
        uvec4 rectangle = tiles_of(bounds_of(center, splats[at + SPLAT_EXTENTS], view.size));
        firsts[lane] = places[begin + lane];
        block_ids[lane] = id;
        corners[lane] = rectangle.y * view.columns + rectangle.x;
        across[lane] = max(rectangle.z, 1u);
    }
    barrier();
    for (uint entry = places[begin] + lane; entry < end; entry += 256u) {
        // The last splat that begins here or before: those without a tile begin where the next does.
        uint k = 0u;
        for (uint reach = 128u; reach > 0u; reach >>= 1) {
            k += firsts[k + reach] <= entry ? reach : 0u;
        }
        uint local = entry - firsts[k];
        uint row = local / across[k];
        tiles[entry] = corners[k] + row * view.columns + (local - row * across[k]);
        ids[entry] = block_ids[k];
    }
}
