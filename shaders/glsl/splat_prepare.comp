#version 450
// How many entries are sorted, and the sizes of the dispatches that do it. Where there is no room for all there are none:
// the caller reads that back.

#include "blocks.glsl"
#include "layouts.glsl"
#include "cover.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatState state; };
layout(set = 0, binding = 1, std430) buffer Bound1 { SortState sort; };
layout(set = 0, binding = 2, std430) buffer Bound2 { Scan digits; };
layout(push_constant) uniform Push { uint room; } push;

void main() {
    if (gl_LocalInvocationIndex != 0u || block_index() != 0u) {
        return;
    }
    bool fits = state.entries_high == 0u && state.entries_low <= push.room;
    uint sorted = fits ? state.entries_low : 0u;
    uint blocks = ceil_div(sorted, 2048u);
    sort.kept = sorted;
    sort.sorted = sorted;
    sort.blocks = blocks;
    sort.near_key = 0u;
    sort.far_key = 0u;
    sort.radius_key = 0u;
    digits.count = 256u * blocks;
    digits.total = 0u;
    uvec2 groups = cover(blocks);
    sort.sort_groups_x = groups.x;
    sort.sort_groups_y = groups.y;
    sort.sort_groups_z = 1u;
    uvec2 scan = cover(ceil_div(256u * blocks, 1024u));
    sort.scan_groups_x = scan.x;
    sort.scan_groups_y = scan.y;
    sort.scan_groups_z = 1u;
}
