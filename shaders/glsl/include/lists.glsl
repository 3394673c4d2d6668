// Sorted entries and the running sums along their cells: a scan that begins anew at each cell.

// Words of a block's state: whether a cell begins in it, its knots, and its sum since the last beginning, two a channel.
uint block_words(uint channels) {
    return 2u + 2u * channels;
}

shared uvec2 run_sums[256];
shared uint run_begins[256];

// The sum of the runs of the threads before that still goes on, begun at `before`; `begins` tells whether a cell begins in
// a thread's run, `sum` is its sum since then. Every thread of the workgroup calls it; `last` is what goes on behind.
uvec2 scan_runs(bool begins, uvec2 sum, uvec2 before, out uvec2 last) {
    uint lane = gl_LocalInvocationIndex;
    barrier();
    run_sums[lane] = sum;
    run_begins[lane] = uint(begins);
    barrier();
    for (uint reach = 1u; reach < 256u; reach <<= 1) {
        uvec2 other = uvec2(0u);
        uint began = 0u;
        if (lane >= reach) {
            other = run_begins[lane] != 0u ? uvec2(0u) : run_sums[lane - reach];
            began = run_begins[lane - reach];
        }
        barrier();
        run_sums[lane] = fixed_add(run_sums[lane], other);
        run_begins[lane] |= began;
        barrier();
    }
    last = run_begins[255] != 0u ? run_sums[255] : fixed_add(before, run_sums[255]);
    if (lane == 0u) {
        return before;
    }
    return run_begins[lane - 1u] != 0u ? run_sums[lane - 1u] : fixed_add(before, run_sums[lane - 1u]);
}
