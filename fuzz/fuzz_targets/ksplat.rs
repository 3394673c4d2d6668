//! Bytes as the file `a.ksplat`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read("a.ksplat", data));
