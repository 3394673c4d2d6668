// One workgroup a tile, one thread a pixel: the tile's splats go through shared memory in batches, in their order, and each
// thread folds them into its planes; as `splat_core::raster::fold`. At most PLANES planes of optical depth and CHANNELS
// channels; LAYERS where depths and objects may be asked for.

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint starts[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint ids[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint splats[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float values[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { uvec4 tables[]; };
layout(set = 0, binding = 6, std430) readonly buffer Bound6 { float opaque_depth[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { uint planes[]; };

#include "batch.glsl"

// Extinctions.
shared vec4 batch_extinction[BATCH];
shared uint busy;

#ifdef LAYERS
#include "depth_profile.glsl"

// First number of the planes of depths at a pixel, and of objects.
uint depth_plane(uint area, uint at) {
    return (view.planes + view.channels) * area + at;
}

uint object_plane(uint area, uint at) {
    return (view.planes + view.channels + view.depths * DEPTH_PLANES) * area + at;
}

// What a splat adds to the depths and the object of a pixel.
void extras(uint k, Shape s, Pixel pixel, vec2 thicknesses, inout Profile depths, inout uint object) {
    if (!(thicknesses.y > thicknesses.x)) {
        return;
    }
    if (view.depths != 0u) {
        uint footprint = FOOTPRINT_VECTORS * (s.look & 255u);
        float spacing = uintBitsToFloat(tables[footprint + 2u].w);
        vec2 narrowing = uintBitsToFloat(tables[footprint + 3u].xy);
        bool medium = is_medium(s);
        vec2 offset = offset_of(s, pixel.at);
        precise float thickness = medium ? s.peak.w * spacing : 0.0;
        precise float distance = distance_sq(s, offset) * pixel.ray_factor;
        float narrow = medium ? fma(narrowing.y, distance, narrowing.x) : 1.0;
        // Nothing lies behind the eye.
        add_depth(depths, max(depth_of(s, offset), 0.0), thickness, narrow, thicknesses);
    }
    if (view.objects != 0u && (view.back_to_front != 0u || object == NO_OBJECT)) {
        object = object_of(batch_ids[k]);
    }
}
#endif

void main() {
    uint tile = block_index();
    if (tile >= view.tiles) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    uvec2 size = uvec2(view.size);
    uvec2 corner = TILE * uvec2(tile % view.columns, tile / view.columns);
    Pixel pixel;
    pixel.at = pixel_of(lane, corner);
    bool inside = pixel.at.x < size.x && pixel.at.y < size.y;
    uint plane_count = PLANES == 1u ? 1u : view.planes;
    uint channel_count = PLANES == 1u ? CHANNELS : view.channels;
    // Colours come first, in threes; normal and shadow take green's weight, as `ChannelLayout::plane_of` has it.
    uint colors = view.colors;
    uint area = size.x * size.y;
    uint at = pixel.at.y * size.x + pixel.at.x;
    pixel.ray_factor = ray_factor_of(pixel.at);
    pixel.hidden = false;
    pixel.solid = 0.0;
    if (view.opaque != 0u && inside) {
        pixel.solid = opaque_depth[at];
        pixel.hidden = pixel.solid < 3.0e38;
    }
    bool front = view.back_to_front == 0u;
    float depth[PLANES];
    // Stays 0 outside the image, where nothing shall keep a tile busy.
    float transmittance[PLANES];
    float channel[CHANNELS];
    bool go_on = inside && view.fresh == 0u;
    for (uint p = 0u; p < PLANES; p++) {
        depth[p] = go_on && p < plane_count ? uintBitsToFloat(planes[p * area + at]) : 0.0;
        transmittance[p] = inside && p < plane_count ? exp_neg(depth[p]) : 0.0;
    }
    for (uint c = 0u; c < CHANNELS; c++) {
        channel[c] = go_on && c < channel_count ? uintBitsToFloat(planes[(plane_count + c) * area + at]) : 0.0;
    }
#ifdef LAYERS
    Profile depths = nowhere();
    uint object = NO_OBJECT;
    if (go_on && view.depths != 0u) {
        depths = load_depths(depth_plane(area, at), area);
    }
    if (go_on && view.objects != 0u) {
        object = planes[object_plane(area, at)];
    }
#endif
    uint end = starts[tile + 1u];
    for (uint begin = starts[tile]; begin < end; begin += BATCH) {
        barrier();
        if (lane == 0u) {
            busy = 0u;
        }
        if (lane < BATCH && begin + lane < end) {
            uint material = stage(lane, ids[begin + lane], corner);
            batch_extinction[lane] = uintBitsToFloat(tables[FOOTPRINT_VECTORS * view.footprints + material]);
        }
        barrier();
        uint count = min(end - begin, BATCH);
        for (uint k = 0u; k < count; k++) {
            if (!reaches(k, pixel.at)) {
                continue;
            }
            Shape shape = shape_of(k);
            precise float tau = optical_depth(shape, pixel);
            if (tau == 0.0) {
                continue;
            }
            vec4 extinction = batch_extinction[k];
            float weight[PLANES];
#ifdef LAYERS
            uint middle = plane_count / 2u;
            float nearer = depth[middle];
#endif
            for (uint p = 0u; p < PLANES; p++) {
                precise float thickness = tau * extinction[p];
                depth[p] += thickness;
                float opacity = opacity_of(thickness);
                float before = transmittance[p];
                precise float left = fma(-opacity, before, before);
                transmittance[p] = left;
                weight[p] = front ? before * opacity : opacity;
            }
            uint first_value = batch_ids[k] * channel_count;
            for (uint c = 0u; c < CHANNELS; c++) {
                if (c < channel_count) {
                    uint p = plane_count == 3u && c < colors ? c % 3u : plane_count / 2u;
                    float value = values[first_value + c];
                    precise float added = front ? value : value - channel[c];
                    channel[c] = fma(weight[p], added, channel[c]);
                }
            }
#ifdef LAYERS
            extras(k, shape, pixel, vec2(nearer, depth[middle]), depths, object);
#endif
        }
        bool clear = false;
        for (uint p = 0u; p < PLANES; p++) {
            clear = clear || (p < plane_count && transmittance[p] >= view.cutoff);
        }
        if (clear) {
            atomicOr(busy, 1u);
        }
        barrier();
        if (front && busy == 0u) {
            break;
        }
    }
    if (!inside) {
        return;
    }
    for (uint p = 0u; p < PLANES; p++) {
        if (p < plane_count) {
            planes[p * area + at] = floatBitsToUint(depth[p]);
        }
    }
    for (uint c = 0u; c < CHANNELS; c++) {
        if (c < channel_count) {
            planes[(plane_count + c) * area + at] = floatBitsToUint(channel[c]);
        }
    }
#ifdef LAYERS
    if (view.depths != 0u) {
        store_depths(depths, depth_plane(area, at), area);
    }
    if (view.objects != 0u) {
        planes[object_plane(area, at)] = object;
    }
#endif
}
