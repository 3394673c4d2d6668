// The body of `scan_apply`: the exclusive scan of the numbers in place. `PLACE` says which numbers a thread has.

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { Scan scan; };
layout(set = 0, binding = 1, std430) buffer Bound1 { uint numbers[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint sums[]; };

void main() {
    uint block = block_index();
    if (block >= ceil_div(scan.count, 1024u)) {
        return;
    }
    uint place = PLACE;
    uint begin = block * 1024u + place * 4u;
    uint end = min(begin + 4u, scan.count);
    uint sum = 0u;
    for (uint k = begin; k < end; k++) {
        sum += numbers[k];
    }
    uint total;
    uint before = sums[block] + scan_workgroup(sum, total);
    for (uint k = begin; k < end; k++) {
        uint number = numbers[k];
        numbers[k] = before;
        before += number;
    }
}
