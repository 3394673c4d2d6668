// The rays of cells, as `tsm::mapping` has them, behind `directions.glsl`; `view` and `directions` are bound before.

// A ray of light through the table.
struct Ray {
    vec3 base;
    vec3 direction;
};

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
