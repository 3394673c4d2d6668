#version 450
// Where the particles that are seen lie, and how they are turned, as shading and look-ups take it: in the world's axes,
// relative to the eye. As `pbsr::render`.

#include "blocks.glsl"
#include "layouts.glsl"
#include "particles.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ParticleView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { ParticleObject objects[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint particles[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint found[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { uint seen[]; };
layout(set = 0, binding = 5, std430) buffer Bound5 { float positions[]; };
layout(set = 0, binding = 6, std430) buffer Bound6 { float frames[]; };
layout(push_constant) uniform Push { uint at; } push;

#include "footing.glsl"

vec3 in_world(vec3 v) {
    precise vec3 turned_back = view.world_x.xyz * v.x + view.world_y.xyz * v.y + view.world_z.xyz * v.z;
    return turned_back;
}

// Place within the pixel in steps of 1/256, as a record of the CPU keeps it; by chance for one that covers several.
vec2 within(Seen s, uint rank) {
    vec2 steps = floor((s.at - floor(s.at)) * 256.0);
    if (s.k > 1.0) {
        uint bits = scramble(rank);
        steps = vec2(bits & 255u, (bits >> 8) & 255u);
    }
    return (min(steps, 255.0) + 0.5) * (1.0 / 256.0);
}

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    vec3 position = vec3(0.0);
    vec3 normal = vec3(0.0);
    // Those behind the last of the workgroup are nothing, but no garbage.
    if (i < found[4u * push.at]) {
        uint word = seen[3u * i + 1u];
        Seen s = seen_from_eye(word);
        precise vec2 at = vec2(pixel_at(seen[3u * i], view.columns)) + within(s, seen[3u * i + 2u]);
        precise vec2 across = vec2(at.x - view.middle.x, view.middle.y - at.y) / view.focal;
        position = in_world(vec3(view.orthographic != 0u ? across : across * s.p.z, s.p.z));
        uint packed = particles[word + 3u];
        if ((packed & HAS_NORMAL) != 0u) {
            ParticleObject o = objects[particles[word + 6u]];
            vec3 n = unpack_normal(packed);
            precise vec3 seen_normal = o.rotation_x.xyz * n.x + o.rotation_y.xyz * n.y + o.rotation_z.xyz * n.z;
            normal = in_world(seen_normal);
        }
    }
    for (int c = 0; c < 3; c++) {
        positions[3u * i + uint(c)] = position[c];
        frames[3u * i + uint(c)] = normal[c];
    }
}
