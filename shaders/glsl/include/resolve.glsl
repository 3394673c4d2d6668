// Opaque splats: the nearest depth of each pixel, then all fragments within epsilon-z of it, weights normalised; where they
// cover less than half of the pixel, the next behind. As `splat_core::raster::resolve_opaque`. One workgroup a tile, one thread a pixel; at most CHANNELS channels.

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint starts[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint ids[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint splats[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float values[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uvec4 tables[]; };
// Depths, channels, objects.
layout(set = 0, binding = 6, std430) buffer Bound6 { uint image[]; };

#include "batch.glsl"

// s within which a disc may be the nearest, and epsilon-z as a share of the radius.
const float CORE = 0.2025;
const float EPSILON_Z = 0.5;
// Coverage from which on a surface is solid, and how many that are not a pixel looks through, each four times as deep.
const float SOLID = 0.48;
const uint MOST_LAYERS = 8u;
// Weight of a disc that faces away.
const float FACING_AWAY = 0.00390625;

// s within which an ellipse has the area of an opaque disc on the image.
float own_share(Shape s) {
    vec4 rest = uintBitsToFloat(tables[FOOTPRINT_VECTORS * (s.look & 255u) + 3u]);
    precise float share = abs(s.peak.y) * rest.z;
    return share;
}

// Whether a pixel of the workgroup still looks for a surface.
shared uint any_open;

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
    // Up to where surfaces are too thin.
    float thin = -FAR;
    bool open = true;
    uint object = 0xffffffffu;
    float weights = 0.0;
    float behind_sum = 0.0;
    float channel[CHANNELS];
    // The surface of most weight among those that are too thin: nearest depth, weight, sum of depths; object, channels.
    vec3 best = vec3(FAR, 0.0, 0.0);
    uint best_object = 0xffffffffu;
    float best_channel[CHANNELS];
    // By discs that face the viewer, and by others.
    vec2 coverage = vec2(0.0);
    for (uint layer = 0u; layer < MOST_LAYERS; layer++) {
        for (uint begin = first; begin < end; begin += BATCH) {
            barrier();
            if (lane < BATCH && begin + lane < end) {
                stage(lane, ids[begin + lane], corner);
            }
            barrier();
            uint count = min(end - begin, BATCH);
            for (uint k = 0u; k < count && open; k++) {
                Shape shape = shape_of(k);
                vec2 d = offset_of(shape, pixel);
                if (reaches(k, pixel) && distance_sq(shape, d) < CORE) {
                    float z = depth_of(shape, d);
                    nearest = z > thin ? min(nearest, z) : nearest;
                }
            }
        }
        float last = nearest;
        float epsilon_z = EPSILON_Z * float(1u << (2u * layer));
        if (open) {
            object = 0xffffffffu;
            weights = 0.0;
            behind_sum = 0.0;
            for (uint c = 0u; c < CHANNELS; c++) {
                channel[c] = 0.0;
            }
        }
        for (uint begin = first; begin < end; begin += BATCH) {
            barrier();
            if (lane < BATCH && begin + lane < end) {
                stage(lane, ids[begin + lane], corner);
            }
            barrier();
            uint count = min(end - begin, BATCH);
            for (uint k = 0u; k < count && open; k++) {
                if (nearest == FAR || !reaches(k, pixel)) {
                    continue;
                }
                Shape shape = shape_of(k);
                vec2 d = offset_of(shape, pixel);
                float s = distance_sq(shape, d);
                float z = depth_of(shape, d);
                // Of several at the same depth the first.
                if (view.objects != 0u && object == 0xffffffffu && s < CORE && z == nearest) {
                    object = object_of(batch_ids[k]);
                }
                precise float behind = z - nearest;
                if (!(abs(behind) < epsilon_z * shape.peak.w && z > thin)) {
                    continue;
                }
                bool front = shape.peak.y > 0.0;
                precise float covered = abs(amount_of(shape, s));
                precise float weight = front ? covered : covered * FACING_AWAY;
                precise float found = covered + (s < own_share(shape) ? 1.0 : 0.0);
                coverage += front ? vec2(found, 0.0) : vec2(0.0, found);
                last = covered > 0.0 ? max(last, z) : last;
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
        barrier();
        if (lane == 0u) {
            any_open = 0u;
        }
        barrier();
        open = open && nearest < FAR;
        bool better = weights >= best.y;
        if (open && max(coverage.x, coverage.y) >= SOLID) {
            open = false;
            if (!better) {
                nearest = best.x;
                weights = best.y;
                behind_sum = best.z;
                object = best_object;
                channel = best_channel;
            }
        } else if (open) {
            if (better) {
                best = vec3(nearest, weights, behind_sum);
                best_object = object;
                best_channel = channel;
            }
            nearest = FAR;
            thin = last;
            weights = 0.0;
            object = 0xffffffffu;
            any_open = 1u;
        }
        barrier();
        if (any_open == 0u) {
            break;
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
        image[(1u + channel_count) * area + at] = object;
    }
}
