// The body of `scan_spine`: the blocks' sums by one workgroup, and the total. `PLACE` says which number a thread has.

layout(set = 0, binding = 0, std430) buffer Bound0 { Scan scan; };
layout(set = 0, binding = 1, std430) buffer Bound1 { uint sums[]; };

void main() {
    uint place = PLACE;
    uint blocks = ceil_div(scan.count, 1024u);
    uint before = 0u;
    for (uint begin = 0u; begin < blocks; begin += 256u) {
        uint at = begin + place;
        uint total;
        uint within = scan_workgroup(at < blocks ? sums[at] : 0u, total);
        if (at < blocks) {
            sums[at] = before + within;
        }
        before += total;
    }
    if (place == 0u) {
        scan.total = before;
    }
}
