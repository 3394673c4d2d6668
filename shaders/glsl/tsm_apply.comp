#version 450
// The running sums along the cells. A mark holds the knots up to and with an entry, and above whether the absorbance there
// has reached the limit in every channel.

#include "blocks.glsl"
#include "layouts.glsl"
#include "scan.glsl"
#include "fixed.glsl"
#include "lists.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ListView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint distances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint absorbances[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint states[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint marks[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { uint totals[]; };

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
    uint state = block * block_words(view.channels);
    knots = states[state + 1u] + scan_workgroup(knots, all_knots);
    // A bit an entry: every channel so far has reached the limit.
    uint stopped = 15u;
    for (uint c = 0u; c < view.channels; c++) {
        uvec2 sum = uvec2(0u);
        for (uint i = begin; i < end; i++) {
            sum = fixed_add(begins_cell(i) ? uvec2(0u) : sum, fixed_of(absorbances[i * view.channels + c]));
        }
        uvec2 before = uvec2(states[state + 2u + 2u * c], states[state + 3u + 2u * c]);
        uvec2 last;
        sum = scan_runs(begins, sum, before, last);
        for (uint i = begin; i < end; i++) {
            sum = fixed_add(begins_cell(i) ? uvec2(0u) : sum, fixed_of(absorbances[i * view.channels + c]));
            totals[i * view.channels + c] = fixed_float(sum);
            stopped &= fixed_less(sum, view.stop) ? ~(1u << (i - begin)) : ~0u;
        }
    }
    for (uint i = begin; i < end; i++) {
        knots += uint(ends_distance(i));
        marks[i] = knots | (((stopped >> (i - begin)) & 1u) << 31);
    }
}
