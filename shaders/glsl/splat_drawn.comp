#version 450
// Drawn pixels into planes: what was drawn lies under what the planes hold, or over it back to front. Blocks of 256 pixels.

#include "blocks.glsl"
#include "layouts.glsl"
#include "optics.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint colors[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint sums[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { float planes[]; };
// As drawn: the plane and up to three channels. Then words from a row to the next of colours and of optical depths, whether
// they are halves, and whether the plane's channels are complete.
layout(push_constant) uniform Push {
    uint plane;
    uint red;
    uint green;
    uint blue;
    uint color_words;
    uint sum_words;
    uint halves;
    uint last;
} push;

vec3 color_of(uvec2 at) {
    if (push.halves != 0u) {
        uint word = at.y * push.color_words + 2u * at.x;
        return vec3(unpackHalf2x16(colors[word]), unpackHalf2x16(colors[word + 1u]).x);
    }
    uint word = at.y * push.color_words + 4u * at.x;
    return uintBitsToFloat(uvec3(colors[word], colors[word + 1u], colors[word + 2u]));
}

float sum_of(uvec2 at) {
    if (push.halves != 0u) {
        vec2 pair = unpackHalf2x16(sums[at.y * push.sum_words + at.x / 2u]);
        return (at.x & 1u) == 0u ? pair.x : pair.y;
    }
    return uintBitsToFloat(sums[at.y * push.sum_words + at.x]);
}

void put(uint channel, uint at, uint area, float drawn, float before, float after) {
    if (channel < view.channels) {
        uint to = (view.planes + channel) * area + at;
        float held = view.fresh == 0u ? planes[to] : 0.0;
        planes[to] = before * held + after * drawn;
    }
}

void main() {
    uvec2 size = uvec2(view.size);
    uint area = size.x * size.y;
    uint at = block_index() * 256u + gl_LocalInvocationIndex;
    if (at >= area) {
        return;
    }
    uvec2 pixel = uvec2(at % size.x, at / size.x);
    uint to = push.plane * area + at;
    float held = view.fresh == 0u ? planes[to] : 0.0;
    float sum = sum_of(pixel);
    bool front = view.back_to_front == 0u;
    // What comes through what is nearer.
    float through = exp_neg(front ? held : sum);
    float before = front ? 1.0 : through;
    float after = front ? through : 1.0;
    vec3 drawn = color_of(pixel);
    put(push.red, at, area, drawn.r, before, after);
    put(push.green, at, area, drawn.g, before, after);
    put(push.blue, at, area, drawn.b, before, after);
    if (push.last != 0u) {
        planes[to] = held + sum;
    }
}
