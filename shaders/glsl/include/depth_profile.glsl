// Where along a ray light is absorbed; as `splat_core::DepthProfile`. Bound before: `planes`. What is infinite there is FAR
// here, for not every device keeps infinities.

const uint DEPTH_PLANES = 21u;
const uint NO_OBJECT = 0xffffffffu;

const float FAR = 3.4028235e38;
const float FIRST = 0.0039292794;
const float MEDIAN = 0.6931472;
const float SERIES = 0.5;
const float AGREED = 0.15;
const float MOST_CELLS = 10.0;
const float TELLING = 0.5;

struct Profile {
    float first;
    float median;
    float mean;
    float m2;
    // The last knot: its depth, and the optical depth before it.
    vec2 knot;
    // Of a medium: depth of its first splat, where its cell ends, where the piece that is held back ends.
    vec3 medium;
    // Sums of the piece that is held back, since then, and behind the cell: optical depth, weight, its first two moments.
    vec4 held;
    vec4 now;
    vec4 next;
};

Profile nowhere() {
    return Profile(FAR, FAR, 0.0, 0.0, vec2(-FAR, 0.0), vec3(0.0), vec4(0.0), vec4(0.0), vec4(0.0));
}

vec4 load_sums(uint at, uint area) {
    return uintBitsToFloat(uvec4(planes[at], planes[at + area], planes[at + 2u * area], planes[at + 3u * area]));
}

void store_sums(vec4 sums, uint at, uint area) {
    for (uint k = 0u; k < 4u; k++) {
        planes[at + k * area] = floatBitsToUint(sums[k]);
    }
}

Profile load_depths(uint at, uint area) {
    vec4 found = load_sums(at, area);
    vec4 knots = load_sums(at + 4u * area, area);
    float held_end = uintBitsToFloat(planes[at + 8u * area]);
    vec4 held = load_sums(at + 9u * area, area);
    vec4 now = load_sums(at + 13u * area, area);
    vec4 next = load_sums(at + 17u * area, area);
    return Profile(found.x, found.y, found.z, found.w, knots.xy, vec3(knots.zw, held_end), held, now, next);
}

void store_depths(Profile p, uint at, uint area) {
    store_sums(vec4(p.first, p.median, p.mean, p.m2), at, area);
    store_sums(vec4(p.knot, p.medium.xy), at + 4u * area, area);
    planes[at + 8u * area] = floatBitsToUint(p.medium.z);
    store_sums(p.held, at + 9u * area, area);
    store_sums(p.now, at + 13u * area, area);
    store_sums(p.next, at + 17u * area, area);
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

bool is_open(Profile p) {
    return p.held.x + p.now.x + p.next.x > 0.0;
}

// Sums with a part of optical depth `tau` that is `length` thick around `middle`.
vec4 with_part(vec4 sums, float tau, float narrow, float middle, float length) {
    precise float weight = tau * narrow;
    precise float square = middle * middle + length * length * 0.083333336;
    precise vec4 sum = sums + vec4(tau, weight, weight * middle, weight * square);
    return sum;
}

// Whether weights tell where they lie.
bool tells(vec4 sums) {
    return sums.y > TELLING * sums.x;
}

// Ends the medium so far, whose optical depth is `total`, not behind `limit`.
void close(inout Profile p, float total, float limit) {
    if (!is_open(p)) {
        return;
    }
    float origin = p.medium.x;
    float end = p.medium.y;
    bool pinned = p.held.x > 0.0;
    precise vec4 sums = p.now + p.next + p.held;
    precise float first_half = end - origin;
    precise float least = pinned ? p.knot.x : origin - first_half;
    precise float most = pinned ? end + (end - p.medium.z) : end + 2.0 * first_half;
    precise float begin = least;
    precise float to = end;
    if (tells(sums)) {
        precise float mean = sums.z / sums.y;
        if (pinned) {
            to = origin + (2.0 * mean - (least - origin));
        } else {
            precise float variance = sums.w / sums.y - mean * mean;
            precise float half_length = sqrt(3.0 * max(variance, 0.0));
            begin = origin + (mean - half_length);
            to = origin + (mean + half_length);
        }
    }
    p.knot.x = max(p.knot.x, min(max(begin, least), limit));
    p.held = vec4(0.0);
    p.now = vec4(0.0);
    p.next = vec4(0.0);
    p.medium = vec3(0.0);
    piece(p, vec2(min(min(to, most), limit), total));
}

// Ends the current cell of a medium, and the piece where its sums agree; `total` is the optical depth so far.
void end_cell(inout Profile p, float thickness, float total) {
    float origin = p.medium.x;
    float end = p.medium.y;
    bool pinned = p.held.x > 0.0;
    precise float begin = pinned ? p.medium.z : origin - 0.5 * thickness;
    precise float off = abs(p.now.y - p.now.x);
    precise float allowed = AGREED * p.now.x;
    precise float longest = MOST_CELLS * thickness;
    precise float reached = end - begin;
    if (p.now.x > 0.0 && (off <= allowed || reached >= longest)) {
        if (pinned) {
            precise float behind = p.now.x + p.next.x;
            precise float before = total - behind;
            piece(p, vec2(p.medium.z, max(before, p.knot.y)));
        } else {
            precise float twice = begin;
            if (tells(p.now)) {
                precise float mean = p.now.z / p.now.y;
                twice = origin + (2.0 * mean - (end - origin));
            }
            p.knot.x = max(p.knot.x, min(max(twice, begin), end));
        }
        p.held = p.now;
        p.medium.z = end;
        p.now = vec4(0.0);
    }
    p.now += p.next;
    p.next = vec4(0.0);
    precise float next_end = end + thickness;
    p.medium.y = next_end;
}

// A splat at a depth, so thick, 0 for a surface, and so narrow; the optical depths of all splats without and with it.
void add_depth(inout Profile p, float depth, float thickness, float narrow, vec2 thicknesses) {
    if (thickness <= 0.0) {
        close(p, thicknesses.x, depth);
        piece(p, vec2(depth, thicknesses.x));
        piece(p, vec2(depth, thicknesses.y));
        return;
    }
    precise float begin = depth - 0.5 * thickness;
    precise float gap = p.medium.y + thickness;
    if (is_open(p) && begin >= gap) {
        close(p, thicknesses.x, FAR);
    }
    if (!is_open(p)) {
        precise float end = depth + 0.5 * thickness;
        p.medium = vec3(depth, end, 0.0);
    }
    // The gap was less than a cell.
    if (begin >= p.medium.y) {
        end_cell(p, thickness, thicknesses.x);
    }
    precise float tau = thicknesses.y - thicknesses.x;
    precise float middle = depth - p.medium.x;
    precise float share = clamp((p.medium.y - begin) / thickness, 0.0, 1.0);
    precise float rest = 1.0 - share;
    precise float nearer = middle - 0.5 * rest * thickness;
    precise float farther = middle + 0.5 * share * thickness;
    p.now = with_part(p.now, tau * share, narrow, nearer, share * thickness);
    p.next = with_part(p.next, tau * rest, narrow, farther, rest * thickness);
}
