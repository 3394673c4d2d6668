#version 450
// How often each of 256 digits occurs in each block of 2048 keys. Counts lie digit by digit, so that their scan gives
// the place of a block's first key of a digit.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SortState state; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint keys[]; };
layout(set = 0, binding = 2, std430) buffer Bound2 { uint counts[]; };
layout(push_constant) uniform Push { uint shift; } push;

shared uint digit_counts[256];

void main() {
    uint block = block_index();
    if (block >= state.blocks) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    digit_counts[lane] = 0u;
    barrier();
    for (uint r = 0u; r < 8u; r++) {
        uint i = block * 2048u + r * 256u + lane;
        if (i < state.sorted) {
            atomicAdd(digit_counts[(keys[i] >> push.shift) & 255u], 1u);
        }
    }
    barrier();
    counts[lane * state.blocks + block] = digit_counts[lane];
}
