#version 450
// Distances and absorbances of the entries in their order: by cell, then by distance.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ListView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint places[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint distances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint absorbances[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint sorted_distances[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint sorted_absorbances[]; };

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= view.entries) {
        return;
    }
    uint place = places[i];
    sorted_distances[i] = uint(max(int(distances[place]), 0x00800000));
    for (uint c = 0u; c < view.channels; c++) {
        sorted_absorbances[i * view.channels + c] = absorbances[place * view.channels + c];
    }
}
