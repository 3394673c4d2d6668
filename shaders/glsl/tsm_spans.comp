#version 450
// The list of each cell: its first entry, and how many knots it keeps, the last of them where the limit is reached.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ListView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint cells[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint distances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint marks[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uvec2 spans[]; };

// The first entry from `low` on whose cell is not less.
uint first_of(uint cell, uint low) {
    uint high = view.entries;
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        if (cells[middle] < cell) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// The first entry of a cell that has reached the limit; `high` where none has.
uint first_stopped(uint low, uint high) {
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        if ((marks[middle] >> 31) == 0u) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// The first entry of a cell beyond a distance.
uint first_beyond(uint distance, uint low, uint high) {
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        if (distances[middle] <= distance) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

void main() {
    uint cell = block_index() * 256u + gl_LocalInvocationIndex;
    if (cell >= view.cells) {
        return;
    }
    uint begin = first_of(cell, 0u);
    uint end = first_of(cell + 1u, begin);
    uint kept = 0u;
    if (begin < end) {
        uint last = first_stopped(begin, end);
        last = last < end ? first_beyond(distances[last], last, end) : end;
        kept = (marks[last - 1u] & 0x7fffffffu) - (begin > 0u ? marks[begin - 1u] & 0x7fffffffu : 0u);
    }
    spans[cell] = uvec2(begin, kept);
}
