#version 450
// Moves every key and its companion to their digit's place; equal digits keep their order.
//
// A round of 256 neighbours at a time: each thread sets its bit in the word of its digit, and the bits below it are the
// equal digits before it. The order of the atomics does not matter, and no subgroup is needed.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SortState state; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint keys[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint places[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint firsts[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint sorted_keys[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint sorted_places[]; };
layout(push_constant) uniform Push { uint shift; } push;

// Where the next key of each digit goes, and who has it this round: 8 words of 32 threads.
shared uint next[256];
shared uint owners[8 * 256];

uint owners_before(uint digit, uint lane) {
    uint word = lane >> 5;
    uint before = 0u;
    for (uint w = 0u; w < word; w++) {
        before += uint(bitCount(owners[w * 256u + digit]));
    }
    return before + uint(bitCount(owners[word * 256u + digit] & ((1u << (lane & 31u)) - 1u)));
}

void main() {
    uint block = block_index();
    if (block >= state.blocks) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    next[lane] = firsts[lane * state.blocks + block];
    for (uint w = 0u; w < 8u; w++) {
        owners[w * 256u + lane] = 0u;
    }
    barrier();
    for (uint r = 0u; r < 8u; r++) {
        uint i = block * 2048u + r * 256u + lane;
        bool here = i < state.sorted;
        uint key = here ? keys[i] : 0u;
        uint digit = (key >> push.shift) & 255u;
        if (here) {
            atomicOr(owners[(lane >> 5) * 256u + digit], 1u << (lane & 31u));
        }
        barrier();
        if (here) {
            uint to = next[digit] + owners_before(digit, lane);
            sorted_keys[to] = key;
            sorted_places[to] = places[i];
        }
        barrier();
        // This thread's own digit: what the round used up.
        uint used = 0u;
        for (uint w = 0u; w < 8u; w++) {
            used += uint(bitCount(owners[w * 256u + lane]));
            owners[w * 256u + lane] = 0u;
        }
        next[lane] += used;
        barrier();
    }
}
