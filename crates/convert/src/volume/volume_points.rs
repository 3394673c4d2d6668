//! Volumes become medium splats: Gunjee 2007, section 4, "Converting the volume data".
//!
//! Each voxel of extinction σ_t > 0 becomes one isotropic kernel at its place with K = σ_t·(cell volume) and
//! R = cutoff·0.8·h, h the spacing of the lattice (`resample.rs`), so that kernels of a homogeneous volume sum to
//! σ_t. Colour and extinction come from a transfer function after interpolation (post-classification), as the mean over the
//! voxel's cell where the function bends within it (`classify.rs`); normals are −∇v/|∇v| of the values by the Sobel operator.

use crate::ConvertError;
use crate::common::columns::{self, ColumnSet};
use crate::common::convert_error::check_cancelled;
use crate::common::params::SplatParams;
use crate::volume::classify::Class;
use crate::volume::keep::{Keep, Slab, longest_path};
use crate::volume::resample;
use crate::volume::sobel::{Rows, Sobel, normal_from_gradient};
use rayon::prelude::*;
use splat_core::{
    Clip, Cloud, Grid, Progress, SplatKind, TransferFunction,
    glam::{DVec3, Vec3},
};

/// Parameters of the conversion of a volume to splats.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeParams {
    /// Attributes and limits; `color` is not used.
    pub splat: SplatParams,
    /// Each step of the lattice is split this often, ≥ 1, beyond what makes the steps alike.
    pub refine: u32,
    /// Whether to split long steps of the lattice so that kernels fit; without, they are as wide as the longest step.
    pub even_steps: bool,
    /// Whether splats get normals.
    pub normals: bool,
    /// Whether splats keep the value they were made from.
    pub values: bool,
    /// Optical depth that leaving out thin voxels may cost any straight ray, ≥ 0.
    pub omitted_optical_depth: f64,
    /// Tolerated error of the optical depth across a cell, ≥ 0, from a transfer function that is evaluated at the voxel
    /// alone. Cells with a larger possible error take the mean of the transfer function.
    pub classification_error: f64,
    /// The regions to keep, object space. A cell that their borders cross has the extinction of the part of it that is kept.
    pub clip: Vec<Clip>,
}

impl Default for VolumeParams {
    fn default() -> Self {
        Self {
            splat: SplatParams::default(),
            refine: 1,
            even_steps: true,
            normals: false,
            values: false,
            omitted_optical_depth: 0.0,
            classification_error: 2.0f64.powi(-11),
            clip: Vec::new(),
        }
    }
}

impl VolumeParams {
    /// Which columns the splats fill.
    pub(crate) fn column_set(&self) -> ColumnSet {
        ColumnSet { normal: self.normals, value: self.values, ..ColumnSet::default() }
    }

    /// Checks what does not depend on the volume.
    pub(crate) fn check(&self) -> Result<(), ConvertError> {
        self.splat.check()?;
        self.clip.iter().try_for_each(Clip::validate).map_err(|e| self.splat.input(e))?;
        let depths = [
            ("omitted_optical_depth", self.omitted_optical_depth),
            ("classification_error", self.classification_error),
        ];
        match depths.into_iter().find(|(_, depth)| !(depth.is_finite() && *depth >= 0.0)) {
            Some((name, depth)) => Err(self.splat.bad(name, depth, "a finite number ≥ 0")),
            None => Ok(()),
        }
    }
}

/// The report of a volume's conversion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VolumeReport {
    /// Voxels of the grid.
    pub voxels: u64,
    /// Lattice points after long steps were split.
    pub lattice_points: u64,
    /// Splats made.
    pub splats: u64,
    /// Splats whose colour and extinction are means over their cell, or of the part of it that is kept.
    pub averaged: u64,
    /// Lattice points with some extinction that were left out as too thin.
    pub omitted: u64,
    /// Most optical depth that a straight ray lost by that; at most the parameter.
    pub omitted_optical_depth: f64,
    /// Splats without a normal although normals were requested: the gradient vanishes there.
    pub without_normal: u64,
    /// Spacing h that the kernels follow, world units.
    pub spacing: f64,
    /// Cutoff radius of every splat, world units.
    pub radius: f64,
}

