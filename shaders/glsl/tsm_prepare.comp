#version 450
// How many entries there are, those that were given before the ones that were counted, and the sizes of what makes lists of
// them. Where there is no room for all there are none: the caller reads that back.

#include "blocks.glsl"
#include "layouts.glsl"
#include "cover.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { CastView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { Scan scan; };
layout(set = 0, binding = 2, std430) buffer Bound2 { ListView list; };
layout(set = 0, binding = 3, std430) buffer Bound3 { SortState sort; };
layout(set = 0, binding = 4, std430) buffer Bound4 { Scan digits; };
layout(set = 0, binding = 5, std430) buffer Bound5 { CastState state; };
layout(push_constant) uniform Push { uint room; } push;

void main() {
    if (gl_LocalInvocationIndex != 0u || block_index() != 0u) {
        return;
    }
    // Their sum does not overflow: the caller has seen to it.
    uint needed = view.given + (view.casters > 0u ? scan.total : 0u);
    uint sorted = needed <= push.room ? needed : 0u;
    uint blocks = ceil_div(sorted, 2048u);
    state.entries = needed;
    list.entries = sorted;
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
    uvec2 down = cover(ceil_div(256u * blocks, 1024u));
    sort.scan_groups_x = down.x;
    sort.scan_groups_y = down.y;
    sort.scan_groups_z = 1u;
}
