//! Primitives of `KHR_gaussian_splatting`: 3D Gaussians as attributes of points, or as a file of SPZ in a buffer view.
//!
//! Rotations are quaternions x, y, z, w; scales deviations, of which drafts of the extension had the logarithms; opacities numbers from 0 to
//! 1; harmonics an attribute for each coefficient. A file of SPZ has the axes of the primitive.

use super::accessor::Buffers;
use super::document::{GaussianExtension, Primitive, SpzExtension};
use super::nodes::Instance;
use super::wrong;
use crate::error::{Place, ReadError};
use crate::points::gaussians::{CONSTANT, Gathered, Gaussian, exponentials, refused};
use crate::points::{origin, spz};
use crate::reading::Reading;
use crate::stream::input;
use crate::stream::input::Stream;
use splat_core::glam::{DMat3, DMat4, DQuat, DVec3};
use splat_core::srgb::encoded;
use splat_core::text::escaped;
use splat_core::{Gaussians, RawPoints, Similarity};

/// Extensions of Gaussians in a file, in the order of their drafts.
pub(super) const EXTENSIONS: [&str; 3] =
    ["KHR_gaussian_splatting", "KHR_gaussian_splatting_compression_spz_2", "KHR_spz_gaussian_splats_compression"];

/// Bytes that a Gaussian takes beside its table while its attributes are read: 59 numbers as stored, and its place.
const BYTES_BESIDE: u64 = 59 * 4 + 24 + 12;
/// Most by which the axes of a node may differ in length, and their cosines from nothing, as shares of one.
const EVEN: f64 = 1e-4;

/// Whether a primitive is one of Gaussians.
pub(super) fn is_one(primitive: &Primitive) -> bool {
    primitive.extensions.gaussians.is_some() || primitive.extensions.spz.is_some()
}

