// Depths as integers, as `hbsort::radix` has them: a smaller depth has a smaller key, and -0 has the key of +0.

const uint CULLED_KEY = 0xffffffffu;

uint key_of(float depth) {
    uint bits = floatBitsToUint(depth);
    bits = bits == 0x80000000u ? 0u : bits;
    return bits ^ ((bits >> 31) != 0u ? 0xffffffffu : 0x80000000u);
}
