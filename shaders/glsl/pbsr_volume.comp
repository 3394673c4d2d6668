#version 450
// Particles in a regular volume, cell by cell; as `pbsr::volume`. A workgroup takes a chunk of a set and keeps the order of
// its arrivals.

#include "blocks.glsl"
#include "layouts.glsl"
#include "rng.glsl"
#include "exact.glsl"
#include "particles.glsl"
#include "source.glsl"
#include "scan.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleSource source; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint tables[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint cells[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { float values[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float transfer[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uint arrivals[]; };
layout(set = 0, binding = 6, std430) readonly buffer Bound6 { uint counts[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { uint particles[]; };

#include "lattice.glsl"
#include "volume.glsl"
#include "put.glsl"

void main() {
    uint block = block_index();
    if (block >= source.chunks * source.levels) {
        return;
    }
    uint level = block / source.chunks;
    uint number = block % source.chunks;
    Chunk chunk = chunk_of(level, number);
    Numbering numbering = numbering_of(level, number);
    uint first = counts[chunk_place(source, level, number)];
    uint before = 0u;
    for (uint begin = 0u; begin < chunk.count; begin += 256u) {
        uint j = begin + gl_LocalInvocationIndex;
        Place place;
        vec4 point;
        bool kept = j < chunk.count && arrives(chunk, j, place, point);
        uint total;
        uint rank = before + scan_workgroup(uint(kept), total);
        if (kept) {
            uint normal = 0u;
            if ((source.flags & SOURCE_NORMALS) != 0u) {
                normal = pack_normal(-world_gradient(place.gradient));
            }
            put(first, rank, numbering, offset_of(place), normal, point.xyz);
        }
        before += total;
    }
}
