//! Bytes as an environment, a slide, the heights of bumps or a footprint.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::image(data));
