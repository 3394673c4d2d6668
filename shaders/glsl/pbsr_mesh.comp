#version 450
// Particles on triangles (Tanaka 2012, section 5); as `pbsr::mesh`. A workgroup takes a chunk of a set; arrival j draws the
// numbers 2j + 1 and 2j + 2 after those of the count.

#include "blocks.glsl"
#include "layouts.glsl"
#include "rng.glsl"
#include "exact.glsl"
#include "particles.glsl"
#include "source.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleSource source; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint tables[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint triangles[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float vertices[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint arrivals[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uint counts[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { uint particles[]; };

#include "put.glsl"

vec3 vertex(uint corner, uint offset) {
    uint word = corner * source.vertex_words + offset;
    return vec3(vertices[word], vertices[word + 1u], vertices[word + 2u]);
}

// Three values of the corners at (u, v).
vec3 blend(uvec3 corners, uint offset, vec2 uv) {
    float rest = (1.0 - uv.x) - uv.y;
    precise vec3 mixed =
        vertex(corners.x, offset) * rest + vertex(corners.y, offset) * uv.x + vertex(corners.z, offset) * uv.y;
    return mixed;
}

vec3 cross_of(vec3 a, vec3 b) {
    precise vec3 c = a.yzx * b.zxy - b.yzx * a.zxy;
    return c;
}

void main() {
    uint block = block_index();
    if (block >= source.chunks * source.levels) {
        return;
    }
    uint level = block / source.chunks;
    uint chunk = block % source.chunks;
    uint at = chunk_place(source, level, chunk);
    uint count = arrivals[ARRIVAL_WORDS * at];
    uvec2 state = uvec2(arrivals[ARRIVAL_WORDS * at + 1u], arrivals[ARRIVAL_WORDS * at + 2u]);
    uint first_element = tables[chunk * CHUNK_WORDS];
    uint elements = tables[chunk * CHUNK_WORDS + 1u];
    Numbering numbering = numbering_of(level, chunk);
    for (uint j = gl_LocalInvocationIndex; j < count; j += 256u) {
        uvec2 bits = stream_bits(state, 2u * j + 1u);
        uint slot = slot_of(bits, elements);
        uint word = source.slots_at + 2u * (first_element + slot);
        uint triangle = first_element + (bits.x < tables[word] ? slot : tables[word + 1u]);
        vec2 uv = pair_of(stream_bits(state, 2u * j + 2u));
        if (uv.x + uv.y > 1.0) {
            uv = 1.0 - uv;
        }
        uvec3 corners = uvec3(triangles[3u * triangle], triangles[3u * triangle + 1u], triangles[3u * triangle + 2u]);
        vec3 a = vertex(corners.x, 0u);
        precise vec3 ab = vertex(corners.y, 0u) - a;
        precise vec3 ac = vertex(corners.z, 0u) - a;
        precise vec3 p = a + ab * uv.x + ac * uv.y;
        uint normal = pack_normal((source.flags & SOURCE_NORMALS) != 0u ? blend(corners, 3u, uv) : cross_of(ab, ac));
        normal |= (source.flags & SOURCE_PER_CROSSING) != 0u ? PER_CROSSING : 0u;
        precise vec3 color = source.tint.xyz;
        if ((source.flags & SOURCE_COLORS) != 0u) {
            color = blend(corners, source.vertex_words - 3u, uv) * source.tint.xyz;
        }
        put(counts[at], j, numbering, p, normal, color);
    }
}
