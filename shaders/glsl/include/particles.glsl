// What the kernels of particles share: records, footings and the order of equals.

// Words of an uploaded particle: position (3 f32), normal, colour, thinning number (f32), object. Words of a set:
// first particle, particles, seed of the order of equals.
const uint PARTICLE_WORDS = 7u;

// Bits of a packed normal.
const uint HAS_NORMAL = 1u << 30;
const uint PER_CROSSING = 1u << 31;

// As `PackedColor::get`.
vec3 unpack_color(uint packed) {
    float scale = uintBitsToFloat(((packed >> 27) + 103u) << 23);
    return vec3(float(packed & 511u), float((packed >> 9) & 511u), float((packed >> 18) & 511u)) * scale;
}

// A permutation of 32 bits.
uint scramble(uint v) {
    v ^= v >> 16;
    v *= 0x21f0aaadu;
    v ^= v >> 15;
    v *= 0x735a2d97u;
    return v ^ (v >> 15);
}

// Its inverse.
uint unscramble(uint v) {
    v ^= (v >> 15) ^ (v >> 30);
    v *= 0x97132227u;
    v ^= (v >> 15) ^ (v >> 30);
    v *= 0x333c4925u;
    return v ^ (v >> 16);
}

// Place of a particle among those of the same depth on a pixel: a permutation of the particles, another one for each
// pixel and set, so that nobody is first by its place in the list.
uint rank_of(uint particle, uint pixel, uint seed) {
    return scramble(particle ^ scramble(pixel ^ scramble(seed)));
}

// The particle of a rank.
uint of_rank(uint rank, uint pixel, uint seed) {
    return unscramble(rank) ^ scramble(pixel ^ scramble(seed));
}

// Where a pixel stands: tiles of 64 by 64 one after the other, as `pbsr::bins::Tiling` has it.
uint place_of(uint x, uint y, uint columns) {
    return ((y >> 6) * columns + (x >> 6)) * 4096u + (y & 63u) * 64u + (x & 63u);
}

// The pixel in a place.
uvec2 pixel_at(uint place, uint columns) {
    uint tile = place >> 12;
    return uvec2((tile % columns) * 64u + (place & 63u), (tile / columns) * 64u + ((place >> 6) & 63u));
}
