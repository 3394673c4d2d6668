// The exclusive scan of one number a thread over a workgroup of 256.

shared uint scan_values[256];

// Every thread of the workgroup calls it; `total` is the sum of all.
uint scan_workgroup(uint value, out uint total) {
    uint lane = gl_LocalInvocationIndex;
    barrier();
    scan_values[lane] = value;
    barrier();
    for (uint reach = 1u; reach < 256u; reach <<= 1) {
        uint other = lane >= reach ? scan_values[lane - reach] : 0u;
        barrier();
        scan_values[lane] += other;
        barrier();
    }
    total = scan_values[255];
    return scan_values[lane] - value;
}
