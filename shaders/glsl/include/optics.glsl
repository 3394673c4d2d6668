// Optical depth and opacity, as `splat_core::raster::lanes` and `kernel` have them, operation by operation. Where a device
// rounds a fused product and sum twice, the last bits differ.

// e^-x for x >= 0: 2^f by its Taylor series, the exponent by integers; 0 below 2^-126.
precise float exp_neg(float x) {
    precise float t = max(x * -1.44269504, -127.0);
    float whole = floor(t + 0.5);
    precise float f = t - whole;
    precise float g = f * f;
    precise float high = (0.009618129 + 0.0013333558 * f) + 0.0001540353 * g;
    precise float p = (1.0 + 0.69314718 * f) + g * ((0.2402265 + 0.05550411 * f) + g * high);
    return t > -126.0 ? uintBitsToFloat(floatBitsToUint(p) + (uint(int(whole)) << 23)) : 0.0;
}

// 1 - e^-x for x >= 0: a polynomial up to 1/2, so that tiny x keep their digits.
precise float opacity_of(float x) {
    if (x < 0.5) {
        precise float low = fma(0.16656198, x, -0.4999943);
        precise float high = fma(0.006804911, x, -0.041039184);
        precise float square = x * x;
        return fma(fma(high, square, low), square, x);
    }
    return 1.0 - exp_neg(x);
}

// Share of a medium's kernel before a plane, `distance` behind its centre in half widths; a footprint's terms of it.
precise float share_before(vec4 low, vec2 high, float distance) {
    precise float t = clamp(distance, -1.0, 1.0);
    precise float before = (1.0 + t) * (1.0 + t);
    precise float behind = (1.0 - t) * (1.0 - t);
    precise float square = t * t;
    precise float tail = low.w + square * (high.x + square * high.y);
    precise float correction = low.x + square * (low.y + square * (low.z + square * tail));
    precise float triweight = 0.5 - t * (0.90625 - t * (0.625 - t * 0.15625));
    precise float share = before * before * (triweight + t * (behind * behind) * correction);
    return share;
}

// The profile at t = max(1 - s, 0). Words of a footprint: the polynomial (8), q, e^-q, whether the polynomial holds.
precise float profile(vec4 low, vec4 high, vec4 sharp, float t) {
    precise float square = t * t;
    if (sharp.z != 0.0) {
        precise float a = fma(low.y, t, low.x);
        precise float b = fma(low.w, t, low.z);
        precise float c = fma(high.y, t, high.x);
        precise float d = fma(high.w, t, high.z);
        precise float sum = fma(fma(d, square, c), square * square, fma(b, square, a));
        return sum * (square * t);
    }
    precise float r = sharp.x * t;
    precise float taper = sharp.y * (1.0 + r + 0.5 * r * r);
    return t > 0.0 ? max(exp_neg(sharp.x - r) - taper, 0.0) : 0.0;
}
