//! Bytes as the file `a.ply`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read("a.ply", data));
