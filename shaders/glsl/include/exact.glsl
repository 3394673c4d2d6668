// Quotients and roots as the CPU rounds them: a device may be some units off in the last place, but its products and sums
// are exact to half a unit, and so is what they say is left.

// The upper half of a float's digits: by bits, which no compiler takes for a difference that is zero.
float upper(float a) {
    return uintBitsToFloat(floatBitsToUint(a) & 0xfffff000u);
}

// a * b - p without an error, for p the rounded product (T. J. Dekker 1971).
precise float product_rest(float a, float b, float p) {
    float a_high = upper(a);
    precise float a_low = a - a_high;
    float b_high = upper(b);
    precise float b_low = b - b_high;
    return ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low;
}

precise float quotient(float a, float b) {
    precise float q = a / b;
    precise float p = q * b;
    precise float rest = (a - p) - product_rest(q, b, p);
    precise float better = q + rest / b;
    // Not where there is no number to be better.
    return abs(better) <= 3.402823466e38 ? better : q;
}

precise float root(float a) {
    precise float r = sqrt(a);
    precise float p = r * r;
    precise float rest = (a - p) - product_rest(r, r, p);
    precise float better = r + rest / (2.0 * r);
    return abs(better) <= 3.402823466e38 ? better : r;
}
