#version 450
// The light that arrives at receivers, T = e^-A between the four nearest cells (Gunjee 2007, Eqs. 8 and 9); as
// `tsm::lookup`, operation by operation. One thread a receiver.

#include "blocks.glsl"
#include "layouts.glsl"
#include "optics.glsl"
#include "exact.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ShadowView view; };
// Eight words each: position in the light's frame and lift, normal and whether it is a surface.
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { vec4 receivers[]; };
// Of the cells for media, then for surfaces.
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uvec2 spans[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float distances[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float totals[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { float opaque_distances[]; };
layout(set = 0, binding = 6, std430) readonly buffer Bound6 { float directions[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { float lights[]; };

#include "directions.glsl"
#include "rays.glsl"

// Absorbance before the knot at this place of a list.
vec3 total_before(uvec2 span, uint knot) {
    if (knot == 0u) {
        return vec3(0.0);
    }
    uint at = (span.x + knot - 1u) * view.channels;
    return view.channels == 1u ? vec3(totals[at]) : vec3(totals[at], totals[at + 1u], totals[at + 2u]);
}

// Knots of a list nearer than a distance, or at it too.
uint knots_before(uvec2 span, float distance, bool at_it) {
    uint low = 0u;
    uint high = span.y;
    while (low < high) {
        uint middle = low + (high - low) / 2u;
        float d = distances[span.x + middle];
        if (d < distance || (at_it && d == distance)) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

precise vec3 half_at(uvec2 span, uint knot) {
    precise vec3 sum = 0.5 * (total_before(span, knot) + total_before(span, knot + 1u));
    return sum;
}

precise vec3 mixed(vec3 a, vec3 b, float t) {
    precise vec3 sum = a + (b - a) * t;
    return sum;
}

// Absorbance of media: half of each entry before it and half behind, spread over at most `ramp` to either side.
vec3 continuous(uvec2 span, float distance) {
    uint after = knots_before(span, distance, true);
    bool has_last = after > 0u;
    bool has_next = after < span.y;
    float last = has_last ? distances[span.x + after - 1u] : 0.0;
    float next = has_next ? distances[span.x + after] : 0.0;
    vec3 flat_total = total_before(span, after);
    precise float reach = view.ramp;
    if (has_last && has_next) {
        reach = min(reach, 0.5 * (next - last));
    }
    if (reach <= 0.0) {
        return has_last && last == distance ? half_at(span, after - 1u) : flat_total;
    }
    precise float behind = distance - last;
    if (has_last && behind < reach) {
        return mixed(half_at(span, after - 1u), flat_total, quotient(behind, reach));
    }
    precise float before = next - distance;
    if (has_next && before < reach) {
        return mixed(half_at(span, after), flat_total, quotient(before, reach));
    }
    return flat_total;
}

// Transmittance of one cell up to the distances for media and for surfaces.
vec3 through(uint cell, float medium, float surface) {
    if (view.opaque != 0u && opaque_distances[cell] < surface) {
        return vec3(0.0);
    }
    uvec2 steps = spans[view.size.x * view.size.y + cell];
    precise vec3 absorbance = continuous(spans[cell], medium);
    absorbance += total_before(steps, knots_before(steps, surface, false));
    vec3 light;
    for (int c = 0; c < 3; c++) {
        light[c] = absorbance[c] > view.dark_from ? 0.0 : exp_neg(absorbance[c]);
    }
    return light;
}

// Distances along the ray of a cell, for media and for surfaces; false where the cell does not see the receiver's plane.
bool distances_in(uint cell, vec4 position, vec4 normal, float distance, float lift, out float medium, out float surface) {
    medium = distance;
    surface = distance;
    if (normal.w == 0.0) {
        return true;
    }
    if (normal.x == 0.0 && normal.y == 0.0 && normal.z == 0.0) {
        precise float lifted = distance - lift;
        surface = lifted;
        return true;
    }
    Ray ray = ray_of(cell);
    precise vec3 towards = position.xyz - ray.base;
    precise float slope = product(ray.direction, normal.xyz);
    precise float plane = quotient(product(towards, normal.xyz), slope);
    if (!(plane > 0.0 && plane <= 3.402823466e38)) {
        return false;
    }
    // Far from the receiver its plane no longer stands for the surface that it is part of.
    bool near = plane > 0.5 * distance && plane < 2.0 * distance;
    if (!near && view.mapping != PARALLEL) {
        return false;
    }
    precise float lifted = plane - quotient(lift, abs(slope));
    medium = plane;
    surface = lifted;
    return true;
}

vec3 look_up(vec4 position, vec4 normal) {
    Place place = place_of(position.xyz);
    if (!place.seen) {
        return vec3(1.0);
    }
    precise float least_lift = place.distance * (1.0 / 262144.0);
    float lift = max(position.w, least_lift);
    precise vec2 from_centres = place.at - 0.5;
    vec2 corner = floor(from_centres);
    precise vec2 part = from_centres - corner;
    precise vec3 light = vec3(0.0);
    precise float seen = 0.0;
    for (int k = 0; k < 4; k++) {
        int i = k & 1;
        int j = k >> 1;
        precise float weight = (i == 1 ? part.x : 1.0 - part.x) * (j == 1 ? part.y : 1.0 - part.y);
        uint cell = cell_at(int(corner.x) + i, int(corner.y) + j);
        vec3 share = vec3(1.0);
        if (cell != NOWHERE) {
            float medium;
            float surface;
            if (!distances_in(cell, position, normal, place.distance, lift, medium, surface)) {
                continue;
            }
            share = through(cell, medium, surface);
        }
        light += weight * share;
        seen += weight;
    }
    if (seen > 0.0) {
        return min(vec3(quotient(light.x, seen), quotient(light.y, seen), quotient(light.z, seen)), vec3(1.0));
    }
    // A plane that no near cell sees, being almost parallel to the light: media alone shadow it.
    uint cell = cell_at(int(floor(place.at.x)), int(floor(place.at.y)));
    return cell == NOWHERE ? vec3(1.0) : through(cell, place.distance, 0.0);
}

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= view.receivers) {
        return;
    }
    vec3 light = look_up(receivers[2u * i], receivers[2u * i + 1u]);
    for (uint c = 0u; c < view.channels; c++) {
        lights[i * view.channels + c] = light[c];
    }
}
