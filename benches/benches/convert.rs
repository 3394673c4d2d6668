//! Benchmark of convert (being written).
fn main() {}
