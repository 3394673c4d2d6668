// What the particle that is seen on a pixel adds; as `pbsr::ensemble`. Bound before: `view`, `objects`, `particles`, `sums`.

// As `PackedColor::get`.
vec3 unpack_color(uint packed) {
    float scale = uintBitsToFloat(((packed >> 27) + 103u) << 23);
    return vec3(float(packed & 511u), float((packed >> 9) & 511u), float((packed >> 18) & 511u)) * scale;
}

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
    precise float steps = abs(v) * 16777216.0 + 0.5;
    uvec2 w = whole(steps);
    return v < 0.0 ? uvec2(~w.x + 1u, ~w.y + uint(w.x == 0u)) : w;
}

void add(uint at, uvec2 v) {
    uint low = sums[at] + v.x;
    sums[at + 1u] += v.y + uint(low < v.x);
    sums[at] = low;
}

// What a particle shows: its colour in the unit of radiance, and the square of its luminance in steps of 2^-24.
struct Shown {
    vec3 color;
    float square;
};

Shown shown_by(uint word) {
    precise vec3 shown = (unpack_color(particles[word + 4u]) + objects[particles[word + 6u]].emission.xyz) * view.inverse_unit;
    vec3 v = clamp(shown, -65536.0, 65536.0);
    precise float luminance = v.x * 0.2126 + v.y * 0.7152 + v.z * 0.0722;
    precise float square = luminance * luminance * 16777216.0;
    return Shown(v, square);
}

void add_hit(uint pixel, Shown hit) {
    sums[9u * pixel] += 1u;
    add(9u * pixel + 1u, fixed_point(hit.color.x));
    add(9u * pixel + 3u, fixed_point(hit.color.y));
    add(9u * pixel + 5u, fixed_point(hit.color.z));
    add(9u * pixel + 7u, whole(hit.square));
}
