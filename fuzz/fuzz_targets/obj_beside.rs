//! Bytes as the file `a.obj`, its materials `b` and its image `c`, with zero bytes between them.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read_painted(data));
