// Poisson numbers as `Stream::poisson` draws them, from the same numbers: by inversion below a mean of 12, above by
// W. Hörmann's transformed rejection. In 32 bits: a count is another one where the CPU's lies within some 1e-5 of the next.

// What one draw leaves: the count, and how many numbers it took.
struct Drawn {
    uint count;
    uint numbers;
};

// A chunk's mean with what follows from it, prepared in 64 bits.
struct Mean {
    uint whole;
    float fraction;
    // e^-mean where it is below 12, else b, a, v_r and 1/alpha of the rejection.
    float b;
    float a;
    float v_r;
    float inverse_alpha;
};

// The lower half of the digits, (0, 1).
float fraction_of(uvec2 bits) {
    return (float(bits.x >> 12) + 0.5) * (1.0 / 1048576.0);
}

// Uniform in (0, 1], to the digits that a float has.
float unit_of(uvec2 bits) {
    return (float(bits.y) + fraction_of(bits)) * (1.0 / 4294967296.0);
}

Drawn poisson_by_inversion(Mean m, uvec2 state) {
    float mean = float(m.whole) + m.fraction;
    float rest = unit_of(stream_bits(state, 1u));
    float p = m.b;
    uint k = 0u;
    // Where p is lost in the rounding of what is left, there is nothing to be told apart.
    while (rest > p && k < 200u && (p > 1e-9 || float(k) < mean)) {
        rest -= p;
        k++;
        p *= mean / float(k);
    }
    return Drawn(mean > 0.0 ? k : 0u, 1u);
}

// k ln(mean) - mean - ln(k!), without the difference of large numbers.
float log_probability(Mean m, int k) {
    float mean = float(m.whole) + m.fraction;
    if (k < 16) {
        float factorial = 1.0;
        for (int i = 2; i <= k; i++) {
            factorial *= float(i);
        }
        return float(k) * log(mean) - mean - log(factorial);
    }
    float d = float(k - int(m.whole)) - m.fraction;
    float x = d / mean;
    // (1 + x) ln(1 + x) - x
    float h;
    if (abs(x) < 0.25) {
        float power = x * x;
        h = 0.0;
        for (int n = 2; n < 14; n++) {
            h += power / float(n * (n - 1));
            power *= -x;
        }
    } else {
        h = (1.0 + x) * log(1.0 + x) - x;
    }
    float i = 1.0 / float(k);
    float series = i * (1.0 / 12.0 - i * i * (1.0 / 360.0 - i * i / 1260.0));
    return -mean * h - 0.5 * log(6.283185307179586 * float(k)) - series;
}

Drawn poisson_by_rejection(Mean m, uvec2 state) {
    for (uint round = 0u; round < 200u; round++) {
        uvec2 bits = stream_bits(state, 2u * round + 1u);
        float v = unit_of(stream_bits(state, 2u * round + 2u));
        // u - 1/2, and 1/2 - |u - 1/2| by what the integers leave.
        float f = fraction_of(bits);
        bool upper = bits.y >= 0x80000000u;
        float u = (float(int(bits.y ^ 0x80000000u)) + f) * (1.0 / 4294967296.0);
        float us = (upper ? float(~bits.y) + (1.0 - f) : float(bits.y) + f) * (1.0 / 4294967296.0);
        float beyond = floor((2.0 * m.a / us + m.b) * u + (m.fraction + 0.43));
        // Far out in the tail is no number that could be kept.
        int k = int(m.whole) + int(clamp(beyond, -1e9, 1e9));
        if (us >= 0.07 && v <= m.v_r) {
            return Drawn(uint(max(k, 0)), 2u * round + 2u);
        }
        if (k < 0 || (us < 0.013 && v > us)) {
            continue;
        }
        if (log(v * m.inverse_alpha / (m.a / (us * us) + m.b)) <= log_probability(m, k)) {
            return Drawn(uint(k), 2u * round + 2u);
        }
    }
    return Drawn(m.whole, 400u);
}

Drawn poisson(Mean m, uvec2 state) {
    return m.whole < 12u ? poisson_by_inversion(m, state) : poisson_by_rejection(m, state);
}
