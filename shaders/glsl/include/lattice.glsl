// Cells of a regular lattice: which one an arrival takes, and values in it. Bound before: `source`, `tables`, `values`,
// `arrivals`.

// A piece of the work: one chunk of one set.
struct Chunk {
    uint count;
    uvec2 state;
    uint first_element;
    uint elements;
};

Chunk chunk_of(uint level, uint chunk) {
    uint at = ARRIVAL_WORDS * chunk_place(source, level, chunk);
    return Chunk(
        arrivals[at], uvec2(arrivals[at + 1u], arrivals[at + 2u]), tables[chunk * CHUNK_WORDS],
        tables[chunk * CHUNK_WORDS + 1u]);
}

// The element that these bits choose.
uint element_of(Chunk chunk, uvec2 bits) {
    uint slot = slot_of(bits, chunk.elements);
    uint word = source.slots_at + 2u * (chunk.first_element + slot);
    return chunk.first_element + (bits.x < tables[word] ? slot : tables[word + 1u]);
}

float mixed(float a, float b, float t) {
    precise float m = a + (b - a) * t;
    return m;
}

// A place in the cell with this first corner, with the value and its gradient in lattice steps.
struct Place {
    uint at;
    vec3 f;
    float value;
    vec3 gradient;
};

Place place_in(uint at, vec3 f) {
    uint nx = source.lattice.x;
    uint layer = nx * source.lattice.y;
    vec4 low = vec4(values[at], values[at + nx], values[at + layer], values[at + layer + nx]);
    vec4 high = vec4(values[at + 1u], values[at + nx + 1u], values[at + layer + 1u], values[at + layer + nx + 1u]);
    precise vec4 along = high - low;
    precise vec4 x = low + along * f.x;
    float y0 = mixed(x.x, x.y, f.y);
    float y1 = mixed(x.z, x.w, f.y);
    precise float across = y1 - y0;
    precise vec2 rows = x.yw - x.xz;
    vec3 gradient = vec3(
        mixed(mixed(along.x, along.y, f.y), mixed(along.z, along.w, f.y), f.z), mixed(rows.x, rows.y, f.z), across);
    return Place(at, f, mixed(y0, y1, f.z), gradient);
}

vec3 turned(vec3 x, vec3 y, vec3 z, vec3 v) {
    precise vec3 r = x * v.x + y * v.y + z * v.z;
    return r;
}

vec3 world_gradient(vec3 gradient) {
    return turned(source.gradient_x.xyz, source.gradient_y.xyz, source.gradient_z.xyz, gradient);
}

// From the lattice's origin.
vec3 offset_of(Place place) {
    uint row = place.at / source.lattice.x;
    uvec3 corner = uvec3(place.at % source.lattice.x, row % source.lattice.y, row / source.lattice.y);
    precise vec3 lattice = vec3(corner) + place.f;
    return turned(source.axis_x.xyz, source.axis_y.xyz, source.axis_z.xyz, lattice);
}
