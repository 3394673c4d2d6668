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

const uint MOST_PARTS = 64u;

// Absorbance of media, every entry spread evenly over `ramp` to either side of its own distance.
vec3 continuous(uvec2 span, float distance) {
    precise float nearest = distance - view.ramp;
    precise float farthest = distance + view.ramp;
    uint begin = knots_before(span, nearest, true);
    uint end = max(begin, knots_before(span, farthest, false));
    uint stride = max(1u, (end - begin + MOST_PARTS - 1u) / MOST_PARTS);
    float inverse = quotient(0.5, view.ramp);
    precise vec3 sum = total_before(span, begin);
    vec3 before = sum;
    for (uint first = begin; first < end; first += stride) {
        uint last = min(first + stride, end) - 1u;
        precise float share = (distance - distances[span.x + first + (last - first) / 2u]) * inverse + 0.5;
        vec3 total = total_before(span, last + 1u);
        sum += (total - before) * share;
        before = total;
    }
    return sum;
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

// The four cells about a place, and where it lies among them.
struct Patch {
    uint cells[4];
    vec2 part;
};

Patch patch_at(vec2 at) {
    precise vec2 from_centres = at - 0.5;
    vec2 corner = floor(from_centres);
    precise vec2 part = from_centres - corner;
    Patch patch_of;
    for (int k = 0; k < 4; k++) {
        patch_of.cells[k] = cell_at(int(corner.x) + (k & 1), int(corner.y) + (k >> 1));
    }
    patch_of.part = part;
    return patch_of;
}

float weight_of(vec2 part, int k) {
    precise float weight = ((k & 1) == 1 ? part.x : 1.0 - part.x) * (k >= 2 ? part.y : 1.0 - part.y);
    return weight;
}

precise vec3 crossed(vec3 a, vec3 b) {
    precise vec3 c = vec3(a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y);
    return c;
}

// Whether an edge between octants lies within a cell of a place, or two of one along its diagonal.
bool is_creased(vec2 at) {
    precise float side = 0.5 * float(view.size.x);
    precise vec2 q = abs(at - side);
    precise float sum = q.x + q.y;
    precise float to_line = sum <= side ? min(q.x, q.y) : min(side - q.x, side - q.y);
    precise float to_diagonal = abs(sum - side) - 1.0;
    return min(to_line, to_diagonal) < 1.0;
}

const int STEPS = 3;
const float LEAST_SPREAD = 0.1;

// Where the rays of the four nearest cells, weighted bilinearly, meet a direction; from its place in the table.
vec2 met_at(vec3 towards, vec2 at) {
    vec2 met = at;
    float least = LEAST_SPREAD * quotient(12.566370614359172, float(view.size.x) * float(view.size.y));
    for (int step = 0; step < STEPS; step++) {
        Patch near = patch_at(met);
        vec3 rays[4];
        for (int k = 0; k < 4; k++) {
            if (near.cells[k] == NOWHERE) {
                return at;
            }
            rays[k] = ray_of(near.cells[k]).direction;
        }
        precise vec3 ray = rays[0] * weight_of(near.part, 0) + rays[1] * weight_of(near.part, 1)
            + rays[2] * weight_of(near.part, 2) + rays[3] * weight_of(near.part, 3);
        precise vec3 along_x = (rays[1] - rays[0]) * (1.0 - near.part.y) + (rays[3] - rays[2]) * near.part.y;
        precise vec3 along_y = (rays[2] - rays[0]) * (1.0 - near.part.x) + (rays[3] - rays[1]) * near.part.x;
        float area = product(crossed(along_x, along_y), towards);
        if (abs(area) < least) {
            return at;
        }
        vec2 off = vec2(product(crossed(along_y, ray), towards), product(crossed(ray, along_x), towards));
        precise vec2 next = met + clamp(vec2(quotient(off.x, area), quotient(off.y, area)), -1.0, 1.0);
        met = next;
    }
    return met;
}

vec3 look_up(vec4 position, vec4 normal) {
    Place place = place_of(position.xyz);
    if (!place.seen) {
        return vec3(1.0);
    }
    precise float least_lift = place.distance * (1.0 / 262144.0);
    float lift = max(position.w, least_lift);
    vec2 at = place.at;
    if (view.mapping == OCTAHEDRAL && is_creased(at)) {
        float inverse = quotient(1.0, place.distance);
        precise vec3 towards = position.xyz * inverse;
        at = met_at(towards, at);
    }
    Patch near = patch_at(at);
    precise vec3 light = vec3(0.0);
    precise float seen = 0.0;
    for (int k = 0; k < 4; k++) {
        float weight = weight_of(near.part, k);
        uint cell = near.cells[k];
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
