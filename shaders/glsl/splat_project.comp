#version 450
// Projection of splats to footprints in the image, as `splat_core::raster::project`, operation by operation; and how many
// reach a pixel.

#include "blocks.glsl"
#include "layouts.glsl"
#include "splats.glsl"
#include "attributes.glsl"
#include "optics.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ProjectView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { float positions[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { float radii[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint looks[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float frames[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { vec4 tables[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { uint splats[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { ProjectState state; };

// Weight of an opaque disc that faces away.
const float FACING_AWAY = 0.00390625;
// Least distance of a centre from the eye as a share of the radius, in perspective.
const float LEAST_DEPTH = 0.03125;
// The filter of what is solid, pixels.
const float CORE_FILTER_PX = 0.03125;
// Vectors of a footprint in the tables.
const uint FOOTPRINT_VECTORS = 3u;
// Half an extent that leaves nothing out.
const float EVERYWHERE = 3.4028235e38;
// Marks a disc that reaches through the eye plane: the sign of its first half extent.
const uint NEAR = 0x8000u;

shared uint block_visible;
shared uint block_near;

struct Splat {
    float radius;
    float cross_section;
    // Material | footprint << 16 | kind << 24.
    uint look;
    // 1/integral of the profile for R = 1.
    float norm;
    // Half the width of the share before a plane, for R = 1, and the terms of that share.
    float half_width;
    vec4 low_terms;
    vec2 high_terms;
    vec3 normal;
    vec3 tangent;
};

struct Center {
    vec3 position;
    // View depth; that of the position keeps a least distance from the eye plane.
    float before;
    float px_per_world;
    // x/z and y/z; 0 for parallel rays.
    float u;
    float v;
    float filter_px;
};

struct Shape {
    vec3 conic;
    // That of a disc without the filter.
    vec3 core;
    float peak;
    vec2 half_extent;
    vec2 slope;
    // Whether it is a disc that reaches through the eye plane.
    bool near;
};

// `precise`: products and sums are rounded one by one, as the CPU does it.
precise vec3 turned(vec3 p) {
    precise float x = view.axis_x.x * p.x + view.axis_y.x * p.y + view.axis_z.x * p.z;
    precise float y = view.axis_x.y * p.x + view.axis_y.y * p.y + view.axis_z.y * p.z;
    precise float z = view.axis_x.z * p.x + view.axis_y.z * p.y + view.axis_z.z * p.z;
    return vec3(x, y, z);
}

