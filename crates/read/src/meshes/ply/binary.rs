//! Numbers of a binary body, little or big endian.

use super::body::Source;
use super::header::Type;
use crate::error::{Place, ReadError};

/// A cursor over the bytes.
pub(super) struct Binary<'a, const BIG: bool> {
    content: &'a [u8],
    at: usize,
    last: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    pub(super) fn new(content: &'a [u8], body: usize) -> Self {
        Self { content, at: body, last: body }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], ReadError> {
        self.last = self.at;
        let Some(bytes) = self.content[self.at..].first_chunk::<N>() else {
            return Err(ReadError::input(
                Place::Byte(self.at as u64),
                format!("{N} more bytes"),
                "the end of the file",
                "the file is truncated, or its header announces too much",
            ));
        };
        self.at += N;
        let mut bytes = *bytes;
        if BIG {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<const BIG: bool> Source for Binary<'_, BIG> {
    fn begin_record(&mut self) -> Result<(), ReadError> {
        Ok(())
    }

    fn number(&mut self, kind: Type) -> Result<f64, ReadError> {
        Ok(match kind {
            Type::I8 => i8::from_le_bytes(self.take()?).into(),
            Type::U8 => u8::from_le_bytes(self.take()?).into(),
            Type::I16 => i16::from_le_bytes(self.take()?).into(),
            Type::U16 => u16::from_le_bytes(self.take()?).into(),
            Type::I32 => i32::from_le_bytes(self.take()?).into(),
            Type::U32 => u32::from_le_bytes(self.take()?).into(),
            Type::F32 => f32::from_le_bytes(self.take()?).into(),
            Type::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn end_record(&mut self) -> Result<(), ReadError> {
        Ok(())
    }

    fn finish(&mut self) -> Result<(), ReadError> {
        match &self.content[self.at..] {
            [] | b"\n" | b"\r\n" => Ok(()),
            rest => Err(ReadError::input(
                Place::Byte(self.at as u64),
                "the end of the file after the last element",
                format!("{} more bytes", rest.len()),
                "the header announces too little, or the file is damaged",
            )),
        }
    }

    fn remaining(&self) -> u64 {
        (self.content.len() - self.at) as u64
    }

    fn least_bytes(&self, kind: Type) -> u64 {
        kind.size()
    }

    fn place(&self) -> Place {
        Place::Byte(self.last as u64)
    }

    fn shown(&self, value: f64) -> String {
        value.to_string()
    }
}
