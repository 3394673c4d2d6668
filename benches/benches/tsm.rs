//! Benchmark of tsm (being written).
fn main() {}
