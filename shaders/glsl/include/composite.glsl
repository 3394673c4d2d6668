// One workgroup a tile, one thread a pixel: the tile's splats go through shared memory in batches, in their order, and each
// thread folds them into its planes; as `splat_core::raster::fold`. At most PLANES planes of optical depth and CHANNELS
// channels.

layout(set = 0, binding = 0, std430) readonly buffer Bound0 { SplatView view; };
layout(set = 0, binding = 1, std430) readonly buffer Bound1 { uint starts[]; };
layout(set = 0, binding = 2, std430) readonly buffer Bound2 { uint ids[]; };
layout(set = 0, binding = 3, std430) readonly buffer Bound3 { uint splats[]; };
layout(set = 0, binding = 4, std430) readonly buffer Bound4 { float values[]; };
layout(set = 0, binding = 5, std430) readonly buffer Bound5 { vec4 tables[]; };
layout(set = 0, binding = 6, std430) readonly buffer Bound6 { float opaque_depth[]; };
layout(set = 0, binding = 7, std430) buffer Bound7 { float planes[]; };

// Splats that are looked at together. Also how often a tile is looked at for being done.
const uint BATCH = 128u;

// Tiles of the processor's twin: offsets are counted from their corners, so that they have its bits.
const uint TWIN_TILE = 32u;

// Vectors of a footprint in the tables.
const uint FOOTPRINT_VECTORS = 3u;

const uint MEDIUM = 0u;

shared uint batch_ids[BATCH];
// Blocks of 4 by 4 pixels that the splat reaches: columns and rows [x0, x1, y0, y1) of pixels.
shared uvec4 batch_reach[BATCH];
// Offset of the twin's corner from the centre, first numbers of the conic; its last, peak, depth of the centre, extent.
shared vec4 batch_shape[BATCH];
shared vec4 batch_peak[BATCH];
// Slope of the depth; for a medium 1/extent.
shared vec2 batch_slope[BATCH];
// Extinctions.
shared vec4 batch_extinction[BATCH];
// footprint | kind << 8.
shared uint batch_look[BATCH];
shared uint busy;

struct Pixel {
    uvec2 at;
    // 1/|d|^2 of the ray, 1 for parallel rays.
    float ray_factor;
    // Depth of the opaque surface, and whether there is one.
    float solid;
    bool hidden;
};

precise float ray_factor_of(uvec2 at) {
    if (view.focal == 0.0) {
        return 1.0;
    }
    precise vec2 d = (vec2(at) + 0.5 - view.middle) / view.focal;
    precise float length_sq = 1.0 + d.x * d.x + d.y * d.y;
    return 1.0 / length_sq;
}

void stage(uint k, uint id, uvec2 corner) {
    uint at = id * view.splat_words;
    precise vec2 center = vec2(uintBitsToFloat(splats[at]), uintBitsToFloat(splats[at + 1u]));
    uint look = splats[at + SPLAT_TABLES];
    uvec4 bounds = bounds_of(center, splats[at + SPLAT_EXTENTS], view.size);
    precise vec2 origin = vec2(corner / TWIN_TILE * TWIN_TILE) + 0.5 - center;
    vec4 depth = vec4(0.0, 0.0, 0.0, 1.0);
    if (view.splat_words > SPLAT_DEPTH) {
        depth = uintBitsToFloat(
            uvec4(splats[at + SPLAT_DEPTH], splats[at + 9u], splats[at + 10u], splats[at + 11u]));
    }
    vec3 conic = uintBitsToFloat(uvec3(splats[at + 2u], splats[at + 3u], splats[at + 4u]));
    batch_ids[k] = id;
    batch_reach[k] = uvec4(bounds.x & ~3u, (bounds.y + 3u) & ~3u, bounds.z & ~3u, (bounds.w + 3u) & ~3u);
    batch_shape[k] = vec4(origin, conic.x, conic.y);
    batch_peak[k] = vec4(conic.z, uintBitsToFloat(splats[at + SPLAT_PEAK]), depth.x, depth.w);
    batch_slope[k] = look >> 24 == MEDIUM ? vec2(1.0 / depth.w, 0.0) : depth.yz;
    batch_extinction[k] = tables[FOOTPRINT_VECTORS * view.footprints + (look & 0xffffu)];
    batch_look[k] = look >> 16;
}

