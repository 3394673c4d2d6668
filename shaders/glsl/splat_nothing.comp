#version 450
// The state of a projection before any splat was looked at.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) buffer Bound0 { ProjectState state; };

void main() {
    if (gl_LocalInvocationIndex == 0u && block_index() == 0u) {
        state.visible = 0u;
        state.near = 0u;
    }
}
