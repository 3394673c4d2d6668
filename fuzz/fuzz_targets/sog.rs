//! Bytes as the file `a.sog`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read("a.sog", data));
