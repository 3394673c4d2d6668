// What one splat does to one pixel: `view` and `tables` are bound before.

// Tiles of the processor's twin: offsets are counted from their corners, so that they have its bits.
const uint TWIN_TILE = 32u;

// Vectors of a footprint in the tables.
const uint FOOTPRINT_VECTORS = 5u;

const uint MEDIUM = 0u;

struct Pixel {
    uvec2 at;
    // 1/|d|^2 of the ray, 1 for parallel rays.
    float ray_factor;
    // Depth of the opaque surface, and whether there is one.
    float solid;
    bool hidden;
};

// Of a splat: offset of the twin's corner from the centre, first numbers of the conic; its last, peak, depth of the centre,
// extent; slope of the depth, for a medium one over half the width of its share before a plane and one over its share before the eye; footprint |
// kind << 8.
struct Shape {
    vec4 conic;
    vec4 peak;
    vec2 slope;
    uint look;
};

precise float ray_factor_of(uvec2 at) {
    if (view.focal == 0.0) {
        return 1.0;
    }
    precise vec2 d = (vec2(at) + 0.5 - view.middle) / view.focal;
    precise float length_sq = 1.0 + d.x * d.x + d.y * d.y;
    return 1.0 / length_sq;
}

// The corner of the twin's tile, from the middle of a splat.
precise vec2 origin_of(uvec2 at, vec2 center) {
    precise vec2 origin = vec2(at / TWIN_TILE * TWIN_TILE) + 0.5 - center;
    return origin;
}

bool is_medium(Shape s) {
    return s.look >> 8 == MEDIUM;
}

// Offset of a pixel from the centre.
precise vec2 offset_of(Shape s, uvec2 at) {
    precise vec2 d = s.conic.xy + vec2(at % TWIN_TILE);
    return d;
}

// s at an offset; for a medium in perspective yet to be multiplied by the ray's factor.
precise float distance_sq(Shape s, vec2 d) {
    precise float along = s.conic.z * d.x + s.conic.w * d.y;
    precise float across = s.peak.x * d.y * d.y;
    return fma(along, d.x, across);
}

// View depth: the plane of a disc, the centre of a medium.
precise float depth_of(Shape s, vec2 d) {
    precise float offset = is_medium(s) ? 0.0 : s.slope.x * d.x + s.slope.y * d.y;
    return s.peak.z + clamp(offset, -s.peak.w, s.peak.w);
}

// Optical depth, or the weight of an opaque splat, at s.
precise float amount_of(Shape s, float distance) {
    uint footprint = FOOTPRINT_VECTORS * (s.look & 255u);
    vec4 low = uintBitsToFloat(tables[footprint]);
    vec4 high = uintBitsToFloat(tables[footprint + 1u]);
    vec4 sharp = uintBitsToFloat(tables[footprint + 2u]);
    return s.peak.y * profile(low, high, sharp, max(1.0 - distance, 0.0));
}

// Share of a medium before a plane.
precise float medium_before(Shape s, float distance) {
    uint footprint = FOOTPRINT_VECTORS * (s.look & 255u);
    vec4 begin = uintBitsToFloat(tables[footprint + 3u]);
    vec4 end = uintBitsToFloat(tables[footprint + 4u]);
    return share_before(vec4(begin.zw, end.xy), end.zw, distance);
}

// Optical depth on the pixel.
precise float optical_depth(Shape s, Pixel pixel) {
    bool medium = is_medium(s);
    precise vec2 d = offset_of(s, pixel.at);
    precise float distance = distance_sq(s, d);
    precise float scaled = medium ? distance * pixel.ray_factor : distance;
    precise float tau = amount_of(s, scaled);
    if (pixel.hidden) {
        if (medium) {
            // The part between the eye and the surface, as a share of all before the eye.
            precise float behind = 1.0 - medium_before(s, (pixel.solid - s.peak.z) * s.slope.x);
            tau *= max(fma(-behind, s.slope.y, 1.0), 0.0);
        } else {
            tau = depth_of(s, d) < pixel.solid ? tau : 0.0;
        }
    }
    return tau;
}
