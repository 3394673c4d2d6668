#version 450
// How many cells each footprint leaves an entry in. One thread a footprint.

#include "blocks.glsl"
#include "layouts.glsl"
#include "exact.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { CastView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { vec4 footprints[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { float opaque_distances[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float directions[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint counts[]; };

#include "directions.glsl"
#include "rays.glsl"
#include "footprint.glsl"

void main() {
    uint caster = block_index() * 256u + gl_LocalInvocationIndex;
    if (caster >= view.casters) {
        return;
    }
    Footprint f = footprint_of(caster);
    Axis rows = axis_of(f.at.y, f.half_widths.y);
    Axis columns = axis_of(f.at.x, f.half_widths.x);
    uint count = 0u;
    float before = below(rows, edge_of(rows, 0));
    for (int j = 0; j <= rows.last - rows.first; j++) {
        float after = below(rows, edge_of(rows, j + 1));
        precise float height = after - before;
        before = after;
        columns_in(columns, f, rows, j, height);
        for (int column = columns.first; column <= columns.last; column++) {
            uint cell = cell_within(column, rows.first + j);
            count += uint(cell != NOWHERE && is_open(cell, distance_in(f, cell)));
        }
    }
    counts[caster] = count;
}
