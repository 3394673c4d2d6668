#version 450
// Where each tile's entries begin among the sorted ones; one more number says where the last ends.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { SortState sort; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint tiles[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint starts[]; };

void main() {
    uint tile = block_index() * 256u + gl_LocalInvocationIndex;
    if (tile > view.tiles) {
        return;
    }
    // By halves: few tiles, and nothing to clear for those without an entry.
    uint low = 0u;
    uint high = sort.sorted;
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        if (tiles[middle] < tile) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    starts[tile] = low;
}
