// Opaque splats: the nearest depth of each pixel, then all fragments within epsilon-z of it, weights normalised; as
// `splat_core::raster::resolve_opaque`. One workgroup a tile, one thread a pixel; at most CHANNELS channels.

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint starts[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint ids[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint splats[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float values[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uvec4 tables[]; };
// Depths, channels, objects.
layout(set = 0, binding = 6, std430) buffer Bound6 { uint image[]; };

#include "batch.glsl"

// s within which a disc is solid, and epsilon-z as a share of the radius.
const float CORE = 0.2025;
const float EPSILON_Z = 0.5;

// Behind all surfaces.
const float FAR = 3.4028235e38;
const uint INFINITE = 0x7f800000u;

void main() {
    uint tile = block_index();
    if (tile >= view.tiles) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    uvec2 size = uvec2(view.size);
    uvec2 corner = TILE * uvec2(tile % view.columns, tile / view.columns);
    uvec2 pixel = pixel_of(lane, corner);
    uint channel_count = CHANNELS == 3u ? 3u : view.channels;
    uint first = starts[tile];
    uint end = starts[tile + 1u];
    float nearest = FAR;
    uint named = 0u;
    for (uint begin = first; begin < end; begin += BATCH) {
        barrier();
        if (lane < BATCH && begin + lane < end) {
            stage(lane, ids[begin + lane], corner);
            uint core = ids[begin + lane] * view.splat_words + SPLAT_CORE;
            batch_conic[lane].zw = uintBitsToFloat(uvec2(splats[core], splats[core + 1u]));
            batch_peak[lane].x = uintBitsToFloat(splats[core + 2u]);
        }
        barrier();
        uint count = min(end - begin, BATCH);
        for (uint k = 0u; k < count; k++) {
            Shape shape = shape_of(k);
            vec2 d = offset_of(shape, pixel);
            float z = depth_of(shape, d);
            // Of several at the same depth the first.
            if (reaches(k, pixel) && distance_sq(shape, d) < CORE && z < nearest) {
                nearest = z;
                named = batch_ids[k];
            }
        }
    }
    float weights = 0.0;
    float behind_sum = 0.0;
    float channel[CHANNELS];
    for (uint c = 0u; c < CHANNELS; c++) {
        channel[c] = 0.0;
    }
    for (uint begin = first; begin < end; begin += BATCH) {
        barrier();
        if (lane < BATCH && begin + lane < end) {
            stage(lane, ids[begin + lane], corner);
        }
        barrier();
        uint count = min(end - begin, BATCH);
        for (uint k = 0u; k < count; k++) {
            if (nearest == FAR || !reaches(k, pixel)) {
                continue;
            }
            Shape shape = shape_of(k);
            vec2 d = offset_of(shape, pixel);
            float s = distance_sq(shape, d);
            float z = depth_of(shape, d);
            precise float behind = z - nearest;
            float weight = abs(behind) < EPSILON_Z * shape.peak.w ? amount_of(shape, s) : 0.0;
            weights += weight;
            precise float moved = weight * behind;
            behind_sum += moved;
            uint first_value = batch_ids[k] * channel_count;
            for (uint c = 0u; c < CHANNELS; c++) {
                if (c < channel_count) {
                    precise float weighted = weight * values[first_value + c];
                    channel[c] += weighted;
                }
            }
        }
    }
    if (pixel.x >= size.x || pixel.y >= size.y) {
        return;
    }
    uint area = size.x * size.y;
    uint at = pixel.y * size.x + pixel.x;
    precise float blended = nearest + behind_sum / weights;
    image[at] = weights > 0.0 ? floatBitsToUint(blended) : INFINITE;
    for (uint c = 0u; c < CHANNELS; c++) {
        if (c < channel_count) {
            image[(1u + c) * area + at] = floatBitsToUint(weights > 0.0 ? channel[c] / weights : 0.0);
        }
    }
    if (view.objects != 0u) {
        image[(1u + channel_count) * area + at] = nearest < FAR ? object_of(named) : 0xffffffffu;
    }
}
