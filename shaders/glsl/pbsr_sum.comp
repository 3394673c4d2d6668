#version 450
// STEP 3 of PBSR for what was shaded: each particle that is seen adds its hit and the numbers that it brings to its pixel; as
// `pbsr::ensemble`. One particle a pixel and set, so nothing is atomic.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint found[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint seen[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float values[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint sums[]; };
layout(push_constant) uniform Push { uint at; } push;

#include "sums.glsl"

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= found[4u * push.at]) {
        return;
    }
    uint to = sums_at(seen[3u * i]);
    uint from = view.channels * i;
    sums[to] += 1u;
    precise float luminance = 0.0;
    for (uint k = 0u; k < view.light_channels; k += 3u) {
        vec3 v = in_unit(vec3(values[from + k], values[from + k + 1u], values[from + k + 2u]));
        luminance += luminance_of(v);
        for (int c = 0; c < 3; c++) {
            add(to + 1u + 2u * (k + uint(c)), fixed_point(v[c]));
        }
    }
    for (uint k = view.light_channels; k < view.channels; k++) {
        add(to + 1u + 2u * k, fixed_point(values[from + k]));
    }
    add(to + 1u + 2u * view.channels, whole(square_of(luminance)));
}
