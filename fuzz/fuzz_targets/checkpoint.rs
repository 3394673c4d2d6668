//! Bytes as damage to a checkpoint, whose checksum is right.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::damaged_checkpoint(data));
