//! The numbers of the points of all scans, as columns.

use super::bits::Numbers;
use super::damaged;
use super::document::{MAX_FIELDS, Pose, Scan};
use crate::error::{Place, ReadError};
use crate::points::direction::unit;
use crate::points::extras::{Extras, UNFIT_HINT};
use crate::points::origin;
use crate::reading::Reading;
use crate::stream::input;
use splat_core::RawPoints;
use splat_core::glam::{DVec3, Vec3};
use splat_core::srgb::linear_from_srgb;
use splat_core::text::counted;

/// Points between two looks at whether to stop.
const LOOK: u64 = 1 << 14;
/// Linear colour of points without one beside others that have one.
const GREY: [f32; 3] = [0.5; 3];
/// The column that tells scans apart.
const SCAN: &str = "scan";

const CARTESIAN: [&str; 3] = ["cartesianX", "cartesianY", "cartesianZ"];
const SPHERICAL: [&str; 3] = ["sphericalRange", "sphericalAzimuth", "sphericalElevation"];
const NORMAL: [&str; 3] = ["normalX", "normalY", "normalZ"];
const COLOR: [&str; 3] = ["colorRed", "colorGreen", "colorBlue"];
const INTENSITY: &str = "intensity";
/// Fields that are not 0 where a point has no place of either kind, no colour or no intensity.
const NONE: [&str; 4] = ["cartesianInvalidState", "sphericalInvalidState", "isColorInvalid", "isIntensityInvalid"];

/// Columns while they are filled.
pub(super) struct Columns {
    extras: Extras,
    /// Fields of all scans that are further columns, by their ranks.
    names: Vec<String>,
    positions: Vec<DVec3>,
    points: RawPoints,
    /// Whether some scan has normals, colours and intensities.
    has: [bool; 3],
    /// Scans taken.
    scans: u64,
    /// Points that the file marks as none, and such without a colour or an intensity.
    without: [u64; 3],
}

/// Where the fields of a scan are.
struct Ranks {
    place: [usize; 3],
    is_spherical: bool,
    no_place: Option<usize>,
    normal: Option<[usize; 3]>,
    /// With the lowest and the highest number.
    color: Option<([usize; 3], [[f64; 2]; 3])>,
    no_color: Option<usize>,
    intensity: Option<usize>,
    no_intensity: Option<usize>,
    /// Those of the further columns.
    further: Vec<Option<usize>>,
}

fn rank(scan: &Scan, name: &str) -> Option<usize> {
    scan.fields.iter().position(|field| field.name == name)
}

/// The ranks of three fields, if the scan has all.
fn ranks(scan: &Scan, names: [&str; 3]) -> Option<[usize; 3]> {
    let [a, b, c] = names.map(|name| rank(scan, name));
    Some([a?, b?, c?])
}

/// Refuses a number that an attribute cannot have.
fn check_attributes(
    extras: &Extras,
    names: &[String],
    number: impl Fn(usize) -> f64,
    place: u64,
    point: u64,
) -> Result<(), ReadError> {
    let unfit = |rank: usize| Some((rank, extras.unfit(rank, number(rank))?));
    extras.read().find_map(unfit).map_or(Ok(()), |(rank, expected)| {
        let found = format!("{} of {} at point {point}", number(rank), names[rank]);
        Err(ReadError { hint: UNFIT_HINT, ..damaged(place, expected, found) })
    })
}

/// Whether a field has a meaning of its own.
fn has_meaning(name: &str) -> bool {
    [CARTESIAN, SPHERICAL, NORMAL, COLOR].concat().contains(&name) || name == INTENSITY || NONE.contains(&name)
}

