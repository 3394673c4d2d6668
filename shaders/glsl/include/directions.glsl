// Tables of directions, as `tsm::mapping` has them; `view` and `directions` are bound before.

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

// A ray of light through the table.
struct Ray {
    vec3 base;
    vec3 direction;
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

Place octahedral_place(vec3 p) {
    precise float distance = root(product(p, p));
    vec3 d = vec3(quotient(abs(p.x), distance), quotient(abs(p.y), distance), quotient(abs(p.z), distance));
    precise float sin_square = d.x * d.x + d.y * d.y;
    precise float below = 1.0 + d.z;
    precise float r = root(quotient(sin_square, below));
    precise float share = quadrant_share(d.x, d.y);
    precise float x = r * (1.0 - share);
    precise float y = r * share;
    precise float folded_x = 1.0 - y;
    precise float folded_y = 1.0 - x;
    bool lower = p.z < 0.0;
    precise float side = 0.5 * float(view.size.x);
    precise float column = side + side * with_sign(lower ? folded_x : x, p.x);
    precise float row = side + side * with_sign(lower ? folded_y : y, p.y);
    return Place(vec2(column, row), distance, distance > 0.0);
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

// One of the mirrored halves of an octahedral table: where in the quarter that is kept, and the sign.
int mirrored(uint i, uint n, out float sign_of) {
    bool kept = 2u * i + 1u >= n;
    sign_of = kept ? 1.0 : -1.0;
    return kept ? int(i) - int(n / 2u) : int((n - 1u) / 2u) - int(i);
}

// The ray through the centre of a cell.
Ray ray_of(uint cell) {
    uint column = cell % view.size.x;
    uint row = cell / view.size.x;
    if (view.mapping == OCTAHEDRAL) {
        float sign_x;
        float sign_y;
        int i = mirrored(column, view.size.x, sign_x);
        int j = mirrored(row, view.size.x, sign_y);
        uint at = 3u * uint(j * int((view.size.x + 1u) / 2u) + i);
        return Ray(vec3(0.0), vec3(directions[at] * sign_x, directions[at + 1u] * sign_y, directions[at + 2u]));
    }
    precise float x = view.least.x + (float(column) + 0.5) * view.cell;
    precise float y = view.least.y + (float(row) + 0.5) * view.cell;
    if (view.mapping == PARALLEL) {
        return Ray(vec3(x, y, 0.0), vec3(0.0, 0.0, 1.0));
    }
    precise float inverse = quotient(1.0, root(product(vec3(x, y, 1.0), vec3(x, y, 1.0))));
    precise vec3 direction = vec3(x, y, 1.0) * inverse;
    return Ray(vec3(0.0), direction);
}