/// All Gaussians of a scene as points.
pub(super) fn read(
    primitives: &[(&Primitive, &Instance<'_>)],
    buffers: &Buffers<'_>,
    reading: &mut Reading<'_>,
) -> Result<RawPoints, ReadError> {
    let mut positions: Vec<DVec3> = Vec::new();
    let mut gathered = RawPoints::default();
    for (primitive, instance) in primitives {
        reading.go_on()?;
        let points = primitive_points(primitive, buffers, reading)?;
        let similarity = similarity(&instance.scene_from_mesh)?;
        let held = (positions.len() + points.len()) as u64;
        let degree = gathered.gaussians.degree.max(points.gaussians.degree);
        let each = (size_of::<DVec3>() + size_of::<[f32; 3]>()) as u64 + Gaussians::bytes_each(degree);
        input::hold("the Gaussians of all primitives", held.saturating_mul(2 * each), reading.params)?;
        positions.extend((0..points.len()).map(|i| similarity.apply(points.exact_position(i))));
        gathered.dropped += points.dropped;
        gathered.color.extend(&points.color);
        append(&mut gathered.gaussians, points.gaussians.transformed(&similarity));
    }
    let (origin, position) = origin::relative(&positions, Place::File, |i| format!("Gaussian {i}"))?;
    Ok(RawPoints { origin, position, ..gathered })
}

/// Appends Gaussians; those of the lower degree get zeros.
fn append(to: &mut Gaussians, from: Gaussians) {
    let degree = to.degree.max(from.degree);
    let terms = (usize::from(degree) + 1).pow(2);
    let raised = |gaussians: &Gaussians| -> Vec<[f32; 3]> {
        let padded =
            |given: &[[f32; 3]]| (0..terms).map(|k| given.get(k).copied().unwrap_or_default()).collect::<Vec<_>>();
        gaussians.harmonics.chunks_exact(gaussians.terms()).flat_map(padded).collect()
    };
    if degree > to.degree {
        to.harmonics = raised(to);
        to.degree = degree;
    }
    if degree > from.degree {
        to.harmonics.extend(raised(&from));
    } else {
        to.harmonics.extend(from.harmonics);
    }
    to.axes.extend(from.axes);
    to.opacity.extend(from.opacity);
}

/// The transform of a node, which has to keep the shapes of Gaussians and the directions of their colours.
fn similarity(scene_from_mesh: &DMat4) -> Result<Similarity, ReadError> {
    let axes = DMat3::from_mat4(*scene_from_mesh);
    let lengths = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::length);
    let scale = lengths[0];
    let is_even = scale > 0.0
        && lengths.iter().all(|length| (length / scale - 1.0).abs() <= EVEN)
        && [(0, 1), (0, 2), (1, 2)].iter().all(|(i, j)| axes.col(*i).dot(axes.col(*j)).abs() <= EVEN * scale * scale)
        && axes.determinant() > 0.0;
    if !is_even {
        let hint = "apply the transform of the node to its Gaussians, or scale it evenly";
        let expected = "a node of 3D Gaussians that is moved, turned and scaled by one number";
        return Err(ReadError::input(Place::File, expected, "one that is stretched, skewed or mirrored", hint));
    }
    let rotation = DQuat::from_mat3(&(axes * scale.recip())).normalize();
    Ok(Similarity { scale, rotation, translation: scene_from_mesh.w_axis.truncate() })
}

fn primitive_points(
    primitive: &Primitive,
    buffers: &Buffers<'_>,
    reading: &mut Reading<'_>,
) -> Result<RawPoints, ReadError> {
    if let Some(mode) = primitive.mode.filter(|mode| *mode != super::primitive::POINTS) {
        return Err(wrong("3D Gaussians in a primitive of points (mode 0)".to_owned(), format!("mode {mode}")));
    }
    let stated = primitive.extensions.gaussians.as_ref();
    let compressed = stated.and_then(|stated| stated.extensions.spz.as_ref()).or(primitive.extensions.spz.as_ref());
    if let Some(stated) = stated {
        say(stated, reading);
    }
    if let Some(SpzExtension { buffer_view }) = compressed {
        return packed(buffers.view(*buffer_view)?, *buffer_view, reading);
    }
    attributes(primitive, stated, buffers, reading)
}

/// Names what the extension states and the picture does not follow.
fn say(stated: &GaussianExtension, reading: &mut Reading<'_>) {
    let facts = [
        ("kernel", &stated.kernel, &["ellipse"][..]),
        ("projection", &stated.projection, &["perspective"]),
        ("sortingMethod", &stated.sorting_method, &["cameraDistance", "zDepth"]),
        ("colorSpace", &stated.color_space, &["srgb_rec709_display", "lin_rec709_display", "BT.709"]),
    ];
    for (name, value, known) in facts {
        let Some(value) = value.as_deref().filter(|value| !known.contains(value)) else { continue };
        let shown = escaped(value.as_bytes(), 40);
        reading.notes.remark(format!("its {name} '{shown}' is not known: {} is taken in its place", known[0]));
    }
    reading.notes.not_used(stated.extensions.others.keys().map(String::as_bytes));
}

/// A file of SPZ in a buffer view.
fn packed(content: &[u8], view: usize, reading: &mut Reading<'_>) -> Result<RawPoints, ReadError> {
    let unpacked;
    let mut bytes = content;
    if content.starts_with(&[0x1f, 0x8b]) {
        unpacked = Stream::in_memory(content, reading.params).gunzip().rest()?;
        bytes = &unpacked;
    }
    spz::read(bytes, reading).map_err(|e| {
        let expected = format!("{} in the SPZ file of buffer view {view}", e.expected);
        ReadError { expected, place: Place::File, ..e }
    })
}

/// Gaussians of attributes.
fn attributes(
    primitive: &Primitive,
    stated: Option<&GaussianExtension>,
    buffers: &Buffers<'_>,
    reading: &mut Reading<'_>,
) -> Result<RawPoints, ReadError> {
    let find = |name: &str| primitive.attributes.get(name).copied();
    let of_extension = |name: &str| find(&format!("{}:{name}", EXTENSIONS[0]));
    let needed = |name: &str| {
        of_extension(name)
            .ok_or_else(|| wrong(format!("an attribute {}:{name} of 3D Gaussians", EXTENSIONS[0]), "none".into()))
    };
    let place = find("POSITION").ok_or_else(|| wrong("an attribute POSITION of 3D Gaussians".into(), "none".into()))?;
    let held = buffers.count(place).saturating_mul(BYTES_BESIDE);
    let _held = reading.params.memory.take("a primitive of Gaussians", held)?;
    let positions = buffers.vectors::<3>(place, "POSITION", reading)?;
    let rotations = buffers.vectors::<4>(needed("ROTATION")?, "ROTATION", reading)?;
    let scales = buffers.vectors::<3>(needed("SCALE")?, "SCALE", reading)?;
    let opacities = buffers.vectors::<1>(needed("OPACITY")?, "OPACITY", reading)?;
    let degree = degree(&of_extension)?;
    let mut harmonics = Vec::new();
    for band in 0..=degree {
        for k in 0..2 * band + 1 {
            let name = format!("SH_DEGREE_{band}_COEF_{k}");
            harmonics.push(buffers.vectors::<3>(needed(&name)?, &name, reading)?);
        }
    }
    let count = positions.len();
    let lengths = [rotations.len(), scales.len(), opacities.len()].into_iter().chain(harmonics.iter().map(Vec::len));
    if let Some(other) = lengths.into_iter().find(|length| *length != count) {
        return Err(wrong(format!("{count} entries of each attribute of 3D Gaussians"), other.to_string()));
    }
    let is_logarithm = scales.as_flattened().iter().any(|scale| *scale < 0.0);
    if is_logarithm {
        reading.notes.remark(
            "its scales are below 0: they are read as natural logarithms, as drafts of KHR_gaussian_splatting had them",
        );
    }
    let is_linear = stated.and_then(|stated| stated.color_space.as_deref()) == Some("lin_rec709_display");
    if is_linear && degree > 0 {
        reading
            .notes
            .remark("its colours are linear: how they change with the direction is exact near their mean alone");
    }
    let mut gathered = Gathered::new(count, degree, reading.params)?;
    for i in 0..count {
        if i.is_multiple_of(1 << 14) {
            reading.go_on()?;
        }
        let [x, y, z, w] = rotations[i].map(f64::from);
        let scale = DVec3::from_array(scales[i].map(f64::from));
        let gaussian = Gaussian {
            position: DVec3::from_array(positions[i].map(f64::from)),
            deviation: if is_logarithm { exponentials(scale) } else { scale },
            rotation: [w, x, y, z],
            opacity: f64::from(opacities[i][0]),
        };
        let stored = |k: usize| harmonics[k][i].map(f64::from);
        let constant = stored(0);
        let harmonic = |k: usize| match (is_linear, k) {
            (false, k) => stored(k),
            (true, 0) => constant.map(|c| (encoded((0.5 + CONSTANT * c).max(0.0)) - 0.5) / CONSTANT),
            (true, k) => std::array::from_fn(|c| stored(k)[c] * slope(0.5 + CONSTANT * constant[c])),
        };
        let taken = gathered.push(&gaussian, (0..harmonics.len()).map(harmonic));
        taken.map_err(|reason| refused(Place::File, i as u64, reason))?;
    }
    gathered.finish(Place::File)
}

/// The highest degree whose coefficients an attribute names.
fn degree(find: &dyn Fn(&str) -> Option<usize>) -> Result<u8, ReadError> {
    let has = |band: u8| (0..2 * band + 1).any(|k| find(&format!("SH_DEGREE_{band}_COEF_{k}")).is_some());
    Ok((1..=Gaussians::MOST_DEGREE).rev().find(|band| has(*band)).unwrap_or(0))
}

/// How fast the displayed number of a linear colour changes with it.
fn slope(linear: f64) -> f64 {
    /// Half of the distance over which it is measured: single precision holds it.
    const HALF: f64 = 1.0 / 1024.0;
    let low = (linear - HALF).max(0.0);
    let high = (linear + HALF).max(2.0 * HALF);
    (encoded(high) - encoded(low)) / (high - low)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_that_of_the_curve() {
        // Of the linear part 12.92; at 1 the derivative of 1.055·x^(1/2.4).
        assert!((slope(0.0) - 12.92).abs() < 1e-9);
        assert!((slope(1.0) - 1.055 / 2.4).abs() < 1e-5);
    }

    #[test]
    fn transforms_that_change_shapes_are_refused() {
        let turn = DQuat::from_rotation_x(0.7);
        let even = DMat4::from_scale_rotation_translation(DVec3::splat(2.0), turn, DVec3::X);
        let found = similarity(&even).unwrap();
        assert!((found.scale - 2.0).abs() < 1e-12 && found.rotation.dot(turn).abs() > 1.0 - 1e-12);
        for scale in [DVec3::new(1.0, 1.0, 2.0), DVec3::new(1.0, 1.0, -1.0), DVec3::ZERO] {
            assert!(similarity(&DMat4::from_scale(scale)).is_err(), "{scale}");
        }
    }
}