impl Columns {
    /// Room for the points of all scans.
    pub(super) fn new(scans: &[Scan], reading: &mut Reading<'_>) -> Result<Self, ReadError> {
        let mut names: Vec<String> = Vec::new();
        for field in scans.iter().flat_map(|scan| &scan.fields) {
            if !names.contains(&field.name) {
                names.push(field.name.clone());
            }
            if names.len() > MAX_FIELDS {
                let expected = format!("at most {MAX_FIELDS} fields of points by name");
                return Err(damaged(scans[0].place, expected, "more"));
            }
        }
        if scans.len() > 1 {
            names.push(SCAN.to_owned());
        }
        let further = names.iter().enumerate().map(|(i, name)| (i, name.as_bytes(), has_meaning(name)));
        let extras = Extras::new(further, reading.params);
        reading.notes.not_used(names.iter().filter(|name| !has_meaning(name) && *name != SCAN).map(String::as_bytes));
        let has = |names: [&str; 3]| scans.iter().any(|scan| ranks(scan, names).is_some());
        let has_intensity = scans.iter().any(|scan| rank(scan, INTENSITY).is_some());
        let has = [has(NORMAL), has(COLOR), has_intensity];
        let point_count = scans.iter().try_fold(0u64, |n, scan| n.checked_add(scan.points)).unwrap_or(u64::MAX);
        let some = has.iter().zip([12, 12, 4]).filter(|(has, _)| **has).map(|(_, bytes)| bytes).sum::<u64>();
        let bytes = 36 + extras.bytes_per_point() + some;
        input::hold("the points", point_count.saturating_mul(bytes), reading.params)?;
        let positions = Vec::new();
        let points = RawPoints::default();
        Ok(Self { extras, names, positions, points, has, scans: 0, without: [0; 3] })
    }

    fn reserve(&mut self, points: u64) -> Result<(), ReadError> {
        let n = points as usize;
        let [normal, color, value] = self.has.map(|has| if has { n } else { 0 });
        self.extras.reserve(n)?;
        input::reserve(&mut self.positions, n)?;
        input::reserve(&mut self.points.normal, normal)?;
        input::reserve(&mut self.points.color, color)?;
        input::reserve(&mut self.points.value, value)
    }

    /// Takes the points of a scan, whose fields have these bytes: enough for all of them.
    pub(super) fn take(&mut self, scan: &Scan, streams: &[Vec<u8>], reading: &Reading<'_>) -> Result<(), ReadError> {
        if scan.points > 0 {
            let ranks = self.ranks(scan)?;
            self.reserve(scan.points)?;
            let mut fields: Vec<Numbers<'_>> =
                scan.fields.iter().zip(streams).map(|(field, bytes)| Numbers::new(field.stored, bytes)).collect();
            let mut row = vec![0.0; fields.len()];
            for point in 0..scan.points {
                if point.is_multiple_of(LOOK) {
                    reading.go_on()?;
                }
                for (i, (number, field)) in row.iter_mut().zip(&mut fields).enumerate() {
                    *number = field.next().ok_or_else(|| {
                        let name = &scan.fields[i].name;
                        damaged(scan.place, format!("{name} of point {point} within its range"), "a number above it")
                    })?;
                }
                self.push(scan, &ranks, &row, point, reading)?;
            }
        }
        self.scans += 1;
        Ok(())
    }

    fn ranks(&self, scan: &Scan) -> Result<Ranks, ReadError> {
        let cartesian = ranks(scan, CARTESIAN);
        let place = cartesian.or_else(|| ranks(scan, SPHERICAL)).ok_or_else(|| {
            let expected = "fields cartesianX to Z, or sphericalRange, sphericalAzimuth and sphericalElevation";
            damaged(scan.place, expected, "fewer")
        })?;
        let limits = |ranks: [usize; 3]| {
            let field_limits =
                ranks.map(|i| scan.fields[i].range.filter(|[low, high]| low < high).unwrap_or([0.0, 1.0]));
            (ranks, scan.colors.unwrap_or(field_limits))
        };
        Ok(Ranks {
            place,
            is_spherical: cartesian.is_none(),
            no_place: rank(scan, NONE[usize::from(cartesian.is_none())]),
            normal: ranks(scan, NORMAL),
            color: ranks(scan, COLOR).map(limits),
            no_color: rank(scan, NONE[2]),
            intensity: rank(scan, INTENSITY),
            no_intensity: rank(scan, NONE[3]),
            further: self.names.iter().map(|name| rank(scan, name)).collect(),
        })
    }

