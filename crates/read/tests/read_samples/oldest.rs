//! The oldest kind of LAZ, made in memory.

use super::las;
use laz::encoders::ArithmeticEncoder;
use laz::models::ArithmeticModel;
use laz::record::{FieldCompressor, RecordCompressor, SequentialPointRecordCompressor};
use std::io::{Cursor, Write};

/// [`las`] of point format 0 to 5 as the oldest kind of LAZ: all points in one stream, without a table of chunks.
///
/// `gps_time` compresses the GPS times, if not as the format wants it.
pub(crate) fn laz_pointwise<F>(format: u8, n: i32, gps_time: Option<F>) -> Vec<u8>
where
    F: FieldCompressor<Cursor<Vec<u8>>> + Send + Sync + 'static,
{
    let plain = las(format, n, false);
    let word = |at: usize| u32::from_le_bytes(plain[at..at + 4].try_into().unwrap());
    let points = word(96) as usize;
    let record = word(105) as usize & 0xffff;
    let mut gps_time = gps_time;
    let vlr = laz::LazVlrBuilder::default().with_point_format(format, 0).unwrap().build();
    let mut coder = SequentialPointRecordCompressor::new(Cursor::new(Vec::new()));
    for item in vlr.items() {
        match gps_time.take_if(|_| item.item_type() == laz::LazItemType::GpsTime) {
            Some(own) => coder.add_field_compressor(own),
            None => coder.set_fields_from(&vec![*item]).unwrap(),
        }
    }
    plain[points..].chunks_exact(record).for_each(|r| coder.compress_next(r).unwrap());
    coder.done().unwrap();
    let mut description = Vec::new();
    vlr.write_to(&mut description).unwrap();
    description[..2].copy_from_slice(&1u16.to_le_bytes());
    let mut out = plain[..points].to_vec();
    out[96..100].copy_from_slice(&((points + 54 + description.len()) as u32).to_le_bytes());
    out[100..104].copy_from_slice(&(word(100) + 1).to_le_bytes());
    out[104] |= 0x80;
    let mut head = vec![0; 54];
    head[2..2 + laz::LazVlr::USER_ID.len()].copy_from_slice(laz::LazVlr::USER_ID.as_bytes());
    head[18..20].copy_from_slice(&laz::LazVlr::RECORD_ID.to_le_bytes());
    head[20..22].copy_from_slice(&(description.len() as u16).to_le_bytes());
    [out, head, description, coder.into_inner().into_inner()].concat()
}

/// [`laz_pointwise`] as writers make it.
pub(crate) fn laz_oldest(format: u8, n: i32) -> Vec<u8> {
    laz_pointwise(format, n, None::<laz::las::v2::GpsTimeCompressor>)
}

/// GPS times that never end: one switch between sequences after the other.
pub(crate) struct EndlessSwitches(pub(crate) ArithmeticModel);

impl FieldCompressor<Cursor<Vec<u8>>> for EndlessSwitches {
    fn size_of_field(&self) -> usize {
        8
    }

    fn compress_first(&mut self, target: &mut Cursor<Vec<u8>>, first: &[u8]) -> std::io::Result<()> {
        target.write_all(first)
    }

    fn compress_with(&mut self, coder: &mut ArithmeticEncoder<Cursor<Vec<u8>>>, _: &[u8]) -> std::io::Result<()> {
        (0..1_000_000).try_for_each(|_| coder.encode_symbol(&mut self.0, 3))
    }
}
