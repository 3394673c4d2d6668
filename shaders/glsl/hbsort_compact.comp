#version 450
// Moves the kept splats together, in the order of their places. What finds no room is left out; `hbsort_prepare` says
// how many there are.

#include "blocks.glsl"
#include "layouts.glsl"
#include "keys.glsl"
#include "rank.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SortView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint keys[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint block_places[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint kept_keys[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint kept_places[]; };
layout(push_constant) uniform Push { uint room; } push;

void main() {
    uint block = block_index();
    if (block >= ceil_div(view.splats, 1024u)) {
        return;
    }
    uint before = block_places[block];
    for (uint r = 0u; r < 4u; r++) {
        uint i = block * 1024u + r * 256u + gl_LocalInvocationIndex;
        uint key = i < view.splats ? keys[i] : CULLED_KEY;
        uint total;
        uint to = before + rank_among(key != CULLED_KEY, total);
        if (key != CULLED_KEY && to < push.room) {
            kept_keys[to] = key;
            kept_places[to] = i;
        }
        before += total;
    }
}
