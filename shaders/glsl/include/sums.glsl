// Sums of pixels in fixed point; as `pbsr::ensemble`. Bound before: `view`, `sums`.

// The whole part of a number that is not negative, low and high word.
uvec2 whole(float v) {
    uint bits = floatBitsToUint(v);
    int shift = int(bits >> 23) - 150;
    uint mantissa = (bits & 0x7fffffu) | 0x800000u;
    if (shift < -23) {
        return uvec2(0u);
    }
    if (shift <= 0) {
        return uvec2(mantissa >> uint(-shift), 0u);
    }
    if (shift < 32) {
        return uvec2(mantissa << uint(shift), shift < 9 ? 0u : mantissa >> uint(32 - shift));
    }
    return uvec2(0u, mantissa << uint(shift - 32));
}

// Nearest multiple of 2^-24, two's complement.
uvec2 fixed_point(float v) {
    float steps = abs(v) * 16777216.0;
    // From 2^23 on they are whole, and a half would be rounded.
    precise float rounded = steps < 8388608.0 ? steps + 0.5 : steps;
    uvec2 w = whole(rounded);
    return v < 0.0 ? uvec2(~w.x + 1u, ~w.y + uint(w.x == 0u)) : w;
}

void add(uint at, uvec2 v) {
    uint low = sums[at] + v.x;
    sums[at + 1u] += v.y + uint(low < v.x);
    sums[at] = low;
}

// Words of a pixel's sums: hits, two a number that a hit brings, two of squares.
uint sums_at(uint pixel) {
    return (3u + 2u * view.channels) * pixel;
}

// Radiance in its unit, cut where the CPU cuts it.
vec3 in_unit(vec3 radiance) {
    precise vec3 v = radiance * view.inverse_unit;
    return clamp(v, -65536.0, 65536.0);
}

float luminance_of(vec3 v) {
    precise float luminance = v.x * 0.2126 + v.y * 0.7152 + v.z * 0.0722;
    return luminance;
}

// The square of a luminance in steps of 2^-24.
float square_of(float luminance) {
    precise float square = luminance * luminance * 16777216.0;
    return square;
}
