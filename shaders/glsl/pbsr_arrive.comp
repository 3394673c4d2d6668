#version 450
// STEP 1 of PBSR (Tanaka 2012, section 3) on a device: how many arrivals each chunk of each set has, from its own numbers; as
// `pbsr::blocks`. Where each arrival becomes a particle, these are the counts.

#include "blocks.glsl"
#include "layouts.glsl"
#include "rng.glsl"
#include "exact.glsl"
#include "particles.glsl"
#include "source.glsl"
#include "poisson.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleSource source; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint tables[]; };
layout(set = 0, binding = 2, std430) buffer Bound2 { uint arrivals[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint counts[]; };

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= source.chunks * source.levels) {
        return;
    }
    uint level = i / source.chunks;
    uint chunk = i % source.chunks;
    uint word = chunk * CHUNK_WORDS;
    Mean mean = Mean(
        tables[word + 2u], uintBitsToFloat(tables[word + 3u]), uintBitsToFloat(tables[word + 4u]),
        uintBitsToFloat(tables[word + 5u]), uintBitsToFloat(tables[word + 6u]), uintBitsToFloat(tables[word + 7u]));
    uvec2 state = rng_bits(source.key, set_of(source, level), chunk);
    Drawn drawn = poisson(mean, state);
    state = wide_add(state, wide_multiply(GOLDEN, uvec2(drawn.numbers, 0u)));
    uint at = chunk_place(source, level, chunk);
    arrivals[ARRIVAL_WORDS * at] = drawn.count;
    arrivals[ARRIVAL_WORDS * at + 1u] = state.x;
    arrivals[ARRIVAL_WORDS * at + 2u] = state.y;
    counts[at] = drawn.count;
}
