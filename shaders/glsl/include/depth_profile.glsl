// Where along a ray light is absorbed; as `splat_core::DepthProfile`. Bound before: `planes`. What is infinite there is FAR
// here, for not every device keeps infinities.

const uint DEPTH_PLANES = 9u;
const uint NO_OBJECT = 0xffffffffu;

const float FAR = 3.4028235e38;
const float FIRST = 0.0039292794;
const float MEDIAN = 0.6931472;
const float SERIES = 0.5;

struct Profile {
    float first;
    float median;
    float mean;
    float m2;
    // The last knot: its depth, and the optical depth before it.
    vec2 knot;
    // Depth of the splats since, half of their thickness (0 where there are none), the optical depth before them.
    vec3 open;
};

Profile nowhere() {
    return Profile(FAR, FAR, 0.0, 0.0, vec2(-FAR, 0.0), vec3(0.0));
}

Profile load_depths(uint at, uint area) {
    float v[DEPTH_PLANES];
    for (uint k = 0u; k < DEPTH_PLANES; k++) {
        v[k] = uintBitsToFloat(planes[at + k * area]);
    }
    return Profile(v[0], v[1], v[2], v[3], vec2(v[4], v[5]), vec3(v[6], v[7], v[8]));
}

void store_depths(Profile p, uint at, uint area) {
    float v[DEPTH_PLANES] =
        float[](p.first, p.median, p.mean, p.m2, p.knot.x, p.knot.y, p.open.x, p.open.y, p.open.z);
    for (uint k = 0u; k < DEPTH_PLANES; k++) {
        planes[at + k * area] = floatBitsToUint(v[k]);
    }
}

// m and v of a growth of optical depth.
vec2 moments(float delta) {
    precise float square = delta * delta;
    if (delta < SERIES) {
        precise float mean = 0.5 - delta * (0.083333336 - square * (0.0013888889 - square / 30240.0));
        precise float variance = 0.083333336 - square * (0.004166667 - square / 6048.0);
        return vec2(mean, variance);
    }
    float fall = opacity_of(delta);
    precise float rest = 1.0 - fall;
    precise float mean = 1.0 / delta - rest / fall;
    precise float variance = 1.0 / square - rest / (fall * fall);
    return vec2(mean, variance);
}

// A piece from the last knot to the knot `end`.
void piece(inout Profile p, vec2 end) {
    float c = p.knot.y;
    float z = p.knot.x;
    // A surface inside a cell of a medium lies before the cell's end.
    vec2 to = vec2(max(end.x, z), end.y);
    p.knot = to;
    precise float delta = to.y - c;
    if (delta <= 0.0) {
        return;
    }
    precise float length = z > -FAR ? to.x - z : 0.0;
    precise float start = to.x - length;
    if (c < FIRST && FIRST <= to.y) {
        precise float at = start + length * clamp((FIRST - c) / delta, 0.0, 1.0);
        p.first = at;
    }
    if (c < MEDIAN && MEDIAN <= to.y) {
        precise float at = start + length * clamp((MEDIAN - c) / delta, 0.0, 1.0);
        p.median = at;
    }
    float share = exp_neg(c) * opacity_of(delta);
    vec2 mv = length > 0.0 ? moments(delta) : vec2(0.0);
    float absorbed = opacity_of(to.y);
    precise float middle = start + length * mv.x;
    precise float step = middle - p.mean;
    p.mean += step * min(share / absorbed, 1.0);
    precise float spread = step * (middle - p.mean) + length * length * mv.y;
    p.m2 += share * spread;
}

// Ends the medium so far, whose optical depth is `total`, not behind `limit`.
void close(inout Profile p, float total, float limit) {
    vec3 open = p.open;
    if (open.y > 0.0) {
        p.open = vec3(0.0);
        piece(p, vec2(min(open.x, limit), 0.5 * (open.z + total)));
        piece(p, vec2(min(open.x + open.y, limit), total));
    }
}

// A splat at a depth and so thick, 0 for a surface; the optical depths of all splats without and with it.
void add_depth(inout Profile p, float depth, float thickness, vec2 thicknesses) {
    if (thickness <= 0.0) {
        close(p, thicknesses.x, depth);
        piece(p, vec2(depth, thicknesses.x));
        piece(p, vec2(depth, thicknesses.y));
        return;
    }
    float half_cell = 0.5 * thickness;
    if (p.open.y > 0.0 && depth <= p.open.x) {
        return;
    }
    if (p.open.y > 0.0 && depth - p.open.x <= p.open.y + half_cell) {
        piece(p, vec2(p.open.x, 0.5 * (p.open.z + thicknesses.x)));
    } else {
        close(p, thicknesses.x, FAR);
        p.knot = vec2(max(depth - half_cell, p.knot.x), thicknesses.x);
    }
    p.open = vec3(depth, half_cell, thicknesses.x);
}
