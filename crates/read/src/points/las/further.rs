//! The fields of LAS records that have no meaning of their own here, as columns: returns, angles, sources, times, extra bytes.

use super::Layout;
use ::las::PointData;
use ::laz::DecompressionSelection;

/// Bytes of the description of an extra dimension.
const DESCRIPTION: usize = 192;
/// Where in a description the value stands for none, the scale and the offset are, and the bits that say that they count.
const NO_DATA: (usize, u8) = (40, 1);
const SCALE: (usize, u8) = (112, 8);
const OFFSET: (usize, u8) = (136, 16);

/// A field of a record as a column.
pub(super) struct Field {
    pub(super) name: String,
    kind: Kind,
}

#[derive(Clone, Copy)]
enum Kind {
    ReturnNumber,
    NumberOfReturns,
    ScanAngle,
    UserData,
    PointSourceId,
    GpsTime,
    NearInfrared,
    /// Red, green or blue as stored.
    Color(usize),
    Extra(Extra),
}

/// An extra dimension.
#[derive(Clone, Copy)]
struct Extra {
    /// First byte in the record.
    at: usize,
    number: Number,
    /// The stored number of points that have none.
    no_data: Option<f64>,
    scale: f64,
    offset: f64,
}

/// How a number is stored, by the types of LAS: 1 to 10.
#[derive(Clone, Copy)]
struct Number(u8);

/// The fields that records of a file have, as far as they are read: times of compressed files are not. `described` are the descriptions
/// of extra bytes.
pub(super) fn fields(layout: &Layout, described: &[u8]) -> Vec<Field> {
    let format = &layout.format;
    let kinds = [
        ("return_number", Kind::ReturnNumber, true),
        ("number_of_returns", Kind::NumberOfReturns, true),
        ("scan_angle", Kind::ScanAngle, true),
        ("user_data", Kind::UserData, true),
        ("point_source_id", Kind::PointSourceId, true),
        ("gps_time", Kind::GpsTime, format.has_gps_time && !layout.compressed),
        ("nir", Kind::NearInfrared, format.has_nir),
        ("red", Kind::Color(0), format.has_color),
        ("green", Kind::Color(1), format.has_color),
        ("blue", Kind::Color(2), format.has_color),
    ];
    let there = kinds.into_iter().filter(|(.., is_there)| *is_there);
    there.map(|(name, kind, _)| Field { name: name.to_owned(), kind }).chain(extras(layout, described)).collect()
}

/// The extra dimensions of one number each that lie within the records.
fn extras(layout: &Layout, described: &[u8]) -> Vec<Field> {
    let end = layout.record as usize;
    let mut at = end - usize::from(layout.format.extra_bytes);
    let mut found = Vec::new();
    for d in described.as_chunks::<DESCRIPTION>().0 {
        let kind = d[2];
        let options = d[3];
        // Type 0 says its length in the place of options; types from 11 on are two or three numbers of the first ten.
        let (number, count) = match kind {
            0 => (Number(1), usize::from(options)),
            _ => (Number((kind - 1) % 10 + 1), usize::from((kind - 1) / 10) + 1),
        };
        let length = number.bytes() * count;
        if at + length > end {
            break;
        }
        let name = d[4..36].split(|b| *b == 0).next().unwrap_or_default();
        let eight = |at: usize| std::array::from_fn(|i| d[at + i]);
        let stated = |(at, bit): (usize, u8)| (options & bit != 0).then(|| f64::from_le_bytes(eight(at)));
        if (1..=10).contains(&kind) && !name.is_empty() {
            let no_data = (options & NO_DATA.1 != 0).then(|| number.widened().decode(&eight(NO_DATA.0)));
            let scale = stated(SCALE).unwrap_or(1.0);
            let offset = stated(OFFSET).unwrap_or(0.0);
            let extra = Extra { at, number, no_data, scale, offset };
            found.push(Field { name: String::from_utf8_lossy(name).into_owned(), kind: Kind::Extra(extra) });
        }
        at += length;
    }
    found
}

