#version 450
// An entry in each cell that a footprint overlaps: the cell, for discs behind all cells of media, the distance, and
// A = K g f/(W d^2) for the fraction f of the footprint in a cell of measure W (`tsm::media`). One thread a footprint.

#include "blocks.glsl"
#include "layouts.glsl"
#include "exact.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { CastView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { vec4 footprints[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { float opaque_distances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float directions[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint places[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint cells[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { float distances[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { float absorbances[]; };
layout(push_constant) uniform Push { uint room; } push;

#include "directions.glsl"
#include "rays.glsl"
#include "footprint.glsl"

precise float inverse_measure(int column, int row) {
    if (view.mapping == OCTAHEDRAL) {
        return view.inverse_measure;
    }
    precise float square = view.cell * view.cell;
    precise float area = quotient(1.0, square);
    if (view.mapping == PARALLEL) {
        return area;
    }
    precise float x = view.least.x + (float(column) + 0.5) * view.cell;
    precise float y = view.least.y + (float(row) + 0.5) * view.cell;
    precise float stretch = 1.0 + (x * x + y * y);
    precise float measure = area * stretch * root(stretch);
    return measure;
}

void put(uint at, uint cell, float distance, float own, vec3 color) {
    cells[at] = cell;
    distances[at] = distance;
    for (uint c = 0u; c < view.channels; c++) {
        precise float absorbance = own * color[c];
        absorbances[at * view.channels + c] = absorbance;
    }
}

void main() {
    uint caster = block_index() * 256u + gl_LocalInvocationIndex;
    if (caster >= view.casters) {
        return;
    }
    Footprint f = footprint_of(caster);
    uint behind = is_disc(f) ? view.size.x * view.size.y : 0u;
    uint at = view.given + places[caster];
    Axis rows = axis_of(f.at.y, f.half_widths.y);
    Axis columns = axis_of(f.at.x, f.half_widths.x);
    float before = below(rows, edge_of(rows, 0));
    for (int j = 0; j <= rows.last - rows.first; j++) {
        float after = below(rows, edge_of(rows, j + 1));
        precise float height = after - before;
        before = after;
        columns_in(columns, f, rows, j, height);
        float left = below(columns, edge_of(columns, 0));
        for (int k = 0; k <= columns.last - columns.first; k++) {
            float right = below(columns, edge_of(columns, k + 1));
            precise float share = right - left;
            left = right;
            int column = columns.first + k;
            int row = rows.first + j;
            uint cell = cell_within(column, row);
            float distance = cell == NOWHERE ? 0.0 : distance_in(f, cell);
            if (cell == NOWHERE || !is_open(cell, distance)) {
                continue;
            }
            precise float own = f.total * (share * height) * inverse_measure(column, row);
            if (at < push.room) {
                put(at, cell + behind, distance, own, f.color);
            }
            at++;
        }
    }
}