// Optical depth of splat k of the batch on the pixel.
precise float optical_depth(uint k, Pixel pixel) {
    vec4 shape = batch_shape[k];
    vec4 peak = batch_peak[k];
    uint look = batch_look[k];
    bool medium = look >> 8 == MEDIUM;
    precise vec2 d = shape.xy + vec2(pixel.at % TWIN_TILE);
    precise float along = shape.z * d.x + shape.w * d.y;
    precise float across = peak.x * d.y * d.y;
    precise float s = fma(along, d.x, across);
    precise float scaled = medium ? s * pixel.ray_factor : s;
    uint footprint = FOOTPRINT_VECTORS * (look & 255u);
    float t = max(1.0 - scaled, 0.0);
    precise float tau = peak.y * profile(tables[footprint], tables[footprint + 1u], tables[footprint + 2u], t);
    if (pixel.hidden) {
        vec2 slope = batch_slope[k];
        if (medium) {
            tau *= share_in_front((pixel.solid - peak.z) * slope.x);
        } else {
            precise float offset = slope.x * d.x + slope.y * d.y;
            tau = peak.z + clamp(offset, -peak.w, peak.w) < pixel.solid ? tau : 0.0;
        }
    }
    return tau;
}

void main() {
    uint tile = block_index();
    if (tile >= view.tiles) {
        return;
    }
    uint lane = gl_LocalInvocationIndex;
    uvec2 size = uvec2(view.size);
    uvec2 corner = TILE * uvec2(tile % view.columns, tile / view.columns);
    // 32 neighbours are 8 by 4 pixels: they enter and leave a footprint together.
    uint eighth = lane >> 5;
    Pixel pixel;
    pixel.at = corner + uvec2((lane & 7u) + 8u * (eighth & 1u), ((lane >> 3) & 3u) + 4u * (eighth >> 1));
    bool inside = pixel.at.x < size.x && pixel.at.y < size.y;
    uint plane_count = PLANES == 1u ? 1u : view.planes;
    uint channel_count = PLANES == 1u ? CHANNELS : view.channels;
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
        depth[p] = go_on && p < plane_count ? planes[p * area + at] : 0.0;
        transmittance[p] = inside && p < plane_count ? exp_neg(depth[p]) : 0.0;
    }
    for (uint c = 0u; c < CHANNELS; c++) {
        channel[c] = go_on && c < channel_count ? planes[(plane_count + c) * area + at] : 0.0;
    }
    uint end = starts[tile + 1u];
    for (uint begin = starts[tile]; begin < end; begin += BATCH) {
        barrier();
        if (lane == 0u) {
            busy = 0u;
        }
        if (lane < BATCH && begin + lane < end) {
            stage(lane, ids[begin + lane], corner);
        }
        barrier();
        uint count = min(end - begin, BATCH);
        for (uint k = 0u; k < count; k++) {
            uvec4 reach = batch_reach[k];
            if (pixel.at.x < reach.x || pixel.at.x >= reach.y || pixel.at.y < reach.z || pixel.at.y >= reach.w) {
                continue;
            }
            precise float tau = optical_depth(k, pixel);
            if (tau == 0.0) {
                continue;
            }
            vec4 extinction = batch_extinction[k];
            float weight[PLANES];
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
                    // Channels come in threes, red, green, blue; a lone last one takes the green weight.
                    bool own = plane_count == 3u && channel_count - c > channel_count % 3u;
                    uint p = own ? c % 3u : plane_count / 2u;
                    float value = values[first_value + c];
                    precise float added = front ? value : value - channel[c];
                    channel[c] = fma(weight[p], added, channel[c]);
                }
            }
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
            planes[p * area + at] = depth[p];
        }
    }
    for (uint c = 0u; c < CHANNELS; c++) {
        if (c < channel_count) {
            planes[(plane_count + c) * area + at] = channel[c];
        }
    }
}
