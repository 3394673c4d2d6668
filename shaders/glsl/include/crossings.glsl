// Lines along the axes of a lattice, and which of them leave a particle on an isosurface; as `pbsr::lattice`. A line takes three
// numbers: its cell's slot, its place, its axis and lot. Bound before: `source`, `tables`, `cells`, `values`, `arrivals`;
// included before: `lattice.glsl`.

vec3 on_line(uint axis, vec2 uv, float t) {
    return axis == 0u ? vec3(t, uv) : (axis == 1u ? vec3(uv.y, t, uv.x) : vec3(uv, t));
}

// Line j of a chunk, where it leaves a particle: the place and the world's gradient there.
bool crosses(Chunk chunk, uint j, out Place place, out vec3 gradient) {
    uint at = cells[element_of(chunk, stream_bits(chunk.state, 3u * j + 1u))];
    vec2 uv = triple_of(stream_bits(chunk.state, 3u * j + 2u)).xy;
    vec2 lots = pair_of(stream_bits(chunk.state, 3u * j + 3u));
    uint axis = min(uint(3.0 * lots.x), 2u);
    float low = place_in(at, on_line(axis, uv, 0.0)).value;
    float high = place_in(at, on_line(axis, uv, 1.0)).value;
    if ((low < source.level) == (high < source.level)) {
        return false;
    }
    precise float up = source.level - low;
    precise float rise = high - low;
    place = place_in(at, on_line(axis, uv, quotient(up, rise)));
    vec3 g = place.gradient;
    gradient = world_gradient(g);
    precise float sum = abs(g.x) + abs(g.y) + abs(g.z);
    precise float bound = lots.y * source.weight * sum;
    precise float square = gradient.x * gradient.x + gradient.y * gradient.y + gradient.z * gradient.z;
    precise float bound_square = bound * bound;
    return bound_square < square;
}
