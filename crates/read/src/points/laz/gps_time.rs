//! Reads over GPS times of LAZ records, version 2 of the item.
//!
//! All fields of a record share one arithmetic-coded stream in the point formats 0 to 5, so times that nobody asks for
//! have to be decoded with the rest. The decoder of the crate `laz` calls itself for each switch between sequences of
//! times; a damaged stream switches without end, which overflows the stack and cannot be caught. Writers switch once at
//! most, to the sequence that the time belongs to: a second switch is damage and refused here.
//!
//! Only what decides how the next symbols are coded is kept: of four sequences the last difference of times and how often
//! it was far off. The times themselves are not; the record gets zeros in their place.

use ::laz::decoders::ArithmeticDecoder;
use ::laz::decompressors::{IntegerDecompressor, IntegerDecompressorBuilder};
use ::laz::models::{ArithmeticModel, ArithmeticModelBuilder};
use ::laz::record::FieldDecompressor;
use std::io::{Error, ErrorKind, Read, Result};

/// Largest and smallest multiple of the last difference that has a symbol of its own.
const MULTI_MAX: i32 = 500;
const MULTI_MIN: i32 = -10;
/// Symbols after those of the multiples: the time before again, a time in full, then three switches.
const UNCHANGED: i32 = MULTI_MAX - MULTI_MIN + 1;
const FULL: i32 = UNCHANGED + 1;
const SYMBOLS: u32 = FULL as u32 + 4;
/// So many far-off differences in a row become the new difference.
const FAR_OFF: u32 = 3;

/// The state of the coder, as far as it decides what follows.
pub(super) struct GpsTimes {
    multiple: ArithmeticModel,
    no_difference: ArithmeticModel,
    integer: IntegerDecompressor,
    last: usize,
    next: usize,
    differences: [i32; 4],
    far_off: [u32; 4],
}

impl GpsTimes {
    pub(super) fn new() -> Self {
        Self {
            multiple: ArithmeticModelBuilder::new(SYMBOLS).build(),
            no_difference: ArithmeticModelBuilder::new(6).build(),
            integer: IntegerDecompressorBuilder::new().bits(32).contexts(9).build_initialized(),
            last: 0,
            next: 0,
            differences: [0; 4],
            far_off: [0; 4],
        }
    }

    /// Decodes one time; false if it was a switch to another sequence, in which the time follows.
    fn step<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<bool> {
        let difference = self.differences[self.last];
        if difference == 0 {
            match decoder.decode_symbol(&mut self.no_difference)? {
                0 => {}
                1 => {
                    let difference = self.integer.decompress(decoder, 0, 0)?;
                    self.set(difference);
                }
                2 => self.full(decoder)?,
                switch => return Ok(self.switch(switch as usize - 2)),
            }
            return Ok(true);
        }
        let symbol = decoder.decode_symbol(&mut self.multiple)? as i32;
        let predicted = |multiple: i32| multiple.wrapping_mul(difference);
        match symbol {
            1 => {
                self.integer.decompress(decoder, difference, 1)?;
                self.far_off[self.last] = 0;
            }
            0 => self.far(decoder, 0, 7)?,
            2..MULTI_MAX => {
                let context = if symbol < 10 { 2 } else { 3 };
                self.integer.decompress(decoder, predicted(symbol), context)?;
            }
            MULTI_MAX => self.far(decoder, predicted(MULTI_MAX), 4)?,
            UNCHANGED => {}
            FULL => self.full(decoder)?,
            switch if switch > FULL => return Ok(self.switch((switch - FULL) as usize)),
            negative if MULTI_MAX - negative > MULTI_MIN => {
                self.integer.decompress(decoder, predicted(MULTI_MAX - negative), 5)?;
            }
            _ => self.far(decoder, predicted(MULTI_MIN), 6)?,
        }
        Ok(true)
    }

    fn set(&mut self, difference: i32) {
        self.differences[self.last] = difference;
        self.far_off[self.last] = 0;
    }

    fn far<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>, predicted: i32, context: u32) -> Result<()> {
        let difference = self.integer.decompress(decoder, predicted, context)?;
        self.far_off[self.last] += 1;
        if self.far_off[self.last] > FAR_OFF {
            self.set(difference);
        }
        Ok(())
    }

    /// A time that begins a sequence of its own.
    fn full<R: Read>(&mut self, decoder: &mut ArithmeticDecoder<R>) -> Result<()> {
        // Its upper half is coded as a difference, which is of no consequence for what follows.
        self.integer.decompress(decoder, 0, 8)?;
        decoder.read_int()?;
        self.next = (self.next + 1) & 3;
        self.last = self.next;
        self.set(0);
        Ok(())
    }

    fn switch(&mut self, by: usize) -> bool {
        self.last = (self.last + by) & 3;
        false
    }
}

impl<R: Read> FieldDecompressor<R> for GpsTimes {
    fn size_of_field(&self) -> usize {
        size_of::<f64>()
    }

    fn decompress_first(&mut self, source: &mut R, first: &mut [u8]) -> Result<()> {
        source.read_exact(first)
    }

    fn decompress_with(&mut self, decoder: &mut ArithmeticDecoder<R>, _record: &mut [u8]) -> Result<()> {
        if self.step(decoder)? || self.step(decoder)? {
            return Ok(());
        }
        Err(Error::new(ErrorKind::InvalidData, "two switches of the sequence for one GPS time"))
    }
}
