//! Bytes as the file `a.gltf` and, behind a zero byte, the file `b` beside it.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read_pair("a.gltf", data));
