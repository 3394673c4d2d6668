#version 450
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
// As `radix_scatter`, by subgroups: the multisplit of S. Ashkiani et al. 2016, with whole runs of equal digits written by
// neighbours (D. Merrill and A. Grimshaw 2011).
//
// Subgroups are shared out to eight rows at most; a row takes eight times as many neighbouring keys as it has threads, in steps.
// In a step the ballots of a digit's bits say who has an equal one, and the first of those counts all of them in the row's
// table; subgroups of one row take turns. What was counted before, in this row and in those before it, is a key's place in
// the block. There keys and companions are exchanged, so that neighbours write to neighbours.

#include "blocks.glsl"
#include "layouts.glsl"
#include "subgroup_scan.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SortState state; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint keys[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint places[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint firsts[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint sorted_keys[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint sorted_places[]; };
layout(push_constant) uniform Push { uint shift; } push;

const uint ROWS = 8u;

// How often each row has each digit, then where it goes; then the block in order.
shared uint table[ROWS * 256u];
// Where a digit's first key of the block goes, less its place in the block.
shared uint ahead[256];

uint digit_of(uint key) {
    return (key >> push.shift) & 255u;
}

uint count_of(uvec4 threads) {
    return uint(bitCount(threads.x)) + uint(bitCount(threads.y)) + uint(bitCount(threads.z)) + uint(bitCount(threads.w));
}

// The lowest of them.
uint first_of(uvec4 threads) {
    if (threads.x != 0u) {
        return uint(findLSB(threads.x));
    }
    if (threads.y != 0u) {
        return 32u + uint(findLSB(threads.y));
    }
    return threads.z != 0u ? 64u + uint(findLSB(threads.z)) : 96u + uint(findLSB(threads.w));
}

// Those of a word of a ballot that come before this thread.
uint below_in(uint word) {
    uint lane = gl_SubgroupInvocationID;
    if (lane >= 32u * word + 32u) {
        return 0xffffffffu;
    }
    return lane <= 32u * word ? 0u : (1u << (lane - 32u * word)) - 1u;
}

// The threads of the subgroup with an equal digit.
uvec4 equals_of(uint digit) {
    uvec4 equals = subgroupBallot(true);
    for (uint bit = 0u; bit < 8u; bit++) {
        bool has = ((digit >> bit) & 1u) != 0u;
        uvec4 others = subgroupBallot(has);
        equals &= has ? others : ~others;
    }
    return equals;
}

void main() {
    uint block = block_index();
    if (block >= state.blocks) {
        return;
    }
    uint place = PLACE;
    uint turns = ceil_div(gl_NumSubgroups, ROWS);
    uint row = gl_SubgroupID / turns;
    // Where this row's threads begin, and how many they are: what was just summed is the threads of each subgroup.
    uint row_begin = 0u;
    uint row_threads = 0u;
    for (uint s = 0u; s < gl_NumSubgroups; s++) {
        uint threads = subgroup_sums[s];
        row_begin += s / turns < row ? threads : 0u;
        row_threads += s / turns == row ? threads : 0u;
    }
    for (uint r = 0u; r < ROWS; r++) {
        table[r * 256u + place] = 0u;
    }
    barrier();

    uvec4 below = uvec4(below_in(0u), below_in(1u), below_in(2u), below_in(3u));
    uint begin = block * 2048u + row_begin * 8u + (place - row_begin);
    uint own_keys[8];
    uint to[8];
    for (uint k = 0u; k < 8u; k++) {
        uint i = begin + k * row_threads;
        // Keys beyond the last come last of all, and go nowhere.
        own_keys[k] = i < state.sorted ? keys[i] : 0xffffffffu;
        uint digit = digit_of(own_keys[k]);
        uvec4 equals = equals_of(digit);
        uint rank = count_of(equals & below);
        // Known before the barriers, after which all threads of a subgroup go on together.
        uint leader = first_of(equals);
        uint before = 0u;
        for (uint turn = 0u; turn < turns; turn++) {
            if (rank == 0u && gl_SubgroupID % turns == turn) {
                before = atomicAdd(table[row * 256u + digit], count_of(equals));
            }
            barrier();
        }
        to[k] = subgroupShuffle(before, leader) + rank;
    }

    // This thread's own digit.
    uint count = 0u;
    for (uint r = 0u; r < ROWS; r++) {
        count += table[r * 256u + place];
    }
    uint total;
    uint in_block = scan_workgroup(count, total);
    ahead[place] = firsts[place * state.blocks + block] - in_block;
    for (uint r = 0u; r < ROWS; r++) {
        uint of_row = table[r * 256u + place];
        table[r * 256u + place] = in_block;
        in_block += of_row;
    }
    barrier();
    for (uint k = 0u; k < 8u; k++) {
        to[k] += table[row * 256u + digit_of(own_keys[k])];
    }
    barrier();

    uint here = min(state.sorted - block * 2048u, 2048u);
    for (uint k = 0u; k < 8u; k++) {
        table[to[k]] = own_keys[k];
    }
    barrier();
    uint goes[8];
    for (uint k = 0u; k < 8u; k++) {
        uint at = k * 256u + place;
        uint key = table[at];
        goes[k] = ahead[digit_of(key)] + at;
        if (at < here) {
            sorted_keys[goes[k]] = key;
        }
    }
    barrier();
    for (uint k = 0u; k < 8u; k++) {
        uint i = begin + k * row_threads;
        table[to[k]] = i < state.sorted ? places[i] : 0u;
    }
    barrier();
    for (uint k = 0u; k < 8u; k++) {
        uint at = k * 256u + place;
        if (at < here) {
            sorted_places[goes[k]] = table[at];
        }
    }
}
