// The exclusive scan of one number a thread over a workgroup of 256, by sums of subgroups of any size.
//
// Nothing is taken for granted of which threads a subgroup has, nor that it is full: threads stand in the order of their
// subgroup, then of their place in it, and whoever needs to know that place counts those before it.

#define PLACE place_of_thread()

shared uint subgroup_sums[256];

// Every thread of the workgroup calls it, together; `total` is the sum of all.
uint scan_workgroup(uint value, out uint total) {
    uint before = subgroupExclusiveAdd(value);
    uint sum = subgroupAdd(value);
    bool first = subgroupExclusiveAdd(1u) == 0u;
    barrier();
    if (first) {
        subgroup_sums[gl_SubgroupID] = sum;
    }
    barrier();
    total = 0u;
    for (uint s = 0u; s < gl_NumSubgroups; s++) {
        uint of_subgroup = subgroup_sums[s];
        before += s < gl_SubgroupID ? of_subgroup : 0u;
        total += of_subgroup;
    }
    return before;
}

// 0 to 255, another one for each thread.
uint place_of_thread() {
    uint threads;
    return scan_workgroup(1u, threads);
}
