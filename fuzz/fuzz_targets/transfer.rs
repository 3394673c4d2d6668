//! Bytes as the transfer function of a volume.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::transfer(data));
