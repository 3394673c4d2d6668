//! Bytes as the file `a.nrrd`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read("a.nrrd", data));