/// What a decoder of layers has to unpack for these fields beside what every file needs.
pub(super) fn selection<'a>(fields: impl Iterator<Item = &'a Field>) -> DecompressionSelection {
    let base = DecompressionSelection::base().decompress_z().decompress_classification().decompress_intensity();
    fields.fold(base.decompress_rgb(), |selection, field| match field.kind {
        Kind::ScanAngle => selection.decompress_scan_angle(),
        Kind::UserData => selection.decompress_user_data(),
        Kind::PointSourceId => selection.decompress_point_source_id(),
        Kind::NearInfrared => selection.decompress_nir(),
        Kind::Extra(_) => selection.decompress_extra_bytes(),
        // Returns lie with x and y; GPS times stay packed, since a damaged stream of them makes the decoder call itself until the stack is full.
        Kind::ReturnNumber | Kind::NumberOfReturns | Kind::Color(_) | Kind::GpsTime => selection,
    })
}

impl Field {
    /// Whether it is a part of what has a meaning: a component of the colours.
    pub(super) fn is_spare(&self) -> bool {
        matches!(self.kind, Kind::Color(_))
    }

    /// Hands its numbers to `take`, those of all records in order.
    pub(super) fn numbers(&self, data: &PointData, mut take: impl FnMut(&mut dyn Iterator<Item = f64>)) {
        match self.kind {
            Kind::ReturnNumber => take(&mut data.return_number().map(f64::from)),
            Kind::NumberOfReturns => take(&mut data.number_of_returns().map(f64::from)),
            Kind::ScanAngle => take(&mut data.scan_angle_degrees().map(f64::from)),
            Kind::UserData => take(&mut data.user_data().map(f64::from)),
            Kind::PointSourceId => take(&mut data.point_source_id().map(f64::from)),
            Kind::GpsTime => data.gps_time().into_iter().for_each(|mut times| take(&mut times)),
            Kind::NearInfrared => data.nir().into_iter().for_each(|nir| take(&mut nir.map(f64::from))),
            Kind::Color(c) => {
                data.rgb().into_iter().for_each(|rgb| take(&mut rgb.map(|(r, g, b)| f64::from([r, g, b][c]))));
            }
            Kind::Extra(extra) => {
                take(&mut data.raw_bytes().chunks_exact(data.record_len()).map(|record| extra.decode(record)));
            }
        }
    }
}

impl Extra {
    fn decode(&self, record: &[u8]) -> f64 {
        let stored = self.number.decode(&record[self.at..]);
        if self.no_data == Some(stored) { f64::NAN } else { stored * self.scale + self.offset }
    }
}

impl Number {
    fn bytes(self) -> usize {
        [1, 1, 2, 2, 4, 4, 8, 8, 4, 8][usize::from(self.0) - 1]
    }

    /// The type of eight bytes in which a description has a number of this type.
    fn widened(self) -> Self {
        Self([7, 8, 7, 8, 7, 8, 7, 8, 10, 10][usize::from(self.0) - 1])
    }

    /// The number that some bytes begin with.
    fn decode(self, bytes: &[u8]) -> f64 {
        let mut wide = [0; 8];
        wide[..self.bytes()].copy_from_slice(&bytes[..self.bytes()]);
        let bits = u64::from_le_bytes(wide);
        let unused = 64 - 8 * self.bytes();
        match self.0 {
            9 => f32::from_bits(bits as u32).into(),
            10 => f64::from_bits(bits),
            // Shifted up and down again: the sign follows.
            2 | 4 | 6 | 8 => (((bits << unused) as i64) >> unused) as f64,
            _ => bits as f64,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stored_numbers_of_all_types_are_read() {
        let cases: [(u8, &[u8], f64); 10] = [
            (1, &[200], 200.0),
            (2, &[200], -56.0),
            (3, &[1, 2], 513.0),
            (4, &[0, 128], -32768.0),
            (5, &[0, 0, 0, 128], 2_147_483_648.0),
            (6, &[255; 4], -1.0),
            (7, &[0, 0, 0, 0, 1, 0, 0, 0], 4_294_967_296.0),
            (8, &[255; 8], -1.0),
            (9, &1.5f32.to_le_bytes(), 1.5),
            (10, &(-2.25f64).to_le_bytes(), -2.25),
        ];
        for (kind, bytes, expected) in cases {
            assert_eq!(Number(kind).decode(bytes), expected, "type {kind}");
            assert_eq!(Number(kind).bytes(), bytes.len());
        }
    }
}
