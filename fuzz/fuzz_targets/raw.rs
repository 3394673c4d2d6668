//! Bytes as the file `x_3x2x2_float32.raw`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read("x_3x2x2_float32.raw", data));
