#version 450
// How many tiles each splat of an order reaches, and their sum in 64 bits: what wraps around would look like enough room.
// Blocks of 1024 places.

#include "blocks.glsl"
#include "layouts.glsl"
#include "splats.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint order[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint splats[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint counts[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { SplatState state; };

shared uint block_entries;
shared uint block_splats;

uint count(uint id) {
    uint at = id * view.splat_words;
    if (!(uintBitsToFloat(splats[at + SPLAT_PEAK]) > 0.0)) {
        return 0u;
    }
    vec2 center = vec2(uintBitsToFloat(splats[at]), uintBitsToFloat(splats[at + 1u]));
    uvec4 tiles = tiles_of(bounds_of(center, splats[at + SPLAT_EXTENTS], view.size));
    return tiles.z * tiles.w;
}

void main() {
    uint block = block_index();
    if (block >= ceil_div(view.ordered, 1024u)) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    if (lane == 0u) {
        block_entries = 0u;
        block_splats = 0u;
    }
    barrier();
    uint entries = 0u;
    uint reaching = 0u;
    for (uint r = 0u; r < 4u; r++) {
        uint place = block * 1024u + r * 256u + lane;
        if (place < view.ordered) {
            uint found = count(order[place]);
            counts[place] = found;
            entries += found;
            reaching += uint(found > 0u);
        }
    }
    // At most 2^20 tiles a splat.
    atomicAdd(block_entries, entries);
    atomicAdd(block_splats, reaching);
    barrier();
    if (lane == 0u) {
        uint before = atomicAdd(state.entries_low, block_entries);
        if (before + block_entries < before) {
            atomicAdd(state.entries_high, 1u);
        }
        atomicAdd(state.splats, block_splats);
    }
}
