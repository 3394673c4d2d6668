// Random numbers from counters, bit for bit those of `splat_core::rng` and `pbsr::stream`. A number of 64 bits is two words,
// the lower half first: multiplied by halves of 16 bits, which every device and every translator of modules has.

const uvec2 GOLDEN = uvec2(0x7f4a7c15u, 0x9e3779b9u);
const uvec2 ITEM = uvec2(0x2f3d8dd7u, 0x8cb92ba7u);
const uvec2 SAMPLE = uvec2(0xaaaaaaabu, 0xaaaaaaaau);

uvec2 wide_add(uvec2 a, uvec2 b) {
    uint low = a.x + b.x;
    return uvec2(low, a.y + b.y + uint(low < a.x));
}

// The whole product of two words.
uvec2 wide_product(uint a, uint b) {
    uint al = a & 0xffffu;
    uint ah = a >> 16;
    uint bl = b & 0xffffu;
    uint bh = b >> 16;
    uint low = al * bl;
    uint middle = ah * bl + (low >> 16);
    uint other = al * bh + (middle & 0xffffu);
    return uvec2((other << 16) | (low & 0xffffu), ah * bh + (middle >> 16) + (other >> 16));
}

// The product's lower 64 bits.
uvec2 wide_multiply(uvec2 a, uvec2 b) {
    uvec2 product = wide_product(a.x, b.x);
    return uvec2(product.x, product.y + a.x * b.y + a.y * b.x);
}

// z ^ (z >> by), for by of 1 to 31.
uvec2 wide_mix(uvec2 z, uint by) {
    return z ^ uvec2((z.x >> by) | (z.y << (32u - by)), z.y >> by);
}

// The SplitMix64 finalizer.
uvec2 wide_scramble(uvec2 z) {
    z = wide_multiply(wide_mix(z, 30u), uvec2(0x1ce4e5b9u, 0xbf58476du));
    z = wide_multiply(wide_mix(z, 27u), uvec2(0x133111ebu, 0x94d049bbu));
    return wide_mix(z, 31u);
}

// `rng::bits(seed, stage, item, sample)` from the hash of seed and stage.
uvec2 rng_bits(uvec2 hash, uvec2 item, uint sample_of) {
    uvec2 h = wide_scramble(hash ^ wide_multiply(item, ITEM));
    return wide_scramble(h ^ wide_multiply(uvec2(sample_of, 0u), SAMPLE));
}

// Draw k of a stream, k = 1 for the one that comes next.
uvec2 stream_bits(uvec2 state, uint k) {
    return wide_scramble(wide_add(state, wide_multiply(GOLDEN, uvec2(k, 0u))));
}

// Uniform in (0, 1) of 23 bits.
float unit_of_23(uint bits) {
    precise float u = (float(bits) + 0.5) * (1.0 / 8388608.0);
    return u;
}

// As `Stream::pair`.
vec2 pair_of(uvec2 bits) {
    return vec2(unit_of_23(bits.y >> 9), unit_of_23(((bits.x >> 18) | (bits.y << 14)) & 0x7fffffu));
}

// As `Stream::triple`.
vec3 triple_of(uvec2 bits) {
    uvec3 parts = uvec3(bits.y >> 11, (bits.x >> 22) | (bits.y << 10), bits.x >> 1) & 0x1fffffu;
    precise vec3 u = (vec3(parts) + 0.5) * (1.0 / 2097152.0);
    return u;
}
