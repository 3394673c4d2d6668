#version 450
// Sums before any set was added: hits, a 64-bit sum of each number that a hit brings, and one of squares a pixel.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) buffer Bound1 { uint sums[]; };

void main() {
    uint pixel = block_index() * 256u + gl_LocalInvocationIndex;
    if (pixel < view.pixels) {
        uint words = 3u + 2u * view.channels;
        for (uint w = 0u; w < words; w++) {
            sums[words * pixel + w] = 0u;
        }
    }
}
