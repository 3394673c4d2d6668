// Where cells begin and distances end among sorted entries; `view`, `cells` and `distances` are bound before.

bool begins_cell(uint i) {
    return i == 0u || cells[i - 1u] != cells[i];
}

// Entries at one distance are one knot, the last of them.
bool ends_distance(uint i) {
    return i + 1u == view.entries || cells[i + 1u] != cells[i] || distances[i + 1u] != distances[i];
}
