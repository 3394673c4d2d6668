//! Bytes as the stack `a.tif`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read("a.tif", data));
