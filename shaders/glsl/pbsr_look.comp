#version 450
// How the particles that are seen look, in the words of a splat; each object is a material. And how much of a shadow they
// take.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"
#include "attributes.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleObject objects[]; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint particles[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint found[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint seen[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { float radii[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint looks[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { float shares[]; };
layout(push_constant) uniform Push { uint at; } push;

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    uint tables = 0u;
    vec3 color = vec3(0.0);
    float radius = 0.0;
    float share = 0.0;
    // Those behind the last of the workgroup are nothing, but no garbage.
    if (i < found[4u * push.at]) {
        uint word = seen[3u * i + 1u];
        uint object = particles[word + 6u];
        ParticleObject o = objects[object];
        tables = object | (uint(o.share.z) << 24);
        color = unpack_color(particles[word + 4u]) * o.emission.w;
        radius = o.share.y;
        share = o.share.w;
    }
    radii[2u * i] = radius;
    radii[2u * i + 1u] = radius;
    looks[LOOK_WORDS * i] = 0u;
    looks[LOOK_WORDS * i + LOOK_TABLES] = tables;
    for (int c = 0; c < 3; c++) {
        looks[LOOK_WORDS * i + LOOK_COLOR + uint(c)] = floatBitsToUint(color[c]);
    }
    shares[i] = share;
}
