//! Bytes as the list of files `a.vtm` of VTK and, behind a zero byte, the file `b` beside it.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| organza_fuzz::read_pair("a.vtm", data));
