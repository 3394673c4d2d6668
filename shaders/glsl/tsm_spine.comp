#version 450
// What goes on at the beginning of each block: the knots before it, and the absorbance of the cell that it begins in. One
// workgroup takes all blocks.

#include "blocks.glsl"
#include "layouts.glsl"
#include "scan.glsl"
#include "fixed.glsl"
#include "lists.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ListView view; };
layout(set = 0, binding = 1, std430) buffer Bound1 { uint states[]; };

void main() {
    uint blocks = ceil_div(view.entries, 1024u);
    uint words = block_words(view.channels);
    for (uint c = 0u; c < view.channels; c++) {
        uvec2 before = uvec2(0u);
        for (uint begin = 0u; begin < blocks; begin += 256u) {
            uint at = (begin + gl_LocalInvocationIndex) * words;
            bool here = begin + gl_LocalInvocationIndex < blocks;
            uvec2 sum = here ? uvec2(states[at + 2u + 2u * c], states[at + 3u + 2u * c]) : uvec2(0u);
            uvec2 last;
            uvec2 goes_on = scan_runs(here && states[at] != 0u, sum, before, last);
            if (here) {
                states[at + 2u + 2u * c] = goes_on.x;
                states[at + 3u + 2u * c] = goes_on.y;
            }
            before = last;
        }
    }
    uint knots = 0u;
    for (uint begin = 0u; begin < blocks; begin += 256u) {
        uint at = (begin + gl_LocalInvocationIndex) * words;
        bool here = begin + gl_LocalInvocationIndex < blocks;
        uint total;
        uint within = scan_workgroup(here ? states[at + 1u] : 0u, total);
        if (here) {
            states[at + 1u] = knots + within;
        }
        knots += total;
    }
}
