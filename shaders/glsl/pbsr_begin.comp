#version 450
// Sums before any set was added: hits, three 64-bit sums and one of squares a pixel, 9 words.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) buffer Bound1 { uint sums[]; };

void main() {
    uint pixel = block_index() * 256u + gl_LocalInvocationIndex;
    if (pixel < view.pixels) {
        for (uint w = 0u; w < 9u; w++) {
            sums[9u * pixel + w] = 0u;
        }
    }
}
