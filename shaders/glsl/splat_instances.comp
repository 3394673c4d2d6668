#version 450
// How many splats are drawn: those of the order, or none where there is no room for all; the caller reads that back.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) buffer Bound1 { uint strips[]; };
layout(set = 0, binding = 2, std430) buffer Bound2 { SplatState state; };
layout(push_constant) uniform Push { uint room; } push;

void main() {
    if (gl_LocalInvocationIndex != 0u || block_index() != 0u) {
        return;
    }
    uint drawn = view.ordered <= push.room ? view.ordered : 0u;
    // Corners of a strip, strips, and where both begin.
    strips[0] = 4u;
    strips[1] = drawn;
    strips[2] = 0u;
    strips[3] = 0u;
    state.entries_low = view.ordered;
    state.entries_high = 0u;
    state.splats = drawn;
    state.longest = 0u;
}
