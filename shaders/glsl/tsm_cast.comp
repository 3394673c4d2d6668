#version 450
// Footprints of casters on a table of directions, as `tsm::media` and `tsm::surfaces` make them: those that the closed form
// takes, which the caller has chosen. One thread a caster.

#include "blocks.glsl"
#include "layouts.glsl"
#include "attributes.glsl"
#include "exact.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { CastView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint casters[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { float positions[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float radii[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint looks[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { float frames[]; };
// Extinction per channel and whether it is of a thin slab; then of footprints the deviation.
layout(set = 0, binding = 6, std430) readonly buffer Bound6 { vec4 tables[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { vec4 footprints[]; };

#include "directions.glsl"
#include "cast.glsl"

// Half width of a cut triweight over its standard deviation.
const float HALF_WIDTH = 3.01;
// Least half width of a footprint, cells.
const float LEAST_HALF = 1e-4;
// 1 over the cells by which a footprint may lean and still count as upright.
const float INVERSE_UPRIGHT = 50.0;

// Gradients of column and row.
struct Slopes {
    vec3 u;
    vec3 v;
};

Slopes octahedral_slopes(vec3 p) {
    Octant o = octant_of(p);
    float sine = root(o.sin_square);
    float cos_phi = sine > 0.0 ? quotient(o.d.x, sine) : 1.0;
    float sin_phi = sine > 0.0 ? quotient(o.d.y, sine) : 0.0;
    precise float above = 1.0 + o.d.z;
    float of_above = root(above);
    precise vec3 along_theta = vec3(o.d.z * cos_phi, o.d.z * sin_phi, -sine) * (0.5 * of_above);
    precise vec3 along_phi = vec3(-sin_phi, cos_phi, 0.0) * quotient(0.63661975, of_above);
    precise vec3 u = along_theta * (1.0 - o.share) - along_phi;
    precise vec3 v = along_theta * o.share + along_phi;
    bool lower = p.z < 0.0;
    vec3 mirror = vec3(with_sign(1.0, p.x), with_sign(1.0, p.y), with_sign(1.0, p.z));
    precise vec3 signs = mirror * quotient(0.5 * float(view.size.x), o.distance);
    precise vec3 to_u = (lower ? -v : u) * signs * mirror.x;
    precise vec3 to_v = (lower ? -u : v) * signs * mirror.y;
    return Slopes(to_u, to_v);
}

Slopes planar_slopes(vec3 p) {
    precise float scale = quotient(1.0, view.cell);
    if (view.mapping == PARALLEL) {
        return Slopes(vec3(scale, 0.0, 0.0), vec3(0.0, scale, 0.0));
    }
    scale = quotient(scale, p.z);
    return Slopes(vec3(scale, 0.0, quotient(-scale * p.x, p.z)), vec3(0.0, scale, quotient(-scale * p.y, p.z)));
}

precise vec3 cross_of(vec3 a, vec3 b) {
    precise float x = a.y * b.z - a.z * b.y;
    precise float y = a.z * b.x - a.x * b.z;
    precise float z = a.x * b.y - a.y * b.x;
    return vec3(x, y, z);
}

// Semi-axes of a disc.
void axes_of(vec3 normal, vec3 tangent, float radius, out vec3 first, out vec3 second) {
    precise vec3 across = tangent - normal * product(normal, tangent);
    float length_of = root(product(across, across));
    if (length_of <= 0.0) {
        // T. Duff et al. 2017.
        float sign_of = with_sign(1.0, normal.z);
        precise float a = quotient(-1.0, sign_of + normal.z);
        precise float b = normal.x * normal.y * a;
        precise float c = sign_of + normal.y * normal.y * a;
        across = vec3(b, c, -normal.y) * radius;
        length_of = radius;
    }
    vec3 unit_of = vec3(quotient(across.x, length_of), quotient(across.y, length_of), quotient(across.z, length_of));
    precise vec3 other = cross_of(normal, unit_of) * radius;
    first = across;
    second = other;
}

// Squared extents of a footprint: along columns, rows, and their product.
vec3 spread_of_ball(float radius, Slopes to) {
    precise float square = radius * radius;
    precise vec3 spread = vec3(product(to.u, to.u), product(to.v, to.v), product(to.u, to.v)) * square;
    return spread;
}

vec3 spread_of_disc(vec3 first, vec3 second, Slopes to) {
    vec2 u = vec2(product(to.u, first), product(to.u, second));
    vec2 v = vec2(product(to.v, first), product(to.v, second));
    precise float uu = u.x * u.x + u.y * u.y;
    precise float vv = v.x * v.x + v.y * v.y;
    precise float uv = u.x * v.x + u.y * v.y;
    return vec3(uu, vv, uv);
}

// Half widths of the triweights that a footprint becomes, and its slant.
vec3 widths_of(vec3 spread, float deviation) {
    precise float square = (HALF_WIDTH * deviation) * (HALF_WIDTH * deviation);
    precise float squared_v = spread.y * square;
    float half_v = max(root(squared_v), LEAST_HALF);
    precise float slant = quotient(spread.z * square, half_v * half_v);
    precise float leaning = abs(slant) * half_v * INVERSE_UPRIGHT - 1.0;
    slant = slant * clamp(leaning, 0.0, 1.0);
    precise float height = min(2.0 * half_v, 1.0);
    precise float off = max(spread.x * square - slant * (spread.z * square), 0.0);
    precise float squared_u = off + slant * slant * height * height * 0.75;
    return vec3(max(root(squared_u), LEAST_HALF), half_v, slant);
}

// Area that the light sees per area of a disc, times the growth of opacity at that angle.
float gain_of(vec3 position, vec3 normal, bool slab) {
    precise float along = product(position, normal);
    float cosine = abs(view.mapping == PARALLEL ? normal.z : quotient(along, root(product(position, position))));
    precise float gain = cosine * (slab ? quotient(1.0, max(cosine, 1e-3)) : 1.0);
    return gain;
}

void main() {
    uint caster = block_index() * 256u + gl_LocalInvocationIndex;
    if (caster >= view.casters) {
        return;
    }
    uint splat = casters[caster];
    uint look = looks[splat * LOOK_WORDS + LOOK_TABLES];
    vec4 extinction = tables[min(look & 0xffffu, view.materials)];
    uint kernel = look >> 16 & 0xffu;
    float deviation = tables[view.materials + 1u + (kernel < view.footprints ? kernel : 0u)].x;
    precise float radius = radii[2u * splat] * view.unit;
    precise float area = uintBitsToFloat(looks[splat * LOOK_WORDS]) * view.unit * view.unit;
    vec3 position = position_of(splat);
    Place place = place_of(position);
    Slopes to = planar_slopes(position);
    if (view.mapping == OCTAHEDRAL) {
        to = octahedral_slopes(position);
    }
    vec3 normal = vec3(0.0);
    vec3 spread;
    if (look >> 24 == MEDIUM) {
        spread = spread_of_ball(radius, to);
    } else {
        normal = turned(frame_at(splat, 0u));
        precise vec3 tangent = frame_at(splat, TANGENT_WORD) * view.unit;
        vec3 first;
        vec3 second;
        axes_of(normal, turned(tangent), radius, first, second);
        spread = spread_of_disc(first, second, to);
        area = area * gain_of(position, normal, extinction.w != 0.0);
    }
    precise float square = place.distance * place.distance;
    float total = view.mapping == PARALLEL ? area : quotient(area, square);
    vec3 widths = widths_of(spread, deviation);
    uint at = caster * view.footprint_vectors;
    footprints[at] = vec4(place.at, widths.xy);
    footprints[at + 1u] = vec4(widths.z, total, place.distance, extinction.z);
    if (view.footprint_vectors > 2u) {
        footprints[at + 2u] = vec4(position, extinction.x);
        footprints[at + 3u] = vec4(normal, extinction.y);
    }
}
