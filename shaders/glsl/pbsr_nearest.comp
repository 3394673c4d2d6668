#version 450
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
// STEP 2 of PBSR in one go, where a device takes the least of 64 bits: of each pixel the nearest depth and, below it, the
// lowest rank of those at that depth; what `pbsr_project` and `pbsr_rank` find in two.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { ParticleObject objects[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint sets[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint particles[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint64_t keys[]; };
layout(push_constant) uniform Push { uint level; } push;

#include "footing.glsl"

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= sets[3u * push.level + 1u]) {
        return;
    }
    uint seed = sets[3u * push.level + 2u];
    Footing f = footing_of((sets[3u * push.level] + i) * PARTICLE_WORDS);
    for (uint r = f.rows.x; r < f.rows.y; r++) {
        for (uint c = f.columns.x; c < f.columns.y; c++) {
            if (!covers(f, c, r)) {
                continue;
            }
            uint pixel = place_of(c, r, view.columns);
            atomicMin(keys[pixel], (uint64_t(f.depth) << 32) | uint64_t(rank_of(i, pixel, seed)));
        }
    }
}
