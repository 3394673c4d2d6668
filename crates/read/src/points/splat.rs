//! `.splat`: Gaussians of 32 bytes each and nothing else, little endian. Place and standard deviations are three floats each, colour and
//! opacity four bytes, the rotation four bytes around 128, w first. Colours are the same from everywhere.

use super::gaussians::{CONSTANT, Gathered, Gaussian, refused};
use crate::error::{Place, ReadError};
use crate::reading::Reading;
use splat_core::RawPoints;
use splat_core::glam::DVec3;

/// Bytes of one.
const RECORD: usize = 32;

/// Reads a `.splat` file.
pub(crate) fn read(content: &[u8], reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let (records, rest) = content.as_chunks::<RECORD>();
    if records.is_empty() || !rest.is_empty() {
        let expected = "records of 32 bytes, at least one";
        let found = format!("{} bytes", content.len());
        return Err(ReadError::input(Place::Byte(0), expected, found, "the file is truncated, or no .splat file"));
    }
    let mut gathered = Gathered::new(records.len(), 0, reading.params)?;
    for (i, record) in (0u64..).zip(records) {
        if i.is_multiple_of(1 << 14) {
            reading.go_on()?;
        }
        let float = |k: usize| f64::from(f32::from_le_bytes([0, 1, 2, 3].map(|b| record[4 * k + b])));
        let share = |k: usize| f64::from(record[k]) / 255.0;
        let signed = |k: usize| (f64::from(record[k]) - 128.0) / 128.0;
        let gaussian = Gaussian {
            position: DVec3::new(float(0), float(1), float(2)),
            deviation: DVec3::new(float(3), float(4), float(5)),
            rotation: [28, 29, 30, 31].map(signed),
            opacity: share(27),
        };
        let constant = [24, 25, 26].map(|k| (share(k) - 0.5) / CONSTANT);
        gathered.push(&gaussian, [constant].into_iter()).map_err(|wrong| refused(Place::Byte(32 * i), i, wrong))?;
    }
    gathered.finish(Place::Byte(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ReadParams;
    use splat_core::glam::Vec3;

    #[test]
    fn bytes_worked_out_by_hand() {
        let mut record = Vec::new();
        for v in [1.0f32, -2.0, 3.5, 0.5, 0.25, 0.125] {
            record.extend(v.to_le_bytes());
        }
        // White, half seen, a quarter turn about z: w = z = 90/128, as long as they are equal.
        record.extend([255, 255, 255, 51, 218, 128, 128, 218]);
        let params = ReadParams::default();
        let points = read(&record, &mut Reading::new(&params, None)).unwrap();
        assert_eq!((points.exact_position(0), points.color[0]), (DVec3::new(1.0, -2.0, 3.5), [1.0; 3]));
        assert_eq!(points.gaussians.opacity, [0.2]);
        let expected = [Vec3::Y * 0.5, Vec3::X * -0.25, Vec3::Z * 0.125];
        for (axis, expected) in points.gaussians.axes[0].iter().zip(expected) {
            assert!(axis.distance(expected) < 1e-6, "{axis}");
        }
        record[28..].fill(128);
        let error = read(&record, &mut Reading::new(&params, None)).unwrap_err().to_string();
        assert!(error.contains("rotation") && error.contains("Gaussian 0"), "{error}");
    }
}
