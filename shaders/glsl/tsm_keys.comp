#version 450
// Entries before they are sorted by distance: distances as keys, as `tsm::table` packs them, and where they are.

#include "blocks.glsl"
#include "layouts.glsl"

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { ListView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint distances[]; };
layout(set = 0, binding = 2, std430) buffer Bound2 { uint keys[]; };
layout(set = 0, binding = 3, std430) buffer Bound3 { uint places[]; };

void main() {
    uint i = block_index() * 256u + gl_LocalInvocationIndex;
    if (i >= view.entries) {
        return;
    }
    // Bits of positive floats rise with them; what is less than the least normal one counts as that.
    keys[i] = uint(max(int(distances[i]), 0x00800000));
    places[i] = i;
}