    /// Takes a point with these numbers.
    fn push(
        &mut self,
        scan: &Scan,
        ranks: &Ranks,
        row: &[f64],
        point: u64,
        reading: &Reading<'_>,
    ) -> Result<(), ReadError> {
        let vector = |ranks: [usize; 3]| DVec3::from_array(ranks.map(|i| row[i]));
        let is_set = |rank: Option<usize>| rank.is_some_and(|i| row[i] != 0.0);
        let stated_place = vector(ranks.place);
        let Pose { rotation, translation } = scan.pose;
        let place = rotation * if ranks.is_spherical { cartesian(stated_place) } else { stated_place } + translation;
        if is_set(ranks.no_place) || stated_place.is_nan() {
            self.without[0] += 1;
            self.points.dropped += 1;
            return Ok(());
        }
        if !place.is_finite() {
            if reading.params.drop_invalid {
                self.points.dropped += 1;
                return Ok(());
            }
            let hint = "remove the point, or leave such points out with --drop-invalid";
            let found = format!("{stated_place} at point {point}");
            return Err(ReadError { hint, ..damaged(scan.place, "finite coordinates", found) });
        }
        let value = ranks.intensity.filter(|_| !is_set(ranks.no_intensity)).map(|i| row[i] as f32);
        if let Some(value) = value.filter(|v| !v.is_finite()) {
            let found = format!("{value} at point {point}");
            return Err(damaged(scan.place, "an intensity that fits a 32-bit float", found));
        }
        let of_scan = |rank: usize| if self.names[rank] == SCAN { self.scans as f64 } else { f64::NAN };
        let further = |rank: usize| ranks.further[rank].map_or_else(|| of_scan(rank), |field| row[field]);
        check_attributes(&self.extras, &self.names, further, scan.place, point)?;
        self.positions.push(place);
        self.extras.push(further);
        let [has_normal, has_color, has_value] = self.has;
        if has_normal {
            let normal = ranks.normal.map(vector).filter(|n| n.is_finite());
            self.points.normal.push(normal.map_or(Vec3::ZERO, |n| unit(rotation * n)));
        }
        if has_color {
            let color = ranks.color.filter(|_| !is_set(ranks.no_color));
            self.without[1] += u64::from(color.is_none());
            self.points.color.push(color.map_or(GREY, |(ranks, limits)| {
                std::array::from_fn(|c| {
                    let [low, high] = limits[c];
                    let share = (row[ranks[c]] - low) / (high - low);
                    // A number that is none is no light.
                    linear_from_srgb(if share > 0.0 { share.min(1.0) } else { 0.0 })
                })
            }));
        }
        if has_value {
            self.without[2] += u64::from(value.is_none());
            self.points.value.push(value.unwrap_or(0.0));
        }
        Ok(())
    }

    /// The columns as points.
    pub(super) fn into_points(self, reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
        let [no_place, no_color, no_intensity] = self.without;
        let remarks = &mut reading.notes.remarks;
        if self.scans > 1 {
            remarks.push(format!("{} scans, each moved to its pose", self.scans));
        }
        if no_place > 0 {
            remarks.push(format!("{} without a place: left out", counted(no_place, "point")));
        }
        if no_color > 0 {
            remarks.push(format!("{} without a colour: grey", counted(no_color, "point")));
        }
        if no_intensity > 0 {
            remarks.push(format!("{} without an intensity: it is 0", counted(no_intensity, "point")));
        }
        let (origin, position) = origin::relative(&self.positions, Place::File, |i| format!("point {i}"))?;
        let is_intensity = !self.points.value.is_empty();
        Ok(RawPoints { origin, position, is_intensity, columns: self.extras.finish(&mut reading.notes), ..self.points })
    }
}

/// The place of a range, an azimuth from x towards y, and an elevation above their plane, radians.
fn cartesian(spherical: DVec3) -> DVec3 {
    let [range, azimuth, elevation] = spherical.to_array();
    let flat = range * libm::cos(elevation);
    DVec3::new(flat * libm::cos(azimuth), flat * libm::sin(azimuth), range * libm::sin(elevation))
}
