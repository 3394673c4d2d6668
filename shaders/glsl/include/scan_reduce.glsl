// The body of `scan_reduce`: the sum of each block of 1024 numbers. `PLACE` says which numbers a thread has.

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { Scan scan; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint numbers[]; };
layout(set = 0, binding = 2, std430) buffer Bound2 { uint sums[]; };

void main() {
    uint block = block_index();
    if (block >= ceil_div(scan.count, 1024u)) {
        return;
    }
    uint place = PLACE;
    uint begin = block * 1024u + place * 4u;
    uint sum = 0u;
    for (uint k = begin; k < min(begin + 4u, scan.count); k++) {
        sum += numbers[k];
    }
    uint total;
    scan_workgroup(sum, total);
    if (place == 0u) {
        sums[block] = total;
    }
}
