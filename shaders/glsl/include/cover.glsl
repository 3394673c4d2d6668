// As `Groups::cover`.
uvec2 cover(uint blocks) {
    return uvec2(min(blocks, 32768u), ceil_div(blocks, 32768u));
}
