//! Columns of a cloud, sized once and filled in parallel.

use crate::splats::footprints::check_kind;
use crate::{ConvertError, SplatParams};
use bytemuck::Zeroable;
use rayon::prelude::*;
use splat_core::{Cloud, Gaussians, SplatKind, glam::Vec3};
use std::sync::Arc;

/// Splats per parallel task; fixed, so that results do not depend on the thread count.
pub(crate) const CHUNK: usize = 1 << 14;

/// Which optional columns a conversion fills.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ColumnSet {
    /// Unit normals.
    pub(crate) normal: bool,
    /// Normals of shading.
    pub(crate) shading_normal: bool,
    /// Semi-axes of discs.
    pub(crate) tangent: bool,
    /// Shares of shadows.
    pub(crate) shadow_coefficient: bool,
    /// Physical values.
    pub(crate) value: bool,
    /// Optical depths of one crossing, for translucent surfaces.
    pub(crate) crossing_depth: bool,
    /// Gaussians with harmonics of this degree.
    pub(crate) gaussian: Option<u8>,
}

impl ColumnSet {
    /// Bytes of one splat in all columns.
    pub(crate) fn bytes_per_splat(self) -> u64 {
        let required = size_of::<Vec3>() + 2 * size_of::<f32>() + size_of::<[f32; 3]>();
        let ids = size_of::<SplatKind>() + size_of::<u16>() + size_of::<u8>() + size_of::<u32>();
        let vectors = [self.normal, self.shading_normal, self.tangent].map(usize::from).iter().sum::<usize>();
        let numbers = [self.shadow_coefficient, self.value, self.crossing_depth].map(usize::from).iter().sum::<usize>();
        let optional = vectors * size_of::<Vec3>() + numbers * size_of::<f32>();
        let of_gaussian = self.gaussian.map_or(0, |degree| size_of::<u32>() as u64 + Gaussians::bytes_each(degree));
        (required + ids + optional) as u64 + of_gaussian
    }
}

/// Gives every column `n` entries: constants are filled in, the rest is left for the conversion to write. Memory that
/// `cloud` holds already is used again.
pub(crate) fn size_columns(
    cloud: &mut Cloud,
    n: usize,
    kind: SplatKind,
    columns: ColumnSet,
    params: &SplatParams,
) -> Result<(), ConvertError> {
    check_kind(kind, params)?;
    params.check_cloud(n as f64, columns)?;
    let full = |_| params.exceeded(n as f64 * columns.bytes_per_splat() as f64, None, "bytes");
    sized(&mut cloud.position, n).map_err(full)?;
    sized(&mut cloud.radius, n).map_err(full)?;
    sized(&mut cloud.cross_section, n).map_err(full)?;
    sized(&mut cloud.color, n).map_err(full)?;
    sized(&mut cloud.normal, if columns.normal { n } else { 0 }).map_err(full)?;
    sized(&mut cloud.shading_normal, if columns.shading_normal { n } else { 0 }).map_err(full)?;
    sized(&mut cloud.tangent, if columns.tangent { n } else { 0 }).map_err(full)?;
    sized(&mut cloud.shadow_coefficient, if columns.shadow_coefficient { n } else { 0 }).map_err(full)?;
    sized(&mut cloud.value, if columns.value { n } else { 0 }).map_err(full)?;
    sized(&mut cloud.crossing_depth, if columns.crossing_depth { n } else { 0 }).map_err(full)?;
    constant(&mut cloud.kind, n, kind);
    constant(&mut cloud.material, n, params.material);
    constant(&mut cloud.footprint, n, params.footprint);
    constant(&mut cloud.object, n, params.object);
    sized(&mut cloud.gaussian, if columns.gaussian.is_some() { n } else { 0 }).map_err(full)?;
    cloud.gaussians = Arc::default();
    Ok(())
}

/// `n` entries of any content; fresh memory comes zeroed from the system, page by page, to whichever thread writes it.
fn sized<T: Zeroable + Clone>(column: &mut Vec<T>, n: usize) -> Result<(), ()> {
    if column.capacity() >= n {
        column.resize(n, T::zeroed());
    } else {
        *column = bytemuck::try_zeroed_vec(n)?;
    }
    Ok(())
}

fn constant<T: Copy + PartialEq + Sync>(column: &mut Vec<T>, n: usize, value: T) {
    let same = |chunk: &[T]| chunk.iter().fold(true, |same, v| same & (*v == value));
    if column.len() == n && column.par_chunks(CHUNK).all(same) {
        return;
    }
    // A fresh vector of zeros costs nothing until it is read.
    *column = vec![value; n];
}

/// The unit vector along `v`, or zero where it has none.
pub(crate) fn unit_or_zero(v: Vec3) -> Vec3 {
    v.as_dvec3().try_normalize().map_or(Vec3::ZERO, |u| u.as_vec3())
}
