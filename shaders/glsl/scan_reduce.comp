#version 450
// The sum of each block of 1024 numbers. First step of a reduce-then-scan, which needs no workgroup to wait for another.

#include "blocks.glsl"
#include "layouts.glsl"
#include "scan.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { Scan scan; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint numbers[]; };
layout(set = 0, binding = 2, std430) buffer Bound2 { uint sums[]; };

void main() {
    uint block = block_index();
    if (block >= ceil_div(scan.count, 1024u)) {
        return;
    }
    uint begin = block * 1024u + gl_LocalInvocationIndex * 4u;
    uint sum = 0u;
    for (uint k = begin; k < min(begin + 4u, scan.count); k++) {
        sum += numbers[k];
    }
    uint total;
    scan_workgroup(sum, total);
    if (gl_LocalInvocationIndex == 0u) {
        sums[block] = total;
    }
}
