#version 450
// Attribute-driven shading (Gunjee 2007, section 4.3, Figure 11), as `splat_core::shade`: one radiance a splat from its
// attributes, the tables and the share of each light that its shadow map lets through.

#include "blocks.glsl"
#include "layouts.glsl"
#include "optics.glsl"
#include "attributes.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ShadeView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { float positions[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { float radii[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint looks[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float frames[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { vec4 tables[]; };
layout(set = 0, binding = 6, std430) readonly buffer Bound6 { float received[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { float values[]; };

const float PI = 3.14159265;

// Vectors of a material: shading, ambient, diffuse, specular; shininess, transmission, albedo, asymmetry; emission.
const uint MATERIAL_VECTORS = 3u;
const float SHADING_PHASE = 1.0;
const float SHADING_UNLIT = 2.0;

// Vectors of a light: intensity, kind; position as a sum of two, each with a cosine of the cone: no light, full light;
// direction of travel, which is the normal of a patch, and place among the lights with a shadow map or -1.
const uint LIGHT_VECTORS = 4u;
const float LIGHT_DIRECTIONAL = 1.0;
const float LIGHT_SPOT = 2.0;
const float LIGHT_PATCH = 3.0;

struct Material {
    vec4 look;
    vec4 lobes;
    vec3 emission;
};

struct Point {
    vec3 position;
    float radius;
    vec3 normal;
    vec3 to_eye;
    vec3 color;
    bool by_phase;
};

float dot_of(vec3 a, vec3 b) {
    precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
    return sum;
}

// -ln x for 0 < x <= 1: ln x = 2 artanh((m - 1)/(m + 1)) + e ln 2, so that it keeps its digits near 1.
float minus_log(float x) {
    uint bits = floatBitsToUint(x);
    // The mantissa in [1/sqrt 2, sqrt 2).
    int exponent = int((bits + 0x004afb0du) >> 23) - 127;
    float m = uintBitsToFloat(bits - (uint(exponent) << 23));
    float z = (m - 1.0) / (m + 1.0);
    float z2 = z * z;
    float series = 0.33333333 + z2 * (0.2 + z2 * (0.14285715 + z2 * (0.11111111 + z2 * 0.09090909)));
    return -(float(exponent) * 0.69314718 + 2.0 * (z + z * z2 * series));
}

// x^m for 0 <= x, about 1 at most, and m >= 0; the device's own may be off by 2^-12.
float power(float x, float m) {
    if (m == 0.0) {
        return 1.0;
    }
    if (x < 1.0e-30) {
        return 0.0;
    }
    // Above 1 by rounding alone.
    float exponent = m * minus_log(x);
    return exponent >= 0.0 ? exp_neg(exponent) : 1.0 / exp_neg(-exponent);
}

// Henyey and Greenstein, 1/sr, as `splat_core::henyey_greenstein`.
float phase(vec3 travel, vec3 leave, float asymmetry) {
    float g = abs(asymmetry);
    vec3 apart = asymmetry >= 0.0 ? travel - leave : travel + leave;
    float d = (1.0 - g) * (1.0 - g) + g * dot_of(apart, apart);
    return (1.0 - g) * (1.0 + g) / (4.0 * PI * d * sqrt(d));
}

// The factor on the colour, and what is specular, as `Material::reflect`.
vec2 reflect_of(Material m, Point p, vec3 to_light) {
    float cosine = dot_of(p.normal, to_light);
    float diffuse = max(cosine, 0.0) * (1.0 - m.lobes.y) + max(-cosine, 0.0) * m.lobes.y;
    float specular = 0.0;
    if (m.look.w > 0.0 && cosine > 0.0) {
        precise vec3 mirrored = 2.0 * cosine * p.normal - to_light;
        float lobe = power(max(dot_of(mirrored, p.to_eye), 0.0), m.lobes.x);
        specular = m.look.w * (m.lobes.x + 2.0) / (2.0 * PI) * lobe * cosine;
    }
    return vec2(m.look.z / PI * diffuse, specular);
}

// Direction to a light, and its irradiance as a share of its intensity, as `Light::irradiance`.
vec4 arriving_from(uint light, Point p) {
    vec4 intensity = tables[light];
    vec4 high = tables[light + 1u];
    vec4 low = tables[light + 2u];
    vec3 direction = tables[light + 3u].xyz;
    if (intensity.w == LIGHT_DIRECTIONAL) {
        return vec4(-direction, 1.0);
    }
    // The nearer the light the more exact the first difference is.
    precise vec3 d = (high.xyz - p.position) + low.xyz;
    precise float spread = p.radius / 3.0;
    precise float distance_sq = dot_of(d, d) + spread * spread;
    if (!(distance_sq > 0.0)) {
        return vec4(0.0);
    }
    vec3 to_light = d / sqrt(distance_sq);
    float falloff = 1.0 / distance_sq;
    if (intensity.w == LIGHT_SPOT) {
        float cosine = -dot_of(to_light, direction);
        float t = cosine >= high.w ? 1.0 : 0.0;
        if (low.w > high.w) {
            t = clamp((cosine - high.w) / (low.w - high.w), 0.0, 1.0);
        }
        falloff = falloff * t * t * (3.0 - 2.0 * t);
    }
    if (intensity.w == LIGHT_PATCH) {
        falloff = falloff * max(-dot_of(to_light, direction), 0.0);
    }
    return vec4(to_light, falloff);
}

Point point_of(uint i, Material m, uint kind) {
    Point p;
    p.position = vec3(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]);
    p.radius = radii[2u * i];
    uint look = LOOK_WORDS * i + LOOK_COLOR;
    p.color = uintBitsToFloat(uvec3(looks[look], looks[look + 1u], looks[look + 2u]));
    p.to_eye = view.eye.xyz;
    if (view.orthographic == 0u) {
        precise vec3 to_eye = view.eye.xyz - p.position;
        float inverse = 1.0 / sqrt(dot_of(to_eye, to_eye));
        // At the eye itself there is no direction.
        p.to_eye = inverse > 0.0 && inverse < 3.0e38 ? to_eye * inverse : vec3(0.0);
    }
    p.normal = vec3(0.0);
    if (view.frame_words > 0u) {
        uint at = view.frame_words * i;
        p.normal = vec3(frames[at], frames[at + 1u], frames[at + 2u]);
    }
    // A surface shows its viewer the side that faces him; the gradient of a medium has one outside.
    bool away = kind != MEDIUM && dot_of(p.normal, p.to_eye) < 0.0;
    if (view.frame_words > SHADING_WORD) {
        uint at = view.frame_words * i + SHADING_WORD;
        vec3 shading = vec3(frames[at], frames[at + 1u], frames[at + 2u]);
        p.normal = shading == vec3(0.0) ? p.normal : shading;
    }
    p.by_phase = m.look.x == SHADING_PHASE || p.normal == vec3(0.0);
    p.normal = away ? -p.normal : p.normal;
    return p;
}

void put(inout uint at, vec3 v) {
    values[at] = v.x;
    values[at + 1u] = v.y;
    values[at + 2u] = v.z;
    at += 3u;
}

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= view.splats) {
        return;
    }
    uint look = looks[LOOK_WORDS * i + LOOK_TABLES];
    uint material = MATERIAL_VECTORS * (look & 0xffffu);
    Material m = Material(tables[material], tables[material + 1u], tables[material + 2u].xyz);
    Point p = point_of(i, m, look >> 24);
    vec3 ambient = vec3(0.0);
    vec3 emission = m.emission;
    // Of lights: reflected about the normal, or scattered once by the phase function.
    vec3 lit = vec3(0.0);
    float shadow = 1.0;
    if (m.look.x == SHADING_UNLIT) {
        emission += p.color;
    } else {
        ambient = view.ambient.xyz * p.color * (p.by_phase ? m.lobes.z : m.look.z) * m.look.y;
        float left = 0.0;
        float arriving = 0.0;
        for (uint l = 0u; l < view.lights; l++) {
            uint light = MATERIAL_VECTORS * view.materials + LIGHT_VECTORS * l;
            vec4 from = arriving_from(light, p);
            vec3 irradiance = tables[light].xyz * from.w;
            float slot = tables[light + 3u].w;
            vec3 share = vec3(1.0);
            if (slot >= 0.0) {
                uint at = 3u * (uint(slot) * view.splats + i);
                share = vec3(received[at], received[at + 1u], received[at + 2u]);
            }
            vec2 lobes = p.by_phase ? vec2(m.lobes.z * phase(-from.xyz, p.to_eye, m.lobes.w), 0.0)
                                    : reflect_of(m, p, from.xyz);
            lit += irradiance * share * (p.color * lobes.x + lobes.y);
            left += irradiance.y * share.y;
            arriving += irradiance.y;
        }
        if (arriving > 0.0) {
            shadow = left / arriving;
        }
    }
    uint at = view.channels * i;
    if ((view.layers & 1u) != 0u) {
        put(at, ambient);
        put(at, emission);
        put(at, p.by_phase ? vec3(0.0) : lit);
        put(at, p.by_phase ? lit : vec3(0.0));
    } else {
        put(at, ambient + emission + lit);
    }
    if ((view.layers & 2u) != 0u) {
        put(at, p.normal);
    }
    if ((view.layers & 4u) != 0u) {
        values[at] = shadow;
    }
}
