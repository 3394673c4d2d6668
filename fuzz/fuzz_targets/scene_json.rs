//! Bytes as a scene in JSON.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::scene("scene.json", data));
