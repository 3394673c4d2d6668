#version 450
// Lists the particles that are seen on the pixels of a part of the image, where depths and ranks lie in one number. Makes the
// pixels ready for the next set.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"
#include "scan.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint sets[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint limits[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uvec2 keys[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint found[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint seen[]; };
layout(push_constant) uniform Push { uint level; uint first; uint at; } push;

#include "seen.glsl"

void main() {
    uint in_part = block_index() * 256u + gl_LocalInvocationIndex;
    uint pixel = push.first + in_part;
    bool is_seen = false;
    uint word = 0u;
    uint rank = 0u;
    if (in_part < view.at_once && pixel < view.pixels && keys[pixel].y < limits[pixel]) {
        is_seen = true;
        rank = keys[pixel].x;
        uint i = of_rank(rank, pixel, sets[3u * push.level + 2u]);
        word = (sets[3u * push.level] + i) * PARTICLE_WORDS;
        keys[pixel] = uvec2(0u, limits[pixel]);
    }
    list_seen(is_seen, pixel, word, rank);
}
