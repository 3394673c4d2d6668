#version 450
// How many particles each part of a set has that the processor sampled, among the counts of chunks.

#include "blocks.glsl"

// Three words each: place among the counts, first particle, particles.
layout(set = 0, binding = 0, std430) readonly buffer Bound0 { uint spans[]; };
layout(set = 0, binding = 1, std430) buffer Bound1 { uint counts[]; };
layout(push_constant) uniform Push { uint number; } push;

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i < push.number) {
        counts[spans[3u * i]] = spans[3u * i + 2u];
    }
}
