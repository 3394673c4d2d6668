// Where a particle falls on the image (Tanaka 2012, section 3); as `pbsr::project`. Bound before: `view`, `objects`,
// `particles`.

const float WIDEST_PX = 131072.0;

float normal_part(uint bits) {
    precise float v = float(bits & 0x7fffu) * (2.0 / 32766.0) - 1.0;
    return v;
}

// As `PackedNormal::get`.
vec3 unpack_normal(uint packed) {
    float x = normal_part(packed);
    float y = normal_part(packed >> 15);
    float z = 1.0 - abs(x) - abs(y);
    float fold = max(-z, 0.0);
    return normalize(vec3(x - (x < 0.0 ? -fold : fold), y - (y < 0.0 ? -fold : fold), z));
}

vec3 turned(ParticleObject o, vec3 v) {
    precise vec3 r = o.linear_x.xyz * v.x + o.linear_y.xyz * v.y + o.linear_z.xyz * v.z;
    return r;
}

float length_of(vec3 p) {
    precise float square = p.x * p.x + p.y * p.y + p.z * p.z;
    return sqrt(square);
}

// The share of its pixel that a particle takes: k = s/s(p), times |cos| where opacity does not depend on the angle. What
// lies beside the image has that of the border.
float share_of(ParticleObject o, vec3 p, float inverse, uint normal) {
    vec2 reach = view.middle / view.focal;
    precise vec2 slope = clamp(p.xy * inverse, -reach, reach);
    precise float slab = o.share.x;
    if (view.orthographic == 0u) {
        slab = o.share.x * length_of(vec3(slope, 1.0)) * inverse * inverse;
    }
    if ((normal & PER_CROSSING) == 0u || (normal & HAS_NORMAL) == 0u) {
        return slab;
    }
    vec3 n = unpack_normal(normal);
    vec3 turned_normal = o.rotation_x.xyz * n.x + o.rotation_y.xyz * n.y + o.rotation_z.xyz * n.z;
    float cosine = view.orthographic != 0u ? turned_normal.z : dot(turned_normal, p) / length_of(p);
    return slab * abs(cosine);
}

// Pixels whose centres lie in (v - half, v + half], from and to.
uvec2 reached(float v, float half_px, float size) {
    float from = max(floor(v - half_px - 0.5) + 1.0, 0.0);
    float to = min(floor(v + half_px - 0.5) + 1.0, size);
    return to > from ? uvec2(uint(from), uint(to)) : uvec2(0u);
}

// A particle in view: its view position, where it falls on the image, and the share of its pixel that it takes. Nothing but
// the position of one that is not before the eye.
struct Seen {
    vec3 p;
    vec2 at;
    float k;
};

Seen seen_from_eye(uint word) {
    vec3 offset = vec3(
        uintBitsToFloat(particles[word]), uintBitsToFloat(particles[word + 1u]), uintBitsToFloat(particles[word + 2u]));
    ParticleObject o = objects[particles[word + 6u]];
    precise vec3 p = turned(o, offset) + o.translation.xyz;
    if (!(p.z > 0.0)) {
        return Seen(p, vec2(0.0), 0.0);
    }
    float inverse = view.orthographic != 0u ? 1.0 : 1.0 / p.z;
    precise float x = view.middle.x + view.focal * p.x * inverse;
    precise float y = view.middle.y - view.focal * p.y * inverse;
    return Seen(p, vec2(x, y), share_of(o, p, inverse, particles[word + 3u]));
}

// Pixels that a particle may reach, from and to in each direction, and the bits of its depth: in front of the eye depths are
// positive, so their bits sort as numbers. A widened one covers those that `covers` says: `k` is that of a pixel seen along
// the view, 0 for one that is not widened.
struct Footing {
    uvec2 columns;
    uvec2 rows;
    uint depth;
    vec2 at;
    float k;
};

// |d| of the ray of depth 1 through a place of the image.
float stretch(vec2 at) {
    if (view.orthographic != 0u) {
        return 1.0;
    }
    vec2 slope = (at - view.middle) * (1.0 / view.focal);
    return length_of(vec3(slope, 1.0));
}

Footing footing_of(uint word) {
    Seen seen = seen_from_eye(word);
    uvec2 columns = uvec2(0u);
    uvec2 rows = uvec2(0u);
    float k = 0.0;
    if (seen.p.z > 0.0) {
        if (seen.k > 1.0) {
            k = seen.k / stretch(clamp(seen.at, vec2(0.0), view.size));
            float half_px = 0.5 * min(sqrt(k * stretch(vec2(0.0))), WIDEST_PX);
            columns = reached(seen.at.x, half_px, view.size.x);
            rows = reached(seen.at.y, half_px, view.size.y);
        } else if (seen.at.x >= 0.0 && seen.at.x < view.size.x && seen.at.y >= 0.0 && seen.at.y < view.size.y) {
            if (seen.k >= 1.0 || uintBitsToFloat(particles[word + 5u]) < seen.k) {
                columns = uvec2(uint(seen.at.x), uint(seen.at.x) + 1u);
                rows = uvec2(uint(seen.at.y), uint(seen.at.y) + 1u);
            }
        }
    }
    return Footing(columns, rows, floatBitsToUint(seen.p.z), seen.at, k);
}

// Whether the square of a pixel that a footing may reach holds the particle.
bool covers(Footing f, uint column, uint row) {
    if (f.k == 0.0) {
        return true;
    }
    vec2 centre = vec2(float(column), float(row)) + 0.5;
    float half_px = 0.5 * sqrt(f.k * stretch(centre));
    vec2 off = centre - f.at;
    return off.x > -half_px && off.y > -half_px && off.x <= half_px && off.y <= half_px;
}
