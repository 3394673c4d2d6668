//! A volume: values on a lattice, what they show, where they lie.

use super::value_range::ValueRange;
use super::voxels::without_extinction;
use splat_core::glam::{DMat3, DVec3};
use splat_core::optics::{TRACE, faintest};
use splat_core::{Clip, Grid, Material, Packing, Similarity, TransferFunction};

/// One volume.
#[derive(Debug, Clone, Copy)]
pub struct Volume<'a> {
    /// Values on a lattice. Every lattice point is the centre of its cell, so the volume is the parallelepiped from −1/2 to n − 1/2
    /// in lattice coordinates.
    pub grid: &'a Grid,
    /// How the planes of `grid` lie: [`Packing::BodyCentred`] for those of a [`splat_core::BccGrid`], which fill the parallelepiped
    /// from −1/4 to n − 1/4 along i and j.
    pub packing: Packing,
    /// From the grid's space to the world.
    pub transform: Similarity,
    /// Value → colour and extinction σ_t; applied to what the sheets reconstruct.
    pub transfer: &'a TransferFunction,
    /// From the transfer function's extinction to 1/world unit, > 0.
    pub extinction_scale: f64,
    /// How light becomes radiance.
    pub material: &'a Material,
    /// Regions that it is kept in, in the grid's space: rays of the eye and of light end at their borders, and what is left shows its values there.
    pub clip: &'a [Clip],
    /// Whether light is reflected about the gradient of the values, −∇v/|∇v| being the normal.
    pub normals: bool,
    /// Object id, for the object plane of an accumulator.
    pub object: u32,
    /// Share of shadows that it receives, in \[0, 1\].
    pub shadow_coefficient: f32,
    /// Whether it attenuates light; of half-vector sheets alone, since shadows of image-aligned ones are known before.
    pub casts_shadow: bool,
}

impl Volume<'_> {
    /// Whether anything of it can be seen: whether the transfer function gives extinction to some value between its least and its
    /// greatest.
    pub fn is_seen(&self) -> bool {
        let values = ValueRange::of_values(&self.grid.values);
        !without_extinction(&self.seen()).iter().any(|unseen| unseen.holds(&values))
    }

    /// The transfer function without what can not be seen: extinctions of which no ray through the whole volume gathers more than
    /// [`splat_core::optics::FAINTEST`], and colours that are a [`TRACE`].
    pub(crate) fn seen(&self) -> TransferFunction {
        let axes = self.axes();
        let [nx, ny, nz] = self.grid.dims.map(|n| n as f64);
        let longest = axes.x_axis.length() * nx + axes.y_axis.length() * ny + axes.z_axis.length() * nz;
        let faintest = f64::from(faintest(std::slice::from_ref(self.material)));
        self.transfer.without_traces((faintest / (self.extinction_scale * longest)) as f32, TRACE)
    }

    /// Extinction about a world position, 1/world unit; 0 outside.
    pub(crate) fn extinction_at(&self, world: DVec3) -> f64 {
        let value = self.value_at(self.axes().inverse() * (world - self.origin()));
        value.map_or(0.0, |value| f64::from(self.transfer.at(value).extinction) * self.extinction_scale)
    }

    /// Value at lattice coordinates, linear between planes and in each of them; `None` outside and where it is cut away.
    pub(crate) fn value_at(&self, place: DVec3) -> Option<f32> {
        let [lowest, highest] = self.ends();
        let is_cut = || self.planes().any(|(normal, offset)| normal.dot(place) > offset);
        if place.cmplt(lowest).any() || place.cmpgt(highest).any() || is_cut() {
            return None;
        }
        let plane = |k: isize| {
            let shift = self.packing.shift(k.rem_euclid(2) as usize);
            let [x, y] = [place.x - shift, place.y - shift];
            let i = x.floor() as isize;
            let j = y.floor() as isize;
            let u = (x - x.floor()) as f32;
            let v = (y - y.floor()) as f32;
            let row = |j: isize| {
                let [a, b] = [0, 1].map(|n| self.grid.at_clamped(i + n, j, k));
                a + (b - a) * u
            };
            row(j) + (row(j + 1) - row(j)) * v
        };
        let k = place.z.floor() as isize;
        let w = (place.z - place.z.floor()) as f32;
        Some(plane(k) + (plane(k + 1) - plane(k)) * w)
    }

    /// Lattice coordinates that it lies between.
    pub(crate) fn ends(&self) -> [DVec3; 2] {
        let lowest = self.packing.lowest();
        [lowest, lowest + DVec3::from_array(self.grid.dims.map(|n| n as f64))]
    }

    /// World positions of its corners.
    pub(crate) fn corners(&self) -> [DVec3; 8] {
        let ends = self.ends();
        let origin = self.origin();
        let axes = self.axes();
        std::array::from_fn(|c| origin + axes * DVec3::from_array([0, 1, 2].map(|a| ends[c >> a & 1][a])))
    }

    /// The planes that it is cut along, in lattice coordinates: unit normals that lead out, and their products with the border.
    pub(crate) fn planes(&self) -> impl Iterator<Item = (DVec3, f64)> {
        let plane = |(normal, offset): (DVec3, f64)| {
            let of_lattice = self.grid.axes.transpose() * normal;
            let offset = offset - normal.dot(self.grid.origin);
            (of_lattice / of_lattice.length(), offset / of_lattice.length())
        };
        self.clip.iter().flat_map(Clip::half_spaces).map(plane)
    }

    /// World position of the first lattice point.
    pub(crate) fn origin(&self) -> DVec3 {
        self.transform.apply(self.grid.origin)
    }

    /// Steps of the lattice in the world, by column.
    pub(crate) fn axes(&self) -> DMat3 {
        DMat3::from_quat(self.transform.rotation) * self.grid.axes * self.transform.scale
    }
}
