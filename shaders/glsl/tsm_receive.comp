#version 450
// Splats as `tsm_look_up` takes receivers: position in the light's frame and lift, normal and whether it is a surface.

#include "blocks.glsl"
#include "layouts.glsl"
#include "attributes.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { CastView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { float positions[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { float radii[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint looks[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float frames[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { vec4 receivers[]; };

#include "cast.glsl"

void main() {
    uint splat = block_index() * 256u + gl_LocalInvocationIndex;
    if (splat >= view.splats) {
        return;
    }
    precise float lift = radii[2u * splat] * view.unit * view.bias;
    bool surface = looks[splat * LOOK_WORDS + LOOK_TABLES] >> 24 != MEDIUM;
    receivers[2u * splat] = vec4(position_of(splat), lift);
    receivers[2u * splat + 1u] = vec4(turned(frame_at(splat, 0u)), surface ? 1.0 : 0.0);
}
