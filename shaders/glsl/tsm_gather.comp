#version 450
// Cells of the entries in the order of their distances: the keys of the second sort.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ListView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint places[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint cells[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint keys[]; };

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i < view.entries) {
        keys[i] = cells[places[i]];
    }
}
