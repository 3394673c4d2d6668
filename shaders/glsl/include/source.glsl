// What the kernels that make particles share: where the numbers of a chunk stand, and how a particle is put down.

// Words of a chunk: first element, elements, mean (whole, fraction), four numbers of its Poisson draw, first chunk of the
// run that it belongs to, rank of the run. Words of an arrival: count, state of the stream after it.
const uint CHUNK_WORDS = 10u;
const uint ARRIVAL_WORDS = 3u;

const uint SOURCE_PER_CROSSING = 1u;
const uint SOURCE_NORMALS = 2u;
const uint SOURCE_COLORS = 4u;

// The place of a chunk among those of all objects and levels.
uint chunk_place(ParticleSource source, uint level, uint chunk) {
    return level * source.all_chunks + source.first_chunk + chunk;
}

uvec2 set_of(ParticleSource source, uint level) {
    return wide_add(source.first_set, uvec2(level, 0u));
}

// Which element an arrival takes, from the numbers of its block's alias table.
uint slot_of(uvec2 bits, uint slots) {
    return wide_product(bits.y, slots).y;
}

// As `PackedNormal::new`.
uint pack_normal(vec3 n) {
    precise float sum = abs(n.x) + abs(n.y) + abs(n.z);
    if (!(sum > 0.0 && sum <= 3.402823466e38)) {
        return 0u;
    }
    float inverse = quotient(1.0, sum);
    precise vec2 at = n.xy * inverse;
    if (!(n.z >= 0.0)) {
        precise vec2 folded = 1.0 - abs(at.yx);
        at = vec2(
            (floatBitsToUint(at.x) >> 31) != 0u ? -folded.x : folded.x,
            (floatBitsToUint(at.y) >> 31) != 0u ? -folded.y : folded.y);
    }
    precise vec2 steps = (at * 0.5 + 0.5) * 32766.0 + 0.5;
    return HAS_NORMAL | uint(steps.x) | (uint(steps.y) << 15);
}

float color_scale(int exponent) {
    return uintBitsToFloat(uint(136 - exponent) << 23);
}

// A hash of the bits of a place, as `particles::hash_of`.
uint hash_of(vec3 place) {
    uvec3 bits = floatBitsToUint(place);
    return scramble((bits.x * 0x9e3779b1u) ^ (bits.y * 0x85ebca77u) ^ (bits.z * 0xc2b2ae3du));
}

// As `PackedColor::at`.
uint pack_color(vec3 color, vec3 place) {
    vec3 c = vec3(
        color.x > 0.0 ? min(color.x, 65408.0) : 0.0,
        color.y > 0.0 ? min(color.y, 65408.0) : 0.0,
        color.z > 0.0 ? min(color.z, 65408.0) : 0.0);
    float largest = max(max(c.x, c.y), c.z);
    int exponent = max(int(floatBitsToUint(largest) >> 23) - 126, -15);
    precise float most = largest * color_scale(exponent);
    exponent += int(most > 511.0);
    precise float more = (float(hash_of(place) >> 18) + 0.5) * (1.0 / 16384.0);
    precise vec3 steps = c * color_scale(exponent) + more;
    return uint(steps.x) | (uint(steps.y) << 9) | (uint(steps.z) << 18) | (uint(exponent + 15) << 27);
}
