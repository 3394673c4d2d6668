// Who is seen, one after the other, so that light is asked for those alone. Bound before: `view`, `found`, `seen`;
// `push` has `first` and `at`; scan.glsl comes before.

// Words of what is found of a part of a level: how many are seen, workgroups for them across, down and deep. Words of one
// that is seen: its pixel, its first word among the particles, its rank there.
const uint FOUND_WORDS = 4u;
const uint SEEN_WORDS = 3u;

shared uint seen_before;

// Every thread of a workgroup calls it. The order of workgroups changes nothing of what each pixel adds.
void list_seen(bool is_seen, uint pixel, uint word, uint rank) {
    uint total;
    uint place = scan_workgroup(uint(is_seen), total);
    if (gl_LocalInvocationIndex == 0u && total > 0u) {
        uint at = FOUND_WORDS * push.at;
        seen_before = atomicAdd(found[at], total);
        atomicMax(found[at + 1u], ceil_div(seen_before + total, 256u));
    }
    barrier();
    if (is_seen) {
        uint to = SEEN_WORDS * (seen_before + place);
        seen[to] = pixel;
        seen[to + 1u] = word;
        seen[to + 2u] = rank;
    }
}
