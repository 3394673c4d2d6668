//! Bytes as a scene in TOML and, behind a zero byte, its data file `b`; what is valid is drawn.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::draw(data));
