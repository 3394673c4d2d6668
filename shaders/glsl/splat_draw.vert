#version 450
// A rectangle of pixels for each splat of an order: one strip of four corners. It ends at the borders of pixels, so that
// which pixels it covers is no matter of rounding.

#include "layouts.glsl"
#include "splats.glsl"
#include "optics.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint order[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint splats[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float values[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uvec4 tables[]; };
// The plane whose optical depth is drawn, and up to three channels that it hides; the largest number is none.
layout(push_constant) uniform Push {
    uint plane;
    uint red;
    uint green;
    uint blue;
} push;

layout(location = 0) flat out vec4 shape;
layout(location = 1) flat out vec4 peak;
layout(location = 2) flat out vec4 color;
layout(location = 3) flat out vec2 slope;
layout(location = 4) flat out uint look;

#include "fragment.glsl"
#include "staged.glsl"

float value_of(uint id, uint channel) {
    return channel < view.channels ? values[id * view.channels + channel] : 0.0;
}

void main() {
    // Always front to back.
    uint place = uint(gl_InstanceIndex);
    uint id = order[view.back_to_front == 0u ? place : view.ordered - 1u - place];
    Staged s = staged_of(id);
    shape = vec4(s.center, s.conic);
    peak = s.peak;
    vec3 channels = vec3(value_of(id, push.red), value_of(id, push.green), value_of(id, push.blue));
    color = vec4(channels, extinction_of(s.material)[push.plane]);
    slope = s.slope;
    look = s.look;
    // One that has no image has no pixels either.
    uvec4 bounds = s.peak.y > 0.0 ? s.bounds : uvec4(0u);
    uvec2 corner = uvec2(
        (gl_VertexIndex & 1) == 0 ? bounds.x : bounds.y, (gl_VertexIndex & 2) == 0 ? bounds.z : bounds.w);
    vec2 at = 2.0 * vec2(corner) / view.size - 1.0;
    gl_Position = vec4(at.x, -at.y, 0.5, 1.0);
}
