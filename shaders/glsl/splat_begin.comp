#version 450
// The state of splatting before any splat was looked at.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) buffer Bound1 { SplatState state; };
layout(set = 0, binding = 2, std430) buffer Bound2 { Scan places; };

void main() {
    if (gl_LocalInvocationIndex == 0u && block_index() == 0u) {
        state.entries_low = 0u;
        state.entries_high = 0u;
        state.splats = 0u;
        state.longest = 0u;
        places.count = view.ordered;
        places.total = 0u;
    }
}
