// How a kernel that makes particles puts one down. Bound before: `source`, `tables`, `counts` (scanned), `particles`.

// The rank of a chunk's first particle in its run, whose particles are numbered through; and the hash of that run.
struct Numbering {
    uint first;
    uvec2 key;
};

Numbering numbering_of(uint level, uint chunk) {
    uint word = chunk * CHUNK_WORDS;
    uint run_begin = counts[chunk_place(source, level, tables[word + 8u])];
    uint first = counts[chunk_place(source, level, chunk)] - run_begin;
    return Numbering(first, rng_bits(source.thinning, set_of(source, level), tables[word + 9u]));
}

// As `bins::thinning`.
float thinning_of(Numbering numbering, uint rank) {
    uvec2 step = wide_multiply(GOLDEN, uvec2(numbering.first + rank, 0u));
    return unit_of_23(wide_scramble(wide_add(numbering.key, step)).y >> 9);
}

// Particle `rank` of a chunk of which the first has the place `first`; beyond the room nothing is written.
void put(uint first, uint rank, Numbering numbering, vec3 p, uint normal, vec3 color) {
    uint place = first + rank;
    if (place >= uint(particles.length()) / PARTICLE_WORDS) {
        return;
    }
    uint word = place * PARTICLE_WORDS;
    particles[word] = floatBitsToUint(p.x);
    particles[word + 1u] = floatBitsToUint(p.y);
    particles[word + 2u] = floatBitsToUint(p.z);
    particles[word + 3u] = normal;
    particles[word + 4u] = pack_color(color, p);
    particles[word + 5u] = floatBitsToUint(thinning_of(numbering, rank));
    particles[word + 6u] = source.object;
}
