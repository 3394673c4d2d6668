#version 450
// Depths with ranks before a set is seen, where a device takes the least of 64 bits: the depth of what hides particles above
// no rank at all.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint limits[]; };
layout(set = 0, binding = 2, std430) buffer Bound2 { uvec2 keys[]; };

void main() {
    uint pixel = block_index() * 256u + gl_LocalInvocationIndex;
    if (pixel < view.pixels) {
        keys[pixel] = uvec2(0u, limits[pixel]);
    }
}
