#version 450
// How many splats are sorted, and the sizes of the dispatches that do it.

#include "blocks.glsl"
#include "layouts.glsl"
#include "cover.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { Scan blocks; };
layout(set = 0, binding = 1, std430) buffer Bound1 { SortState state; };
layout(set = 0, binding = 2, std430) buffer Bound2 { Scan digits; };
layout(push_constant) uniform Push { uint room; } push;

void main() {
    if (gl_LocalInvocationIndex != 0u || block_index() != 0u) {
        return;
    }
    state.kept = blocks.total;
    state.sorted = min(blocks.total, push.room);
    state.blocks = ceil_div(state.sorted, 2048u);
    digits.count = 256u * state.blocks;
    digits.total = 0u;
    uvec2 sort = cover(state.blocks);
    state.sort_groups_x = sort.x;
    state.sort_groups_y = sort.y;
    state.sort_groups_z = 1u;
    uvec2 scan = cover(ceil_div(digits.count, 1024u));
    state.scan_groups_x = scan.x;
    state.scan_groups_y = scan.y;
    state.scan_groups_z = 1u;
}