/// Makes a cloud of medium splats from a volume; extinction of the transfer function is per world unit.
///
/// ```
/// use convert::{VolumeParams, volume_to_points};
/// use splat_core::{Grid, TransferFunction, TransferPoint, glam::{DMat3, DVec3}};
/// let grid = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [4, 4, 4], values: vec![1.0; 64] };
/// let point = |value, extinction| TransferPoint { value, color: [1.0; 3], extinction };
/// let tf = TransferFunction::new(vec![point(0.0, 0.0), point(1.0, 0.5)]).unwrap();
/// let (cloud, report) = volume_to_points(&grid, &tf, &VolumeParams::default(), None).unwrap();
/// assert_eq!(report.splats, 64);
/// assert_eq!(cloud.cross_section.iter().sum::<f32>(), 32.0);
/// ```
///
/// Lattice points are reported to `progress`, each twice (chosen, written), and work stops where that is cancelled.
///
/// # Errors
/// [`ConvertError::Parameter`], [`ConvertError::Input`], [`ConvertError::Limit`] before memory is taken, or
/// [`ConvertError::Cancelled`].
pub fn volume_to_points(
    grid: &Grid,
    tf: &TransferFunction,
    params: &VolumeParams,
    progress: Option<&Progress>,
) -> Result<(Cloud, VolumeReport), ConvertError> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let p = &params.splat;
    params.check()?;
    grid.validate().map_err(|e| p.input(e))?;
    let factors = lattice_factors(grid, params)?;
    let fine = (factors != [1; 3]).then(|| resample::resample(grid, [0, 1, 2].map(|a| grid.dims[a] * factors[a])));
    let lattice = fine.as_ref().unwrap_or(grid);
    let spacing = p.check_spacing(resample::kernel_spacing(&lattice.axes) * p.transform.scale)?;
    let report = VolumeReport {
        voxels: grid.values.len() as u64,
        lattice_points: lattice.values.len() as u64,
        spacing,
        radius: p.radius(spacing),
        ..VolumeReport::default()
    };
    progress.add_total(2 * report.lattice_points);
    convert(lattice, tf, params, report, progress)
}

/// How often each step of the grid is split.
pub(crate) fn lattice_factors(grid: &Grid, params: &VolumeParams) -> Result<[usize; 3], ConvertError> {
    let factors = if params.even_steps {
        resample::factors(&grid.axes, params.refine)
    } else {
        [params.refine.max(1) as usize; 3]
    };
    check_lattice(&params.splat, [0, 1, 2].map(|a| grid.dims[a] as f64 * factors[a] as f64))?;
    Ok(factors)
}

/// Refuses lattices of more than [`most_lattice_points`].
pub(crate) fn check_lattice(p: &SplatParams, dims: [f64; 3]) -> Result<(), ConvertError> {
    p.check_limit(dims[0] * dims[1] * dims[2], most_lattice_points(p), "lattice points")
}

/// More values than that no budget can mean to keep: eight a splat.
pub(crate) fn most_lattice_points(p: &SplatParams) -> u64 {
    p.limits.max_elements.saturating_mul(8).min(u32::MAX.into())
}

fn convert(
    lattice: &Grid,
    tf: &TransferFunction,
    params: &VolumeParams,
    mut report: VolumeReport,
    progress: &Progress,
) -> Result<(Cloud, VolumeReport), ConvertError> {
    let p = &params.splat;
    let scale = p.transform.scale;
    let longest_path = longest_path(lattice) * scale;
    let keep = Keep::new(tf, lattice, params);
    let slabs = keep.slabs(progress)?;
    let n: usize = slabs.iter().map(|s| s.kept.len()).sum();
    p.check_count(n as f64)?;
    report.splats = n as u64;
    report.averaged = slabs.iter().map(|s| s.averaged.len() as u64).sum();
    report.omitted = slabs.iter().map(|s| s.omitted).sum();
    report.omitted_optical_depth = slabs.iter().fold(0.0f64, |m, s| m.max(f64::from(s.thickest))) * longest_path;
    let mut cloud = Cloud::new(p.transform.apply(lattice.origin));
    let filled = params.column_set();
    columns::size_columns(&mut cloud, n, SplatKind::Medium, filled, p)?;
    cloud.radius.par_iter_mut().with_min_len(columns::CHUNK).for_each(|r| *r = report.radius as f32);
    let emit = Emit { lattice, tf, params, sobel: Sobel::new(lattice), cell: lattice.cell_volume() * scale.powi(3) };
    report.without_normal = emit.run(&slabs, &mut cloud, progress)?;
    Ok((cloud, report))
}

