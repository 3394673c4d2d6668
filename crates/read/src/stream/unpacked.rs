//! What comes out of gzip or zlib, no more of it than the packed file may stand for.

use super::inflate::Inflate;
use super::input::{Stream, check_ratio};
use crate::error::{Place, ReadError};
use flate2::bufread::MultiGzDecoder;
use std::io::{self, BufReader, Read};

/// Packed bytes read at once, at most, and at least: the buffer of a small file would take longer to make than the file to unpack.
const AT_ONCE: u64 = 1 << 18;
const LEAST_AT_ONCE: u64 = 1 << 12;

/// The packed bytes by way of a buffer that a file of `stored` bytes fills.
fn buffered(packed: Stream<'_>, stored: u64) -> BufReader<Stream<'_>> {
    BufReader::with_capacity(stored.clamp(LEAST_AT_ONCE, AT_ONCE) as usize, packed)
}

enum Decoder<'a> {
    Gzip(MultiGzDecoder<BufReader<Stream<'a>>>),
    Zlib(Inflate<BufReader<Stream<'a>>>),
}

/// Unpacked bytes in their order.
pub(crate) struct Unpacked<'a> {
    decoder: Decoder<'a>,
    /// Bytes given so far.
    given: u64,
    /// Bytes of the file that all is packed in.
    stored: u64,
}

impl<'a> Unpacked<'a> {
    /// Of gzip of one or several members.
    pub(crate) fn gzip(packed: Stream<'a>, stored: u64) -> Self {
        let decoder = Decoder::Gzip(MultiGzDecoder::new(buffered(packed, stored)));
        Self { decoder, given: 0, stored }
    }

    /// Of one zlib stream.
    pub(crate) fn zlib(packed: Stream<'a>, stored: u64) -> Self {
        let decoder = Decoder::Zlib(Inflate::new(buffered(packed, stored)));
        Self { decoder, given: 0, stored }
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
