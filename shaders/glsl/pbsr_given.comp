#version 450
// Puts the particles that the processor sampled down among those that are made here. A workgroup takes a part of a set.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"

// As `pbsr_given_count`; the counts are scanned.
layout(set = 0, binding = 0, std430) readonly buffer Bound0 { uint spans[]; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint given[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint counts[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint particles[]; };
layout(push_constant) uniform Push { uint number; } push;

void main() {
    uint block = block_index();
    if (block >= push.number) {
        return;
    }
    uint first = counts[spans[3u * block]];
    uint from = PARTICLE_WORDS * spans[3u * block + 1u];
    uint room = uint(particles.length()) / PARTICLE_WORDS;
    uint count = min(spans[3u * block + 2u], room - min(first, room));
    // Neighbours take neighbouring words.
    for (uint w = gl_LocalInvocationIndex; w < PARTICLE_WORDS * count; w += 256u) {
        particles[PARTICLE_WORDS * first + w] = given[from + w];
    }
}
