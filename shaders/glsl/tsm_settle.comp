#version 450
// Knots to their places in the lists: equal distances are one, nothing follows the limit, and what is left of a cell's room
// is zero.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ListView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint distances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint marks[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint totals[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uvec2 spans[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { uint list_distances[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { uint list_totals[]; };

uint knots_before(uint i) {
    return i == 0u ? 0u : marks[i - 1u] & 0x7fffffffu;
}

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= view.entries) {
        return;
    }
    uvec2 span = spans[cells[i]];
    if (i - span.x >= span.y) {
        list_distances[i] = 0u;
        for (uint c = 0u; c < view.channels; c++) {
            list_totals[i * view.channels + c] = 0u;
        }
    }
    uint before = knots_before(i);
    uint rank = before - knots_before(span.x);
    if ((marks[i] & 0x7fffffffu) == before || rank >= span.y) {
        return;
    }
    uint to = span.x + rank;
    list_distances[to] = distances[i];
    for (uint c = 0u; c < view.channels; c++) {
        list_totals[to * view.channels + c] = totals[i * view.channels + c];
    }
}
