// How numbers are shared out: a workgroup of 256 threads takes one block, in rounds of 256 neighbours.

layout(local_size_x = 256) in;

// Workgroups run across, then down; those beyond the last block have nothing to do.
uint block_index() {
    return gl_WorkGroupID.x + gl_WorkGroupID.y * gl_NumWorkGroups.x;
}

uint ceil_div(uint a, uint b) {
    return a / b + uint(a % b != 0u);
}
