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

// A place in the cell with this first corner, `f` steps from it, with the value and its gradient in lattice steps.
struct Place {
    uint at;
    vec3 f;
    float value;
    vec3 gradient;
};

// Lattice indices of the first corner of a cell.
uvec3 corner_of(uint at) {
    uint row = at / source.lattice.x;
    return uvec3(at % source.lattice.x, row % source.lattice.y, row / source.lattice.y);
}

// Between the lattice points; `steps` leads from one to the next along each axis.
Place place_between(uint at, vec3 f, uvec3 steps) {
    uint row = at + steps.y;
    uint layer = at + steps.z;
    uint both = layer + steps.y;
    vec4 low = vec4(values[at], values[row], values[layer], values[both]);
    vec4 high = vec4(values[at + steps.x], values[row + steps.x], values[layer + steps.x], values[both + steps.x]);
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

Place place_in(uint at, vec3 f) {
    return place_between(at, f, uvec3(1u, source.lattice.x, source.lattice.x * source.lattice.y));
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
    precise vec3 lattice = vec3(corner_of(place.at)) + place.f;
    return turned(source.axis_x.xyz, source.axis_y.xyz, source.axis_z.xyz, lattice);
}
