#version 450
// How many splats are composited: those that a sort on the device has left in the view.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SortState sort; };
layout(set = 0, binding = 1, std430) buffer Bound1 { SplatView view; };

void main() {
    if (gl_LocalInvocationIndex == 0u && block_index() == 0u) {
        view.ordered = sort.sorted;
    }
}
