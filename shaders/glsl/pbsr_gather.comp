#version 450
// STEP 3 of PBSR pixel by pixel, where depths and ranks lie in one number: who is seen follows from the rank. Makes the pixel
// ready for the next set.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { ParticleObject objects[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint sets[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint particles[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint limits[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uvec2 keys[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { uint sums[]; };
layout(push_constant) uniform Push { uint level; } push;

#include "sums.glsl"
#include "shown.glsl"

void main() {
    uint pixel = block_index() * 256u + gl_LocalInvocationIndex;
    if (pixel >= view.pixels) {
        return;
    }
    uvec2 key = keys[pixel];
    // What lies at the depth of the surface that hides particles is hidden.
    if (key.y < limits[pixel]) {
        uint i = of_rank(key.x, pixel, sets[3u * push.level + 2u]);
        add_hit(pixel, shown_by((sets[3u * push.level] + i) * PARTICLE_WORDS));
        keys[pixel] = uvec2(0u, limits[pixel]);
    }
}
