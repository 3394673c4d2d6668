//! Bytes as the header `a.nhdr` and, behind a zero byte, the data file `b`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read_pair("a.nhdr", data));
