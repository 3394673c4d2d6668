//! Bytes as a scene in TOML.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::scene("scene.toml", data));
