#version 450
// STEP 2 of PBSR (Tanaka 2012, section 3): particles onto pixels, the nearest depth of each; as `pbsr::project`.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { ParticleObject objects[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint sets[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint particles[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint footings[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint nearest[]; };
layout(push_constant) uniform Push { uint level; } push;

#include "footing.glsl"

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= sets[3u * push.level + 1u]) {
        return;
    }
    Footing f = footing_of((sets[3u * push.level] + i) * PARTICLE_WORDS);
    for (uint r = f.rows.x; r < f.rows.y; r++) {
        for (uint c = f.columns.x; c < f.columns.y; c++) {
            if (covers(f, c, r)) {
                atomicMin(nearest[place_of(c, r, view.columns)], f.depth);
            }
        }
    }
    footings[3u * i] = f.columns.x | (f.columns.y << 16);
    footings[3u * i + 1u] = f.rows.x | (f.rows.y << 16);
    footings[3u * i + 2u] = f.depth;
}
