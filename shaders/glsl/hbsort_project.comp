#version 450
// Step 1 of HBS (Gunjee 2007, Figure 9): view depths as keys, culling by spheres, extremes; as `hbsort::project`.
// Blocks of 1024 splats.

#include "blocks.glsl"
#include "layouts.glsl"
#include "keys.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SortView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { float positions[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { float radii[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint keys[]; };
layout(set = 0, binding = 4, std430) buffer Bound4 { uint kept_counts[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { SortState state; };

shared uint block_near;
shared uint block_far;
shared uint block_radius;
shared uint block_kept;

// `precise`: products and sums are rounded one by one, as the CPU does it, so that the bits agree.
precise vec3 in_view(float x, float y, float z) {
    precise float u = view.axis_x.x * x + view.axis_y.x * y + view.axis_z.x * z + view.translation.x;
    precise float v = view.axis_x.y * x + view.axis_y.y * y + view.axis_z.y * z + view.translation.y;
    precise float w = view.axis_x.z * x + view.axis_y.z * y + view.axis_z.z * z + view.translation.z;
    return vec3(u, v, w);
}

bool keeps(vec3 p, float radius) {
    precise float x = abs(p.x) * view.plane_cos.x - abs(p.z) * view.plane_sin.x - view.half_extent.x;
    precise float y = abs(p.y) * view.plane_cos.y - abs(p.z) * view.plane_sin.y - view.half_extent.y;
    return p.z > -radius && p.z <= 3.402823466e38 && x <= radius && y <= radius;
}

void project(uint i) {
    // Radius of the kernel, and of the sphere that holds the splat.
    float radius = radii[2u * i];
    float bound = radii[2u * i + 1u];
    vec3 p = in_view(positions[3u * i], positions[3u * i + 1u], positions[3u * i + 2u]);
    uint key = CULLED_KEY;
    if (keeps(p, bound)) {
        key = key_of(p.z);
        atomicMin(block_near, key);
        atomicMax(block_far, key);
        atomicAdd(block_kept, 1u);
        key = view.back_to_front != 0u ? ~key : key;
    }
    if (radius <= 3.402823466e38) {
        atomicMin(block_radius, key_of(radius));
    }
    keys[i] = key;
}

void main() {
    uint block = block_index();
    if (block >= ceil_div(view.splats, 1024u)) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    if (lane == 0u) {
        block_near = 0xffffffffu;
        block_far = 0u;
        block_radius = 0xffffffffu;
        block_kept = 0u;
    }
    barrier();
    for (uint r = 0u; r < 4u; r++) {
        uint i = block * 1024u + r * 256u + lane;
        if (i < view.splats) {
            project(i);
        }
    }
    barrier();
    if (lane == 0u) {
        kept_counts[block] = block_kept;
        atomicMin(state.near_key, block_near);
        atomicMax(state.far_key, block_far);
        atomicMin(state.radius_key, block_radius);
    }
}
