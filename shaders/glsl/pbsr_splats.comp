#version 450
// Particles of splats; as `pbsr::splats`. A workgroup takes a chunk of a set; arrival j draws the numbers 2j + 1 and 2j + 2 after
// those of the count. A uniform point of the ball or disc, found by rejection, is moved along its radius by a table.

#include "blocks.glsl"
#include "layouts.glsl"
#include "rng.glsl"
#include "exact.glsl"
#include "particles.glsl"
#include "source.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleSource source; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint tables[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint splats[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float kernels[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint arrivals[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uint counts[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { uint particles[]; };

#include "put.glsl"

// Bit of a splat's kernel, where it fills a disc.
const uint DISC = 1u << 31;
// As `pbsr::radial`: the exponent of 2^-24, cells of an octave, cells of a kernel.
const uint LOWEST = 103u << 23;
const uint BELOW = 19u;
const uint CELLS = 385u;
const uint TRIES = 64u;

vec3 splat_vector(uint word) {
    return vec3(uintBitsToFloat(splats[word]), uintBitsToFloat(splats[word + 1u]), uintBitsToFloat(splats[word + 2u]));
}

// A uniform point of the unit ball, or disc, and its square; the centre where none is found.
vec4 uniform_point(uvec2 bits, bool disc) {
    for (uint k = 0u; k < TRIES; k++) {
        uvec2 number = bits;
        if (k > 0u) {
            number = stream_bits(bits, k);
        }
        vec3 p = vec3(pair_of(number), 0.5);
        if (!disc) {
            p = triple_of(number);
        }
        p = 2.0 * p - 1.0;
        precise float square = p.x * p.x + p.y * p.y + p.z * p.z;
        if (square < 1.0) {
            return vec4(p, square);
        }
    }
    return vec4(0.0);
}

// As `Radial::stretch`.
float stretch(uint kernel, float square) {
    precise float t = 1.0 - square;
    uint bits = floatBitsToUint(t) - LOWEST;
    uint cell = 4u * (CELLS * kernel + (bits >> BELOW));
    precise float x = float(bits & ((1u << BELOW) - 1u)) * (1.0 / 524288.0);
    precise float h = ((kernels[cell + 3u] * x + kernels[cell + 2u]) * x + kernels[cell + 1u]) * x + kernels[cell];
    return h;
}

vec3 place_of(uint splat, uvec2 bits) {
    uint kernel = splats[splat + 4u];
    vec3 centre = splat_vector(splat);
    bool disc = (kernel & DISC) != 0u;
    vec4 point = uniform_point(bits, disc);
    float h = stretch(kernel & ~DISC, point.w);
    if (disc) {
        precise vec3 p = centre + (splat_vector(splat + 8u) * point.x + splat_vector(splat + 11u) * point.y) * h;
        return p;
    }
    precise vec3 p = centre + point.xyz * h * uintBitsToFloat(splats[splat + 8u]);
    return p;
}

void main() {
    uint block = block_index();
    if (block >= source.chunks * source.levels) {
        return;
    }
    uint level = block / source.chunks;
    uint chunk = block % source.chunks;
    uint at = chunk_place(source, level, chunk);
    uint count = arrivals[ARRIVAL_WORDS * at];
    uvec2 state = uvec2(arrivals[ARRIVAL_WORDS * at + 1u], arrivals[ARRIVAL_WORDS * at + 2u]);
    uint first_element = tables[chunk * CHUNK_WORDS];
    uint elements = tables[chunk * CHUNK_WORDS + 1u];
    Numbering numbering = numbering_of(level, chunk);
    for (uint j = gl_LocalInvocationIndex; j < count; j += 256u) {
        uvec2 bits = stream_bits(state, 2u * j + 1u);
        uint slot = slot_of(bits, elements);
        uint word = source.slots_at + 2u * (first_element + slot);
        uint splat = source.vertex_words * (first_element + (bits.x < tables[word] ? slot : tables[word + 1u]));
        vec3 p = place_of(splat, stream_bits(state, 2u * j + 2u));
        put(counts[at], j, numbering, p, splats[splat + 3u], splat_vector(splat + 5u));
    }
}
