//! Bytes as the file `a.las`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read("a.las", data));
