//! What comes out of gzip or zlib, no more of it than the packed file may stand for.

use super::inflate::Inflate;
use super::input::{Stream, check_ratio};
use crate::error::{Place, ReadError};
use flate2::bufread::MultiGzDecoder;
use std::io::{self, BufReader, Read};

/// Packed bytes read at once.
const AT_ONCE: usize = 1 << 18;

enum Decoder<'a> {
    Gzip(MultiGzDecoder<BufReader<Stream<'a>>>),
    Zlib(Inflate<BufReader<Stream<'a>>>),
}

/// Unpacked bytes in their order.
pub(super) struct Unpacked<'a> {
    decoder: Decoder<'a>,
    /// Bytes given so far.
    given: u64,
    /// Bytes of the file that all is packed in.
    stored: u64,
}

impl<'a> Unpacked<'a> {
    /// Of gzip of one or several members.
    pub(super) fn gzip(packed: Stream<'a>, stored: u64) -> Self {
        let packed = BufReader::with_capacity(AT_ONCE, packed);
        Self { decoder: Decoder::Gzip(MultiGzDecoder::new(packed)), given: 0, stored }
    }

    /// Of one zlib stream.
    pub(super) fn zlib(packed: Stream<'a>, stored: u64) -> Self {
        let packed = BufReader::with_capacity(AT_ONCE, packed);
        Self { decoder: Decoder::Zlib(Inflate::new(packed)), given: 0, stored }
    }

    /// The packed bytes, and what they should be.
    fn packed(&self) -> (&BufReader<Stream<'a>>, &'static str) {
        match &self.decoder {
            Decoder::Gzip(decoder) => (decoder.get_ref(), "a complete gzip stream"),
            Decoder::Zlib(decoder) => (decoder.get_ref(), "a complete zlib stream and nothing after it"),
        }
    }
}

impl Read for Unpacked<'_> {
    fn read(&mut self, target: &mut [u8]) -> io::Result<usize> {
        let read = match &mut self.decoder {
            Decoder::Gzip(decoder) => decoder.read(target),
            Decoder::Zlib(decoder) => decoder.read(target),
        };
        let n = read.map_err(|e| {
            let (packed, expected) = self.packed();
            let at = packed.get_ref().position() - packed.buffer().len() as u64;
            let hint = "the file is truncated or damaged; fetch it again";
            let damaged = |e: io::Error| ReadError::input(Place::Byte(at), expected, e.to_string(), hint);
            io::Error::other(e.downcast::<ReadError>().unwrap_or_else(damaged))
        })?;
        self.given += n as u64;
        check_ratio(self.given, self.stored).map_err(io::Error::other)?;
        Ok(n)
    }
}
