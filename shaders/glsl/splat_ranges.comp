#version 450
// Where each tile's entries begin among the sorted ones; one more number says where the last ends. And how many the tile has
// that has most.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { SortState sort; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint tiles[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint starts[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { SplatState state; };

// The first entry of this tile or of one behind it. By halves: few tiles, and nothing to clear for those without an entry.
uint first_of(uint tile) {
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
    return low;
}

void main() {
    uint tile = block_index() * 256u + gl_LocalInvocationIndex;
    if (tile > view.tiles) {
        return;
    }
    uint first = first_of(tile);
    starts[tile] = first;
    atomicMax(state.longest, first_of(tile + 1u) - first);
}
