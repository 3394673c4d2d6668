// The place of a thread among the threads of a round that say yes. No subgroups: any width gives the same bits.

shared uint rank_words[8];

// Every thread of the workgroup calls it; `total` is the number that say yes.
uint rank_among(bool yes, out uint total) {
    uint lane = gl_LocalInvocationIndex;
    barrier();
    if (lane < 8u) {
        rank_words[lane] = 0u;
    }
    barrier();
    if (yes) {
        atomicOr(rank_words[lane >> 5], 1u << (lane & 31u));
    }
    barrier();
    uint before = 0u;
    total = 0u;
    for (uint w = 0u; w < 8u; w++) {
        uint count = uint(bitCount(rank_words[w]));
        before += w < (lane >> 5) ? count : 0u;
        total += count;
    }
    return before + uint(bitCount(rank_words[lane >> 5] & ((1u << (lane & 31u)) - 1u)));
}
