// Arrivals in the cells of a volume, and which of them stay; as `pbsr::volume`. An arrival takes three numbers: its cell's
// slot, its place, its lot. Bound before: `source`, `tables`, `cells`, `values`, `transfer`, `arrivals`.

// Words of a cell: lattice index of the first corner, greatest extinction, piece of the transfer function. Words of a piece:
// value, colour and extinction where it begins, and their change over a unit of the value.
const uint CELL_WORDS = 3u;
const uint PIECE_WORDS = 9u;
const uint SEVERAL = 0xffffffffu;

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

float mixed(float a, float b, float t) {
    precise float m = a + (b - a) * t;
    return m;
}

// A place in a cell with the value and its gradient in lattice steps.
struct Place {
    uint cell;
    vec3 f;
    float value;
    vec3 gradient;
};

Place place_in(uint cell, vec3 f) {
    uint nx = source.lattice.x;
    uint layer = nx * source.lattice.y;
    uint at = cells[CELL_WORDS * cell];
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
    return Place(cell, f, mixed(y0, y1, f.z), gradient);
}

// Colour and extinction where a whole cell lies in one piece, as `Pieces::at`.
vec4 in_piece(uint piece, float value) {
    uint word = PIECE_WORDS * piece;
    precise float t = value - transfer[word];
    vec4 begin = vec4(transfer[word + 1u], transfer[word + 2u], transfer[word + 3u], transfer[word + 4u]);
    vec4 change = vec4(transfer[word + 5u], transfer[word + 6u], transfer[word + 7u], transfer[word + 8u]);
    precise vec4 point = begin + change * t;
    return point;
}

// The same anywhere, as `TransferFunction::at`.
vec4 in_transfer(float value) {
    uint upper = 0u;
    for (uint left = source.pieces; left > 0u;) {
        uint fewer = left / 2u;
        if (transfer[PIECE_WORDS * (upper + fewer)] <= value) {
            upper += fewer + 1u;
            left -= fewer + 1u;
        } else {
            left = fewer;
        }
    }
    uint word = PIECE_WORDS * (max(upper, 1u) - 1u);
    vec4 a = vec4(transfer[word + 1u], transfer[word + 2u], transfer[word + 3u], transfer[word + 4u]);
    if (upper == 0u || upper == source.pieces) {
        return a;
    }
    uint next = PIECE_WORDS * upper;
    vec4 b = vec4(transfer[next + 1u], transfer[next + 2u], transfer[next + 3u], transfer[next + 4u]);
    precise float up = value - transfer[word];
    precise float wide = transfer[next] - transfer[word];
    float t = quotient(up, wide);
    precise vec4 point = a + (b - a) * t;
    return point;
}

// Arrival j of a chunk, where it stays: its place, and colour and extinction there.
bool arrives(Chunk chunk, uint j, out Place place, out vec4 point) {
    uvec2 bits = stream_bits(chunk.state, 3u * j + 1u);
    uint slot = slot_of(bits, chunk.elements);
    uint word = source.slots_at + 2u * (chunk.first_element + slot);
    uint cell = chunk.first_element + (bits.x < tables[word] ? slot : tables[word + 1u]);
    place = place_in(cell, triple_of(stream_bits(chunk.state, 3u * j + 2u)));
    uint piece = cells[CELL_WORDS * cell + 2u];
    point = piece == SEVERAL ? in_transfer(place.value) : in_piece(piece, place.value);
    precise float lot = pair_of(stream_bits(chunk.state, 3u * j + 3u)).x * uintBitsToFloat(cells[CELL_WORDS * cell + 1u]);
    return lot < point.w;
}
