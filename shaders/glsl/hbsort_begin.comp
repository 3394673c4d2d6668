#version 450
// The state of a sort before any splat was looked at.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SortView view; };
layout(set = 0, binding = 1, std430) buffer Bound1 { SortState state; };
layout(set = 0, binding = 2, std430) buffer Bound2 { Scan blocks; };

void main() {
    if (gl_LocalInvocationIndex == 0u && block_index() == 0u) {
        state.kept = 0u;
        state.sorted = 0u;
        state.blocks = 0u;
        state.near_key = 0xffffffffu;
        state.far_key = 0u;
        state.radius_key = 0xffffffffu;
        blocks.count = ceil_div(view.splats, 1024u);
        blocks.total = 0u;
    }
}
