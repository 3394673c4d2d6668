//! One zlib stream that has to be whole and the last of its source: the usual decoders end in silence where theirs is cut off.

use flate2::{Decompress, FlushDecompress, Status};
use std::io::{self, BufRead, Read};

/// The unpacked bytes of a zlib stream.
pub(crate) struct Inflate<R> {
    packed: R,
    decoder: Decompress,
    ended: bool,
}

impl<R: BufRead> Inflate<R> {
    pub(crate) fn new(packed: R) -> Self {
        Self { packed, decoder: Decompress::new(true), ended: false }
    }

    /// Where the packed bytes come from.
    pub(crate) fn get_ref(&self) -> &R {
        &self.packed
    }
}

impl<R: BufRead> Read for Inflate<R> {
    fn read(&mut self, target: &mut [u8]) -> io::Result<usize> {
        if target.is_empty() {
            return Ok(0);
        }
        loop {
            let packed = self.packed.fill_buf()?;
            if self.ended {
                return if packed.is_empty() { Ok(0) } else { Err(io::Error::other("bytes after its end")) };
            }
            let at_end = packed.is_empty();
            let read = self.decoder.total_in();
            let given = self.decoder.total_out();
            let status = self.decoder.decompress(packed, target, FlushDecompress::None)?;
            let read = self.decoder.total_in() - read;
            let given = self.decoder.total_out() - given;
            self.packed.consume(read as usize);
            self.ended = status == Status::StreamEnd;
            if given > 0 {
                return Ok(given as usize);
            }
            if !self.ended && (at_end || read == 0) {
                return Err(io::Error::other("its end is missing"));
            }
        }
    }
}
