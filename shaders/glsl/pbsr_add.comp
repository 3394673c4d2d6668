#version 450
// STEP 3 of PBSR: the particle that is seen on a pixel adds its hit, its colour in steps of 2^-24, and the square of its
// luminance; as `pbsr::ensemble`. One particle a pixel and set, so nothing is atomic.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { ParticleObject objects[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint sets[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint particles[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint footings[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uint nearest[]; };
layout(set = 0, binding = 6, std430) readonly buffer Bound6 { uint winners[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { uint sums[]; };
layout(push_constant) uniform Push { uint level; } push;

// As `PackedColor::get`.
vec3 unpack_color(uint packed) {
    float scale = uintBitsToFloat(((packed >> 27) + 103u) << 23);
    return vec3(float(packed & 511u), float((packed >> 9) & 511u), float((packed >> 18) & 511u)) * scale;
}

// The whole part of a number that is not negative, low and high word.
uvec2 whole(float v) {
    uint bits = floatBitsToUint(v);
    int shift = int(bits >> 23) - 150;
    uint mantissa = (bits & 0x7fffffu) | 0x800000u;
    if (shift < -23) {
        return uvec2(0u);
    }
    if (shift <= 0) {
        return uvec2(mantissa >> uint(-shift), 0u);
    }
    if (shift < 32) {
        return uvec2(mantissa << uint(shift), shift < 9 ? 0u : mantissa >> uint(32 - shift));
    }
    return uvec2(0u, mantissa << uint(shift - 32));
}

// Nearest multiple of 2^-24, two's complement.
uvec2 fixed_point(float v) {
    precise float steps = abs(v) * 16777216.0 + 0.5;
    uvec2 w = whole(steps);
    return v < 0.0 ? uvec2(~w.x + 1u, ~w.y + uint(w.x == 0u)) : w;
}

void add(uint at, uvec2 v) {
    uint low = sums[at] + v.x;
    sums[at + 1u] += v.y + uint(low < v.x);
    sums[at] = low;
}

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= sets[3u * push.level + 1u]) {
        return;
    }
    uint columns = footings[3u * i];
    uint rows = footings[3u * i + 1u];
    uint depth = footings[3u * i + 2u];
    uint word = (sets[3u * push.level] + i) * PARTICLE_WORDS;
    precise vec3 shown = (unpack_color(particles[word + 4u]) + objects[particles[word + 6u]].emission.xyz) * view.inverse_unit;
    vec3 v = clamp(shown, -65536.0, 65536.0);
    precise float luminance = v.x * 0.2126 + v.y * 0.7152 + v.z * 0.0722;
    precise float square = luminance * luminance * 16777216.0;
    for (uint r = rows & 0xffffu; r < rows >> 16; r++) {
        for (uint c = columns & 0xffffu; c < columns >> 16; c++) {
            uint pixel = place_of(c, r, view.columns);
            if (depth == nearest[pixel] && rank_of(i, pixel, sets[3u * push.level + 2u]) == winners[pixel]) {
                sums[9u * pixel] += 1u;
                add(9u * pixel + 1u, fixed_point(v.x));
                add(9u * pixel + 3u, fixed_point(v.y));
                add(9u * pixel + 5u, fixed_point(v.z));
                add(9u * pixel + 7u, whole(square));
            }
        }
    }
}
