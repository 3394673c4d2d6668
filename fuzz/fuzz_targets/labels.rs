//! Bytes as a table of labels.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read_labels(data));
