// Tables of directions, as `tsm::mapping` has them; `view` is bound before.

const uint OCTAHEDRAL = 0u;
const uint PERSPECTIVE = 1u;
const uint PARALLEL = 2u;

// No cell: outside of the table.
const uint NOWHERE = 0xffffffffu;

// Column and row, and the distance.
struct Place {
    vec2 at;
    float distance;
    bool seen;
};

precise float product(vec3 a, vec3 b) {
    precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

float with_sign(float a, float of) {
    return uintBitsToFloat((floatBitsToUint(a) & 0x7fffffffu) | (floatBitsToUint(of) & 0x80000000u));
}

// Azimuth in the first quadrant as a share of a right angle.
precise float quadrant_share(float x, float y) {
    float low = x < y ? x : y;
    float high = x < y ? y : x;
    precise float t = high > 0.0 ? quotient(low, high) : 0.0;
    precise float s = t * t;
    precise float sum = -0.0029028537;
    sum = sum * s + 0.015139148;
    sum = sum * s + -0.037452184;
    sum = sum * s + 0.06282715;
    sum = sum * s + -0.08914771;
    sum = sum * s + 0.12711363;
    sum = sum * s + -0.21219691;
    sum = sum * s + 0.63661975;
    precise float share = t * sum;
    precise float other = 1.0 - share;
    return x < y ? other : share;
}

// A direction in its octant: its absolute components, its distance from the axis there, and its azimuth as a share of a
// right angle.
struct Octant {
    float distance;
    vec3 d;
    float sin_square;
    float r;
    float share;
};

Octant octant_of(vec3 p) {
    precise float distance = root(product(p, p));
    vec3 d = vec3(quotient(abs(p.x), distance), quotient(abs(p.y), distance), quotient(abs(p.z), distance));
    precise float sin_square = d.x * d.x + d.y * d.y;
    precise float below = 1.0 + d.z;
    precise float r = root(quotient(sin_square, below));
    return Octant(distance, d, sin_square, r, quadrant_share(d.x, d.y));
}

Place octahedral_place(vec3 p) {
    Octant o = octant_of(p);
    precise float x = o.r * (1.0 - o.share);
    precise float y = o.r * o.share;
    precise float folded_x = 1.0 - y;
    precise float folded_y = 1.0 - x;
    bool lower = p.z < 0.0;
    precise float side = 0.5 * float(view.size.x);
    precise float column = side + side * with_sign(lower ? folded_x : x, p.x);
    precise float row = side + side * with_sign(lower ? folded_y : y, p.y);
    return Place(vec2(column, row), o.distance, o.distance > 0.0);
}

Place planar_place(vec3 p) {
    bool perspective = view.mapping == PERSPECTIVE;
    precise float distance = perspective ? root(product(p, p)) : p.z;
    precise float x = (perspective ? quotient(p.x, p.z) : p.x) - view.least.x;
    precise float y = (perspective ? quotient(p.y, p.z) : p.y) - view.least.y;
    vec2 at = vec2(quotient(x, view.cell), quotient(y, view.cell));
    vec2 limit = vec2(view.size) + 1.0;
    bool inside = at.x > -1.0 && at.y > -1.0 && at.x < limit.x && at.y < limit.y;
    return Place(at, distance, inside && (!perspective || (p.z > 0.0 && distance > 0.0)));
}

Place place_of(vec3 p) {
    return view.mapping == OCTAHEDRAL ? octahedral_place(p) : planar_place(p);
}

// The cell at a column and row that may lie beyond an edge across which the table continues.
uint cell_at(int column, int row) {
    ivec2 n = ivec2(view.size);
    if (view.mapping == OCTAHEDRAL) {
        if (column < 0 || column >= n.x) {
            column = column < 0 ? -1 - column : 2 * n.x - 1 - column;
            row = n.x - 1 - row;
        }
        if (row < 0 || row >= n.x) {
            row = row < 0 ? -1 - row : 2 * n.x - 1 - row;
            column = n.x - 1 - column;
        }
    }
    bool inside = column >= 0 && row >= 0 && column < n.x && row < n.y;
    return inside ? uint(row) * view.size.x + uint(column) : NOWHERE;
}
