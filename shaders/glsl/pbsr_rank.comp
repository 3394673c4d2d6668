#version 450
// Among the particles at a pixel's nearest depth, the one of the lowest rank. What lies at the depth of the surface that
// hides particles is hidden.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint sets[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint limits[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint footings[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint nearest[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint winners[]; };
layout(push_constant) uniform Push { uint level; } push;

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= sets[3u * push.level + 1u]) {
        return;
    }
    uint columns = footings[3u * i];
    uint rows = footings[3u * i + 1u];
    uint depth = footings[3u * i + 2u];
    for (uint r = rows & 0xffffu; r < rows >> 16; r++) {
        for (uint c = columns & 0xffffu; c < columns >> 16; c++) {
            uint pixel = place_of(c, r, view.columns);
            if (depth == nearest[pixel] && depth < limits[pixel]) {
                atomicMin(winners[pixel], rank_of(i, pixel, sets[3u * push.level + 2u]));
            }
        }
    }
}
