// The words of a footprint on a table, and how it overlaps cells: `tsm::shares` and `tsm::overlap`, operation by operation.
// `view`, `footprints`, `opaque_distances` and `directions` are bound before.

// Vectors: column, row and half widths; columns from a row to the next, K g/d^2, distance, blue; position and red; unit
// normal, 0 for a medium, and green.

// Where small and large footprints are cut, in half widths, and how the cut grows.
const float CUT_LEAST = 0.83;
const float CUT_MOST = 0.92;
const float CUT_GROWTH = 0.06;

struct Footprint {
    vec2 at;
    vec2 half_widths;
    float slant;
    float total;
    float distance;
    vec3 position;
    vec3 normal;
    vec3 color;
};

Footprint footprint_of(uint caster) {
    uint first = caster * view.footprint_vectors;
    vec4 shape = footprints[first];
    vec4 rest = footprints[first + 1u];
    Footprint f = Footprint(shape.xy, shape.zw, rest.x, rest.y, rest.z, vec3(0.0), vec3(0.0), vec3(1.0));
    if (view.footprint_vectors > 2u) {
        vec4 third = footprints[first + 2u];
        vec4 fourth = footprints[first + 3u];
        f.position = third.xyz;
        f.normal = fourth.xyz;
        f.color = vec3(third.w, fourth.w, rest.w);
    }
    return f;
}

bool is_disc(Footprint f) {
    return f.normal != vec3(0.0);
}

// A cut triweight about `at`, in cells.
struct Axis {
    float at;
    float half_width;
    float inverse;
    float cut;
    float tail;
    float scale;
    int first;
    int last;
};

precise float cumulative(float x) {
    precise float x2 = x * x;
    precise float sum = 0.5 + x * (1.09375 - x2 * (1.09375 - x2 * (0.65625 - 0.15625 * x2)));
    return sum;
}

void move_axis(inout Axis axis, float at) {
    precise float reach = axis.cut * axis.half_width;
    precise float low = at - reach;
    precise float high = at + reach;
    axis.at = at;
    axis.first = int(floor(low));
    axis.last = int(floor(high));
}

Axis axis_of(float at, float half_width) {
    precise float grown = CUT_LEAST + CUT_GROWTH * (half_width - 1.0);
    precise float cut = clamp(grown, CUT_LEAST, CUT_MOST);
    precise float tail = cumulative(-cut);
    precise float rest = 1.0 - 2.0 * tail;
    Axis axis = Axis(at, half_width, quotient(1.0, half_width), cut, tail, quotient(1.0, rest), 0, 0);
    move_axis(axis, at);
    return axis;
}

// Lower edge of cell `k` of it, relative to its centre.
precise float edge_of(Axis axis, int k) {
    precise float edge = (float(axis.first) - axis.at) + float(k);
    return edge;
}

precise float below(Axis axis, float edge) {
    precise float x = clamp(edge * axis.inverse, -1.0, 1.0);
    precise float part = (cumulative(x) - axis.tail) * axis.scale;
    return clamp(part, 0.0, 1.0);
}

precise float moment_below(Axis axis, float edge) {
    precise float x = clamp(edge * axis.inverse, -axis.cut, axis.cut);
    precise float rest = (1.0 - x * x) * (1.0 - x * x);
    precise float moment = -0.13671875 * axis.scale * (rest * rest);
    return moment;
}

precise float centre_of(Axis axis, float edge, float share) {
    precise float next = edge + 1.0;
    precise float moment = moment_below(axis, next) - moment_below(axis, edge);
    precise float divisor = share + 1e-6;
    return clamp(quotient(axis.half_width * moment, divisor), edge, next);
}

// The columns that a footprint covers in a row, given as its share and its place among the rows.
void columns_in(inout Axis columns, Footprint f, Axis rows, int row, float share) {
    if (f.slant != 0.0) {
        precise float middle = f.at.x + f.slant * centre_of(rows, edge_of(rows, row), share);
        move_axis(columns, middle);
    }
}

// The cell at a column and row; footprints that reach beyond the table are not the device's.
uint cell_within(int column, int row) {
    bool inside = column >= 0 && row >= 0 && column < int(view.size.x) && row < int(view.size.y);
    return inside ? uint(row) * view.size.x + uint(column) : NOWHERE;
}

// Distance of an entry: that of a medium, or where the cell's ray meets a disc's plane.
float distance_in(Footprint f, uint cell) {
    if (!is_disc(f)) {
        return f.distance;
    }
    Ray ray = ray_of(cell);
    precise vec3 towards = f.position - ray.base;
    float t = quotient(product(towards, f.normal), product(ray.direction, f.normal));
    float on_plane = t > 0.0 && t <= 3.402823466e38 ? t : f.distance;
    precise float nearest = 0.5 * f.distance;
    // Where the plane comes far nearer than the splat, it is no longer that splat's.
    return view.mapping == PARALLEL || on_plane > nearest ? on_plane : nearest;
}

// Whether no opaque disc hides an entry.
bool is_open(uint cell, float distance) {
    return view.opaque == 0u || opaque_distances[cell] >= distance;
}
