// Absorbances as 64-bit fixed point, 2^44 units an absorbance of 1, as `tsm::table` has them: x holds the lower half. All of
// it is integers, so that every device gives the same bits.

// Sums stop here, below 2^61: none overflows.
const uvec2 FIXED_MOST = uvec2(0xffffffffu, 0x1fffffffu);

bool fixed_less(uvec2 a, uvec2 b) {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

uvec2 fixed_add(uvec2 a, uvec2 b) {
    uint low = a.x + b.x;
    uvec2 sum = uvec2(low, a.y + b.y + uint(low < a.x));
    return fixed_less(sum, FIXED_MOST) ? sum : FIXED_MOST;
}

// Whole units of an absorbance that is not negative, given as the bits of a float.
uvec2 fixed_of(uint bits) {
    // From 2^17 on, and what is no number, it is as much as there is.
    if (bits >= 0x48000000u) {
        return (bits >> 31) != 0u ? uvec2(0u) : FIXED_MOST;
    }
    uint exponent = bits >> 23;
    uint digits = (bits & 0x7fffffu) | (exponent > 0u ? 0x800000u : 0u);
    if (exponent < 106u) {
        uint down = 106u - exponent;
        return uvec2(down < 24u ? digits >> down : 0u, 0u);
    }
    uint up = exponent - 106u;
    if (up >= 32u) {
        return uvec2(0u, digits << (up - 32u));
    }
    return uvec2(digits << up, up == 0u ? 0u : digits >> (32u - up));
}

uint fixed_top(uvec2 a) {
    return a.y != 0u ? 32u + uint(findMSB(a.y)) : uint(findMSB(a.x));
}

// a / 2^down to the nearest whole number, of two the even one; 1 <= down <= 38, and the result is below 2^53.
uvec2 fixed_round(uvec2 a, uint down) {
    uvec2 whole;
    uvec2 rest;
    uvec2 middle;
    if (down >= 32u) {
        uint more = down - 32u;
        whole = uvec2(a.y >> more, 0u);
        rest = uvec2(a.x, a.y & ((1u << more) - 1u));
        middle = more == 0u ? uvec2(0x80000000u, 0u) : uvec2(0u, 1u << (more - 1u));
    } else {
        whole = uvec2((a.x >> down) | (a.y << (32u - down)), a.y >> down);
        rest = uvec2(a.x & ((1u << down) - 1u), 0u);
        middle = uvec2(1u << (down - 1u), 0u);
    }
    bool up = fixed_less(middle, rest) || (middle == rest && (whole.x & 1u) != 0u);
    uint low = whole.x + uint(up);
    return uvec2(low, whole.y + uint(up && low == 0u));
}

// The bits of the nearest float. The CPU goes through a double and rounds twice; so does this.
uint fixed_float(uvec2 a) {
    if (a.x == 0u && a.y == 0u) {
        return 0u;
    }
    uint top = fixed_top(a);
    if (top > 52u) {
        uint down = top - 52u;
        uvec2 whole = fixed_round(a, down);
        a = uvec2(whole.x << down, (whole.y << down) | (whole.x >> (32u - down)));
        top = fixed_top(a);
    }
    uint digits = top > 23u ? fixed_round(a, top - 23u).x : a.x << (23u - top);
    // Digits that were rounded up to 2^24 carry into the exponent.
    return ((top + 83u) << 23) + (digits - 0x800000u);
}
