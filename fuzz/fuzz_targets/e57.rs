//! Bytes as the file `a.e57`, with the right sums of its pages.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::scans(data));
