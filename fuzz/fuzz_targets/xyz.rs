//! Bytes as the file `a.xyz`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read("a.xyz", data));
