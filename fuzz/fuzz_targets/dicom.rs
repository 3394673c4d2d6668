//! Bytes as the two slices of a series of DICOM, one half each.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read_slices(data));
