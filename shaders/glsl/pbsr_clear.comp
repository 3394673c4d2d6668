#version 450
// The depth buffer before a set is seen: the depth of what hides particles, +infinity where there is nothing.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint limits[]; };
layout(set = 0, binding = 2, std430) buffer Bound2 { uint nearest[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint winners[]; };

void main() {
    uint pixel = block_index() * 256u + gl_LocalInvocationIndex;
    if (pixel < view.pixels) {
        nearest[pixel] = limits[pixel];
        winners[pixel] = 0xffffffffu;
    }
}
