#version 450
// Of each block of 1024 sorted entries: whether a cell begins in it, how many knots it has (the last entries at their
// distance), and the absorbance since the last beginning of a cell.

#include "blocks.glsl"
#include "layouts.glsl"
#include "scan.glsl"
#include "fixed.glsl"
#include "lists.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ListView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint distances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint absorbances[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint states[]; };

#include "knots.glsl"

void main() {
    uint block = block_index();
    if (block >= ceil_div(view.entries, 1024u)) {
        return;
    }
    uint begin = block * 1024u + gl_LocalInvocationIndex * 4u;
    uint end = min(begin + 4u, view.entries);
    bool begins = false;
    uint knots = 0u;
    for (uint i = begin; i < end; i++) {
        begins = begins || begins_cell(i);
        knots += uint(ends_distance(i));
    }
    uint all_knots;
    scan_workgroup(knots, all_knots);
    uint words = block_words(view.channels);
    for (uint c = 0u; c < view.channels; c++) {
        uvec2 sum = uvec2(0u);
        for (uint i = begin; i < end; i++) {
            sum = fixed_add(begins_cell(i) ? uvec2(0u) : sum, fixed_of(absorbances[i * view.channels + c]));
        }
        uvec2 last;
        scan_runs(begins, sum, uvec2(0u), last);
        if (gl_LocalInvocationIndex == 0u) {
            states[block * words + 2u + 2u * c] = last.x;
            states[block * words + 3u + 2u * c] = last.y;
            states[block * words] = run_begins[255];
            states[block * words + 1u] = all_knots;
        }
    }
}
