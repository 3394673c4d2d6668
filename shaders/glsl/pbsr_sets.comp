#version 450
// Where the particles of each set begin, and how many there are; none at all where one set or all together have no room, so
// that nothing is drawn of what is incomplete. The seed of the order of equals is that of uploaded sets.

#include "blocks.glsl"
#include "layouts.glsl"
#include "rng.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleSource source; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { Scan scan; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint counts[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint sets[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { ParticlesFound found; };
layout(push_constant) uniform Push { uint room; uint of_set; } push;

const uvec2 EQUALS = uvec2(0x47505500u, 0u);
const uvec2 STAGE = uvec2(0xd192ed03u, 0xd1b54a32u);

shared uint most;

// `rng::bits(set, EQUALS, 0, 0)`, its lower half.
uint seed_of_equals(uvec2 set_number) {
    uvec2 hash = wide_scramble(set_number ^ GOLDEN);
    return rng_bits(wide_scramble(hash ^ wide_multiply(EQUALS, STAGE)), uvec2(0u), 0u).x;
}

uint begin_of(uint level) {
    return level < source.levels ? counts[level * source.all_chunks] : scan.total;
}

void main() {
    // One workgroup has them all.
    if (block_index() != 0u) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    if (lane == 0u) {
        most = 0u;
    }
    barrier();
    for (uint level = lane; level < source.levels; level += 256u) {
        atomicMax(most, begin_of(level + 1u) - begin_of(level));
    }
    barrier();
    bool fits = scan.total <= push.room && most <= push.of_set;
    for (uint level = lane; level < source.levels; level += 256u) {
        sets[3u * level] = begin_of(level);
        sets[3u * level + 1u] = fits ? begin_of(level + 1u) - begin_of(level) : 0u;
        sets[3u * level + 2u] = seed_of_equals(wide_add(source.first_set, uvec2(level, 0u)));
    }
    if (lane == 0u) {
        found.total = scan.total;
        found.most = most;
    }
}
