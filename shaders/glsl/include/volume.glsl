// Arrivals in the cells of a volume, and which of them stay; as `pbsr::volume`. An arrival takes three numbers: its cell's
// slot, its place, its lot. Bound before: `source`, `tables`, `cells`, `values`, `transfer`, `arrivals`;
// included before: `lattice.glsl`.

// Words of a cell: lattice index of the first corner, greatest extinction, piece of the transfer function. Words of a piece:
// value, colour and extinction where it begins, and their change over a unit of the value.
const uint CELL_WORDS = 3u;
const uint PIECE_WORDS = 9u;
const uint SEVERAL = 0xffffffffu;

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

// The place at `share` of a cell, whose outer ones reach as far as their voxels; as `places::Lattice::within`. The fourth
// number of an axis is where its last voxel ends.
Place place_through(uint at, vec3 share) {
    uvec3 corner = corner_of(at);
    vec3 ends = vec3(source.axis_x.w, source.axis_y.w, source.axis_z.w);
    vec3 low = mix(vec3(0.0), vec3(-0.5), equal(corner, uvec3(0u)));
    precise vec3 left = ends - vec3(corner);
    vec3 high = mix(vec3(1.0), left, lessThan(left, vec3(2.0)));
    precise vec3 within = low + share * (high - low);
    uvec3 steps = uvec3(1u, source.lattice.x, source.lattice.x * source.lattice.y);
    steps = mix(uvec3(0u), steps, greaterThan(ends, vec3(1.0)));
    Place place = place_between(at, clamp(within, 0.0, 1.0), steps);
    place.f = within;
    return place;
}

// Arrival j of a chunk, where it stays: its place, and colour and extinction there.
bool arrives(Chunk chunk, uint j, out Place place, out vec4 point) {
    uint cell = element_of(chunk, stream_bits(chunk.state, 3u * j + 1u));
    place = place_through(cells[CELL_WORDS * cell], triple_of(stream_bits(chunk.state, 3u * j + 2u)));
    uint piece = cells[CELL_WORDS * cell + 2u];
    point = piece == SEVERAL ? in_transfer(place.value) : in_piece(piece, place.value);
    precise float lot = pair_of(stream_bits(chunk.state, 3u * j + 3u)).x * uintBitsToFloat(cells[CELL_WORDS * cell + 1u]);
    return lot < point.w;
}
