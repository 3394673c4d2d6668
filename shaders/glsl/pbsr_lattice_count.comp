#version 450
// How many lines of each chunk along a lattice leave a particle on an isosurface. A workgroup takes a chunk of a set.

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
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint arrivals[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { uint counts[]; };

#include "lattice.glsl"
#include "crossings.glsl"

void main() {
    uint block = block_index();
    if (block >= source.chunks * source.levels) {
        return;
    }
    uint level = block / source.chunks;
    uint number = block % source.chunks;
    Chunk chunk = chunk_of(level, number);
    uint kept = 0u;
    for (uint j = gl_LocalInvocationIndex; j < chunk.count; j += 256u) {
        Place place;
        vec3 gradient;
        kept += uint(crosses(chunk, j, place, gradient));
    }
    uint total;
    scan_workgroup(kept, total);
    if (gl_LocalInvocationIndex == 0u) {
        counts[chunk_place(source, level, number)] = total;
    }
}
