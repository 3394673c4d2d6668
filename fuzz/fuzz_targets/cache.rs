//! Bytes as damage to the content of a file of the cache, whose hash is right.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::damaged_cache(data));
