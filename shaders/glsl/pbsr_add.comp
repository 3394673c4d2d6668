#version 450
// STEP 3 of PBSR: the particle that is seen on a pixel adds its hit, its colour in steps of 2^-24, and the square of its
// luminance; as `pbsr::ensemble`. One particle a pixel and set, so nothing is atomic.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { ParticleObject objects[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint sets[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint particles[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint footings[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uint nearest[]; };
layout(set = 0, binding = 6, std430) readonly buffer Bound6 { uint winners[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { uint sums[]; };
layout(push_constant) uniform Push { uint level; } push;

#include "sums.glsl"
#include "shown.glsl"

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= sets[3u * push.level + 1u]) {
        return;
    }
    uint columns = footings[3u * i];
    uint rows = footings[3u * i + 1u];
    uint depth = footings[3u * i + 2u];
    uint word = (sets[3u * push.level] + i) * PARTICLE_WORDS;
    Shown hit = shown_by(word);
    for (uint r = rows & 0xffffu; r < rows >> 16; r++) {
        for (uint c = columns & 0xffffu; c < columns >> 16; c++) {
            uint pixel = place_of(c, r, view.columns);
            if (depth == nearest[pixel] && rank_of(i, pixel, sets[3u * push.level + 2u]) == winners[pixel]) {
                add_hit(pixel, hit);
            }
        }
    }
}
