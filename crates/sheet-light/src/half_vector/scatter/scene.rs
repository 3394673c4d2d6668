//! The media that light is scattered in, the light that falls on them, and what stands between.

use super::beam::{Beam, Path};
use super::grid::{Column, GridPlace, LightGrid};
use super::medium;
use super::medium::Cell;
use super::phase;
use super::streams::{Sources, Streams};
use super::through_splats;
use crate::Volume;
use crate::half_vector::input::HalfSplats;
use crate::half_vector::light::camera::camera_of;
use crate::half_vector::params::HalfParams;
use crate::half_vector::slicing::bodies::Bodies;
use splat_core::glam::{DVec3, Vec3};
use splat_core::shade::LitBy;
use splat_core::{Light, Receiver, SplatKind};

/// The media, the light that falls on them, and what stands between.
pub(crate) struct Scene {
    pub(crate) grid: LightGrid,
    pub(crate) cells: Vec<Cell>,
    /// Power that enters each column, by channel, of a light of intensity 1.
    entering: [Vec<f64>; 3],
    others: Vec<[f32; 3]>,
    cone: f64,
}

/// Power per channel that enters a column of this area at its first face.
pub(crate) fn entering(lit: &LitBy<'_>, place: DVec3, area: f64) -> [f64; 3] {
    let irradiance = lit.light.irradiance(place, 0.0).irradiance;
    // A column of even width has this deviation.
    let passing = lit.slide.map_or([1.0; 3], |slide| slide.passing(place, (area / 12.0).sqrt()));
    [0, 1, 2].map(|c| f64::from(irradiance[c] * passing[c]) * area)
}

impl Scene {
    /// `shadow_origin`: what places of shadows are relative to.
    pub(crate) fn new(
        volumes: &[Volume<'_>],
        splats: Option<&HalfSplats<'_>>,
        lit: &LitBy<'_>,
        params: &HalfParams,
        shadow_origin: DVec3,
    ) -> Self {
        let camera = camera_of(&Bodies::volumes(volumes), &lit.light, params);
        let (grid, cells) = medium::resolved(volumes, &camera, params);
        let [width, height] = grid.columns;
        let layers = grid.layers;
        let one = Light { intensity: [1.0; 3], ..lit.light };
        let area = grid.area(0.0);
        let lit_by_one = LitBy { light: one, ..*lit };
        let entering = |channel: usize| {
            let column = |k: usize| {
                let place = grid.world(GridPlace { x: (k % width) as f64, y: (k / width) as f64, face: 0.0 });
                entering(&lit_by_one, place, area)[channel]
            };
            (0..width * height).map(column).collect()
        };
        let others = |shadow: &dyn splat_core::Transmittance| {
            let face = |k: usize| {
                let [x, y, face] = [k % width, k / (width * (layers + 1)), k / width % (layers + 1)];
                let world = grid.world(GridPlace { x: x as f64, y: y as f64, face: face as f64 });
                let position = (world - shadow_origin).as_vec3();
                let radius = (0.5 * grid.depth) as f32;
                shadow.transmittance(&Receiver { position, normal: Vec3::ZERO, radius, kind: SplatKind::Medium })
            };
            (0..width * height * (layers + 1)).map(face).collect()
        };
        let mut others = lit.shadow.map_or_else(Vec::new, others);
        if let Some(splats) = splats {
            let through = through_splats::through(splats, &grid, &camera);
            if others.is_empty() {
                others = through;
            } else {
                others.iter_mut().zip(through).for_each(|(to, share)| (0..3).for_each(|c| to[c] *= share[c]));
            }
        }
        Self {
            entering: [0, 1, 2].map(entering),
            others,
            cone: params.cone.unwrap_or_else(|| phase::cone_of(params.scattering, medium::mean_asymmetry(&cells))),
            cells,
            grid,
        }
    }

    pub(super) fn path(&self) -> Path<'_> {
        let Self { grid, cells, entering, others, cone } = self;
        Path { grid, cells, entering, others, cone: *cone }
    }

    /// What all but the volumes let through, by cell; empty for all.
    fn passing(&self, channel: usize) -> Vec<f64> {
        if self.others.is_empty() {
            return Vec::new();
        }
        let [width, _] = self.grid.columns;
        let layers = self.grid.layers;
        let cell = |k: usize| {
            let column = Column { x: k % width, y: k / (width * layers) };
            self.path().passing(k / width % layers, column, channel)
        };
        (0..self.grid.cells()).map(cell).collect()
    }

    /// The beam of a channel, and the equations of what it gives to two streams.
    pub(crate) fn streams(&self, channel: usize) -> (Beam, Streams) {
        let beam = self.path().march(channel);
        let passing = self.passing(channel);
        let grid = &self.grid;
        let cells = &self.cells[..];
        let streams = Streams::new(&Sources { grid, cells, channel, incoming: &beam.incoming, passing: &passing });
        (beam, streams)
    }

    /// Whether a channel is the same as another.
    pub(super) fn is_like(&self, channel: usize, other: usize) -> bool {
        let same = |v: &[f32; 3]| v[channel] == v[other];
        let cell = |c: &Cell| [&c.extinction, &c.scattering, &c.forward, &c.ahead].into_iter().all(same);
        self.entering[channel] == self.entering[other] && self.cells.iter().all(cell) && self.others.iter().all(same)
    }
}
