#version 450
// What shading receives of one light, 1 - s (1 - T) for the share s of the shadow that the splat's object takes.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { CastView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { float lights[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { float shares[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { float received[]; };
layout(push_constant) uniform Push { uint light; } push;

void main() {
    uint splat = block_index() * 256u + gl_LocalInvocationIndex;
    if (splat >= view.splats) {
        return;
    }
    float share = shares[min(splat, view.shares - 1u)];
    for (uint c = 0u; c < 3u; c++) {
        float light = lights[splat * view.channels + (view.channels == 1u ? 0u : c)];
        precise float left = 1.0 - share * (1.0 - light);
        received[3u * (push.light * view.splats + splat) + c] = left;
    }
}