precise float dot_of(vec3 a, vec3 b) {
    precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

precise vec3 cross_of(vec3 a, vec3 b) {
    precise float x = a.y * b.z - a.z * b.y;
    precise float y = a.z * b.x - a.x * b.z;
    precise float z = a.x * b.y - a.y * b.x;
    return vec3(x, y, z);
}

Center center_of(vec3 offset, float cutoff, float radius) {
    Center c;
    precise vec3 p = turned(offset) + view.translation.xyz;
    c.before = p.z;
    if (view.orthographic == 0u) {
        precise float least = radius * LEAST_DEPTH;
        p.z = abs(p.z) < least ? (p.z < 0.0 ? 0.0 - least : least) : p.z;
    }
    c.position = p;
    precise float filter_px = cutoff * view.filter_sigma;
    c.filter_px = filter_px;
    c.px_per_world = view.focal;
    c.u = 0.0;
    c.v = 0.0;
    if (view.orthographic == 0u) {
        precise float px_per_world = view.focal / p.z;
        precise float u = p.x / p.z;
        precise float v = p.y / p.z;
        c.px_per_world = px_per_world;
        c.u = u;
        c.v = v;
    }
    return c;
}

// Half the extent of the image of a ball about that of its centre; everything where it reaches the eye plane.
precise float extent_of_ball(float slope, float length_sq, float ratio_sq) {
    if (!(ratio_sq < 1.0)) {
        return EVERYWHERE;
    }
    precise float across = sqrt(ratio_sq * (length_sq - ratio_sq));
    precise float extent = (abs(slope) * ratio_sq + across) / (1.0 - ratio_sq) * view.focal;
    return extent;
}

bool beside(float v, float z, float reach, float radius) {
    precise float distance = abs(v) - abs(z) * reach;
    precise float most = radius * sqrt(1.0 + reach * reach);
    return !(distance < most);
}

// Whether a ball about the centre, or about its mirror image at the eye, reaches into the image.
bool in_view(Center c, float radius) {
    vec2 reach = view.middle / view.focal;
    return !beside(c.position.x, c.position.z, reach.x, radius) && !beside(c.position.y, c.position.z, reach.y, radius);
}

Shape medium(Splat s, Center c) {
    precise float filter_world = c.filter_px / c.px_per_world;
    precise float radius_sq = s.radius * s.radius + filter_world * filter_world;
    precise float reach_sq = c.px_per_world * c.px_per_world * radius_sq;
    precise float scale = 1.0 / reach_sq;
    precise float x_sq = 1.0 + c.u * c.u;
    precise float y_sq = 1.0 + c.v * c.v;
    precise float per_depth = 1.0 / (s.radius * s.half_width);
    precise float distance = c.before * per_depth;
    float front = distance < 1.0 ? share_before(s.low_terms, s.high_terms, distance) : 1.0;
    precise float a = y_sq * scale;
    precise float b = 2.0 * (c.u * c.v * scale);
    precise float d = x_sq * scale;
    precise float whole = s.cross_section * s.norm / radius_sq;
    precise float peak = whole * front;
    vec2 half_extent = vec2(sqrt(reach_sq));
    if (view.orthographic == 0u) {
        precise float ratio_sq = reach_sq / (view.focal * view.focal);
        half_extent = vec2(extent_of_ball(c.u, x_sq, ratio_sq), extent_of_ball(c.v, y_sq, ratio_sq));
        peak = in_view(c, sqrt(radius_sq)) ? peak : 0.0;
    }
    precise float per_front = 1.0 / front;
    return Shape(vec3(a, b, d), vec3(0.0), peak, half_extent, vec2(per_depth, per_front), false);
}

precise vec2 to_image(Center c, vec3 axis) {
    precise float x = (axis.x - c.u * axis.z) * c.px_per_world;
    precise float y = (c.v * axis.z - axis.y) * c.px_per_world;
    return vec2(x, y);
}

// The first semi-axis of a disc in view space.
precise vec3 first_axis(Splat s, vec3 n) {
    vec3 tangent = turned(s.tangent);
    if (max(max(abs(tangent.x), abs(tangent.y)), abs(tangent.z)) > 0.0) {
        return tangent;
    }
    // Across the normal (Duff et al. 2017).
    float side = n.z < 0.0 ? -1.0 : 1.0;
    precise float a = -1.0 / (side + n.z);
    precise float b = n.x * n.y * a;
    precise float x = b * s.radius;
    precise float y = (side + n.y * n.y * a) * s.radius;
    precise float z = (0.0 - n.y) * s.radius;
    return vec3(x, y, z);
}

// Inverse of a disc's image, J J^T, widened by a filter, as a conic.
precise vec3 conic_of(float area_sq, float trace_x, float mixed, float trace_y, float filter_sq) {
    precise float xx = trace_x + filter_sq;
    precise float yy = trace_y + filter_sq;
    precise float inverse = 1.0 / (area_sq + filter_sq * (trace_x + trace_y) + filter_sq * filter_sq);
    precise vec3 conic = vec3(yy * inverse, -2.0 * (mixed * inverse), xx * inverse);
    return conic;
}

Shape disc(Splat s, Center c) {
    vec3 normal = turned(s.normal);
    vec3 axis_u = first_axis(s, normal);
    vec3 across = cross_of(normal, axis_u);
    precise float across_length = sqrt(dot_of(across, across));
    precise float axis_scale = s.radius / across_length;
    precise vec3 axis_v = across * (across_length > 0.0 ? axis_scale : 0.0);
    vec2 ju = to_image(c, axis_u);
    vec2 jv = to_image(c, axis_v);
    precise float filter_sq = c.filter_px * c.filter_px;
    precise float area = ju.x * jv.y - ju.y * jv.x;
    precise float area_sq = area * area;
    precise float trace_x = ju.x * ju.x + jv.x * jv.x;
    precise float trace_y = ju.y * ju.y + jv.y * jv.y;
    precise float xx = trace_x + filter_sq;
    precise float mixed = ju.x * ju.y + jv.x * jv.y;
    precise float yy = trace_y + filter_sq;
    precise float det = area_sq + filter_sq * (trace_x + trace_y) + filter_sq * filter_sq;
    precise float inverse = 1.0 / det;
    precise float radius_sq = sqrt(dot_of(axis_u, axis_u)) * sqrt(dot_of(axis_v, axis_v));
    precise float spread = sqrt(area_sq * inverse);
    precise float peak = s.cross_section * s.norm / radius_sq * spread;
    precise float along = normal.z;
    precise float length_d = 1.0;
    if (view.orthographic == 0u) {
        along = dot_of(normal, vec3(c.u, c.v, 1.0));
        length_d = sqrt(c.u * c.u + c.v * c.v + 1.0);
    }
    uint kind = s.look >> 24;
    // First number behind the footprints: 1 for a slab whose optical depth grows at grazing angles.
    if (kind == SURFACE && tables[FOOTPRINT_VECTORS * view.footprints + (s.look & 0xffffu)].x > 0.0) {
        peak = peak / max(abs(along) / length_d, 1.0e-3);
    }
    // The side of the plane that the eye is on: for a centre behind the eye `along` has the other sign.
    precise float facing = view.orthographic == 0u ? along * c.position.z : along;
    if (kind == OPAQUE && facing > 0.0) {
        peak = peak * FACING_AWAY;
    }
    precise float per_px = 1.0 / (along * c.px_per_world);
    precise float slope_x = 0.0 - normal.x * per_px;
    precise float slope_y = normal.y * per_px;
    bool usable = abs(along) > 1.0e-4;
    vec3 conic = conic_of(area_sq, trace_x, mixed, trace_y, filter_sq);
    vec3 core = conic_of(area_sq, trace_x, mixed, trace_y, CORE_FILTER_PX * CORE_FILTER_PX);
    // What reaches through the eye plane is drawn by the processor: here it is counted.
    precise float reach_z = sqrt(axis_u.z * axis_u.z + axis_v.z * axis_v.z);
    precise float behind = c.before + reach_z;
    peak = behind > 0.0 ? peak : 0.0;
    precise float radius = sqrt(max(dot_of(axis_u, axis_u), dot_of(axis_v, axis_v)));
    bool near = c.before < (view.orthographic == 0u ? radius : reach_z);
    vec2 half_extent = vec2(sqrt(xx), sqrt(yy));
    if (near && view.orthographic == 0u) {
        half_extent = vec2(EVERYWHERE);
        peak = in_view(c, radius) ? peak : 0.0;
    }
    return Shape(conic, core, peak, half_extent, usable ? vec2(slope_x, slope_y) : vec2(0.0), near);
}

// The upper half of a float, rounded up: an extent is never packed smaller.
uint packed_extent(float extent) {
    return (min(floatBitsToUint(extent), 0xffff0000u) + 0xffffu) >> 16;
}

// Whether the splat reaches a pixel.
bool project(uint i) {
    Splat s;
    s.radius = radii[2u * i];
    s.cross_section = uintBitsToFloat(looks[LOOK_WORDS * i]);
    s.look = looks[LOOK_WORDS * i + LOOK_TABLES];
    s.normal = vec3(0.0);
    s.tangent = vec3(0.0);
    uint at = view.frame_words * i;
    if (view.frame_words > 0u) {
        s.normal = vec3(frames[at], frames[at + 1u], frames[at + 2u]);
    }
    if (view.frame_words > TANGENT_WORD) {
        s.tangent = vec3(frames[at + 3u], frames[at + 4u], frames[at + 5u]);
    }
    uint at_footprint = FOOTPRINT_VECTORS * ((s.look >> 16) & 255u);
    vec4 footprint = tables[at_footprint];
    s.norm = footprint.x;
    s.half_width = footprint.z;
    s.low_terms = tables[at_footprint + 1u];
    s.high_terms = tables[at_footprint + 2u].xy;
    vec3 offset = vec3(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]);
    Center c = center_of(offset, footprint.y, s.radius);
    Shape shape;
    if (s.look >> 24 == MEDIUM) {
        shape = medium(s, c);
    } else {
        shape = disc(s, c);
    }
    precise float x = view.middle.x + c.position.x * c.px_per_world;
    precise float y = view.middle.y - c.position.y * c.px_per_world;
    uint extents = packed_extent(shape.half_extent.x) | (packed_extent(shape.half_extent.y) << 16);
    // Comparisons with what is no number are false.
    bool shown = shape.peak > 0.0;
    if (shown) {
        uvec4 bounds = bounds_of(vec2(x, y), extents, view.size);
        shown = bounds.x < bounds.y && bounds.z < bounds.w;
    }
    if (shown && shape.near) {
        atomicAdd(block_near, 1u);
        extents |= NEAR;
    }
    uint to = view.splat_words * i;
    splats[to] = floatBitsToUint(x);
    splats[to + 1u] = floatBitsToUint(y);
    splats[to + 2u] = floatBitsToUint(shape.conic.x);
    splats[to + 3u] = floatBitsToUint(shape.conic.y);
    splats[to + 4u] = floatBitsToUint(shape.conic.z);
    splats[to + SPLAT_PEAK] = shown ? floatBitsToUint(shape.peak) : 0u;
    splats[to + SPLAT_EXTENTS] = extents;
    splats[to + SPLAT_TABLES] = s.look;
    if (view.splat_words > SPLAT_DEPTH) {
        splats[to + SPLAT_DEPTH] = floatBitsToUint(c.before);
        splats[to + 9u] = floatBitsToUint(shape.slope.x);
        splats[to + 10u] = floatBitsToUint(shape.slope.y);
        splats[to + 11u] = floatBitsToUint(s.radius);
        splats[to + SPLAT_CORE] = floatBitsToUint(shape.core.x);
        splats[to + SPLAT_CORE + 1u] = floatBitsToUint(shape.core.y);
        splats[to + SPLAT_CORE + 2u] = floatBitsToUint(shape.core.z);
    }
    return shown;
}

void main() {
    uint block = block_index();
    if (block >= ceil_div(view.splats, 256u)) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    if (lane == 0u) {
        block_visible = 0u;
        block_near = 0u;
    }
    barrier();
    uint i = block * 256u + lane;
    if (i < view.splats && project(i)) {
        atomicAdd(block_visible, 1u);
    }
    barrier();
    if (lane == 0u) {
        atomicAdd(state.visible, block_visible);
        if (block_near > 0u) {
            atomicAdd(state.near, block_near);
        }
    }
}