/// Writes the splats of the kept lattice points.
struct Emit<'a> {
    lattice: &'a Grid,
    tf: &'a TransferFunction,
    params: &'a VolumeParams,
    sobel: Sobel<'a>,
    /// Cell volume, world units³.
    cell: f64,
}

/// The columns of one slab.
struct Target<'a> {
    position: &'a mut [Vec3],
    cross_section: &'a mut [f32],
    color: &'a mut [[f32; 3]],
    normal: &'a mut [Vec3],
    value: &'a mut [f32],
}

impl Emit<'_> {
    /// Returns how many splats have no normal although they should.
    fn run(&self, slabs: &[Slab], cloud: &mut Cloud, progress: &Progress) -> Result<u64, ConvertError> {
        let mut rest = Target {
            position: &mut cloud.position,
            cross_section: &mut cloud.cross_section,
            color: &mut cloud.color,
            normal: &mut cloud.normal,
            value: &mut cloud.value,
        };
        let mut tasks = Vec::with_capacity(slabs.len());
        for slab in slabs {
            let (head, tail) = rest.split_at(slab.kept.len());
            tasks.push(head);
            rest = tail;
        }
        let slab_points = self.lattice.dims[0] * self.lattice.dims[1];
        let scratch =
            || (Rows::default(), if self.params.normals { vec![Vec3::ZERO; slab_points] } else { Vec::new() });
        let without_normal = tasks
            .into_par_iter()
            .zip(slabs)
            .enumerate()
            // Scratch is made once a run of slabs.
            .with_min_len(8)
            .map_init(scratch, |(rows, gradient), (k, (mut target, slab))| {
                if progress.tick(slab_points as u64).is_err() {
                    return 0;
                }
                self.slab(k, slab, &mut target);
                let (true, Some(first), Some(last)) = (self.params.normals, slab.kept.first(), slab.kept.last()) else {
                    return 0;
                };
                let row = |n: &u32| *n as usize / self.lattice.dims[0];
                self.sobel.slab(k, row(first)..row(last) + 1, rows, gradient);
                self.normals(slab, gradient, target.normal)
            })
            .sum();
        check_cancelled(progress).map(|()| without_normal)
    }

    fn slab(&self, k: usize, slab: &Slab, target: &mut Target<'_>) {
        let t = &self.params.splat.transform;
        let nx = self.lattice.dims[0];
        let axes = splat_core::glam::DMat3::from_quat(t.rotation) * self.lattice.axes * t.scale;
        let base = axes.z_axis * k as f64;
        let values = &self.lattice.values[k * nx * self.lattice.dims[1]..];
        let mut averaged = slab.averaged.iter().peekable();
        for (s, &n) in slab.kept.iter().enumerate() {
            let i = n as usize % nx;
            let j = n as usize / nx;
            let at = match averaged.next_if(|(rank, _)| *rank as usize == s) {
                Some((_, mean)) => *mean,
                None => {
                    let at = self.tf.at(values[n as usize]);
                    Class { color: at.color, extinction: at.extinction }
                }
            };
            target.position[s] = (base + axes.y_axis * j as f64 + axes.x_axis * i as f64).as_vec3();
            target.cross_section[s] = (f64::from(at.extinction) * self.cell) as f32;
            target.color[s] = at.color;
            if let Some(value) = target.value.get_mut(s) {
                *value = values[n as usize];
            }
        }
    }

    fn normals(&self, slab: &Slab, gradient: &[Vec3], normal: &mut [Vec3]) -> u64 {
        let mut without = 0;
        for (out, &n) in normal.iter_mut().zip(&slab.kept) {
            let unit = normal_from_gradient(gradient[n as usize]);
            without += u64::from(unit == DVec3::ZERO);
            *out = self.params.splat.transform.rotate(unit).as_vec3();
        }
        without
    }
}

impl<'a> Target<'a> {
    /// The first `n` splats and the rest; columns that are not wanted stay empty.
    fn split_at(self, n: usize) -> (Self, Self) {
        let (position, p) = self.position.split_at_mut(n);
        let (cross_section, x) = self.cross_section.split_at_mut(n);
        let (color, c) = self.color.split_at_mut(n);
        let (normal, m) = self.normal.split_at_mut(n.min(self.normal.len()));
        let (value, v) = self.value.split_at_mut(n.min(self.value.len()));
        let head = Target { position, cross_section, color, normal, value };
        (head, Target { position: p, cross_section: x, color: c, normal: m, value: v })
    }
}
