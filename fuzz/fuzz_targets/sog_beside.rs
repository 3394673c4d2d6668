//! A description of SOG and, behind a zero byte, the image `b` that it may name.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read_pair("meta.json", data));
