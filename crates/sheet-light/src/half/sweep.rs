//! One light's sweep over all slabs: the eye's sheets, then the light's (the loop of the pseudocode, steps 9 to 24).

use super::axis::HalfVector;
use super::band::{Band, ROWS};
use super::bodies::Bodies;
use super::buckets::{Buckets, records};
use super::counts::HalfCounts;
use super::eye_buffer::Pixels;
use super::eye_sheets::{EyeBand, OneSlab, Step, WHOLE};
use super::frame::Frame;
use super::gradient::Gradients;
use super::illuminate::Illumination;
use super::light_buffer::{LightBuffer, planes};
use super::light_depth::{Beside, LightDepths};
use super::light_path::LightPath;
use super::pane_sheets::PaneSheets;
use super::penumbra::Penumbra;
use super::placed::Placed;
use super::polygon_light::{PolygonImage, PolygonLight, PolygonSlabs};
use super::polygons::Eye;
use super::scatter::{self, Scattered, Scene, SurfaceLight};
use super::serves::axis_of_view;
use super::shade::{is_lit, reflects};
use super::sight::{Shape, Sight};
use super::splat_light::SplatLight;
use super::splats::{Lamps, SplatSheets};
use super::{HalfInput, HalfParams, HalfSplats, fold, lamp};
use crate::error::cancelled;
use crate::gradient_volume::GradientVolume;
use crate::shadows::Shadows;
use crate::visible::Voxels;
use crate::{Error, Params, Volume};
use rayon::prelude::*;
use splat_core::glam::Vec3;
use splat_core::raster::pulp;
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{Accumulator, Light, LightShape, Progress, Transmittance};

/// What is known of a volume at the voxels that matter.
pub(crate) struct Known {
    pub(crate) voxels: Voxels,
    /// Shadows of what light is not carried through, where a light has any.
    pub(crate) shadows: Option<Shadows>,
    /// Where normals come from that.
    pub(crate) gradients: Option<GradientVolume>,
}

/// Everything that is the same for all slabs, and the light buffer.
pub(crate) struct Sweep<'a> {
    pub(crate) volumes: &'a [Volume<'a>],
    pub(crate) placed: Vec<Placed<'a>>,
    pub(crate) frame: Frame,
    /// The eye's image.
    pub(crate) sight: Sight,
    pub(crate) shapes: Vec<Shape>,
    pub(crate) buckets: Vec<Buckets>,
    pub(crate) gradients: Gradients,
    /// `None` for ambient and emitted light alone. One with an extent gives at its centre what all its points give.
    pub(crate) light: Option<LitBy<'a>>,
    /// Lights that this sweep adds without carrying them.
    pub(crate) mapped: &'a [LitBy<'a>],
    pub(crate) light_buffer: Option<LightBuffer>,
    /// Light that is scattered more than once, where it is asked for.
    pub(crate) scattered: Option<Scattered>,
    /// By volume.
    pub(crate) paths: Vec<LightPath>,
    eye: &'a Eye<'a>,
    /// Polygons that keep the light of the sweep from others.
    pub(crate) depths: Option<LightDepths>,
    /// By volume.
    pub(crate) known: Vec<Known>,
    pub(crate) ambient: [f32; 3],
    pub(crate) params: Params,
    /// Whether light depends on where a point is.
    pub(crate) is_lit_by_place: bool,
    /// Whether ambient and emitted light belong to another sweep.
    pub(crate) light_alone: bool,
    input: &'a HalfInput<'a>,
    visible: u64,
}

impl<'a> Sweep<'a> {
    /// Prepares a sweep for one light that half vectors serve, and as many points of it as are asked for; across an axis, or its half vector.
    pub(crate) fn new(
        input: &'a HalfInput<'a>,
        params: &HalfParams,
        (carried, eye): (Option<(&'a LitBy<'a>, u32)>, &'a Eye<'a>),
        (axis, light_alone): (Option<HalfVector>, bool),
        progress: &Progress,
    ) -> Result<Self, Error> {
        let sheets = &input.sheets;
        let bodies = &input.bodies();
        let volumes = &sheets.volumes[..];
        let camera = sheets.camera;
        let is_lit = volumes.iter().any(is_lit) || input.splats.is_some_and(|splats| splats.are_lit()) || eye.are_lit();
        let carried = carried.filter(|_| is_lit);
        let mapped = if is_lit && !light_alone { &input.mapped[..] } else { &[] };
        let axis = axis.unwrap_or_else(|| axis_of_view(bodies, camera, carried.map(|(lit, _)| &lit.light)));
        let frame = Frame::new(bodies, camera, &params.sheets, &axis)?;
        let placed: Vec<Placed<'a>> = volumes.iter().map(|v| Placed::new(v, &frame, &params.sheets)).collect();
        let sight = Sight::new(&frame, *camera);
        let by_place = |lit: &LitBy<'_>| {
            let is_parallel = matches!(lit.light.shape, LightShape::Directional { .. });
            lit.shadow.is_some() || lit.slide.is_some() || !is_parallel
        };
        let planes = planes(volumes, input.splats.as_ref());
        let light_buffer = carried.map(|carried| light_buffer((&frame, planes), params, &placed, bodies, carried));
        let gain = light_buffer.as_ref().and_then(|b| b.soft.as_ref()).map(|soft| soft.penumbra.gain);
        let lit = |lit: &LitBy<'a>| LitBy { light: brighter(&lit.light, gain.unwrap_or(1.0)), ..*lit };
        let light = carried.map(|(of, _)| lit(of));
        let mut sweep = Self {
            volumes,
            shapes: placed.iter().map(|p| sight.shape(&frame, p)).collect(),
            buckets: Vec::new(),
            gradients: Gradients::new(&frame),
            light,
            mapped,
            light_buffer,
            scattered: None,
            paths: light
                .as_ref()
                .map_or_else(Vec::new, |lit| volumes.iter().map(|v| LightPath::new(v, &lit.light, &frame)).collect()),
            eye,
            depths: None,
            known: Vec::new(),
            ambient: sheets.ambient,
            params: params.sheets,
            is_lit_by_place: light.iter().chain(mapped).any(by_place),
            light_alone,
            input,
            visible: 0,
            placed,
            frame,
            sight,
        };
        sweep.sort_voxels(progress)?;
        let lit = sweep.light.as_ref().zip(carried.map(|c| c.1));
        sweep.depths = fold::light_depths(input, params, (lit, eye), progress)?;
        sweep.scattered = sweep.scatter(params);
        Ok(sweep)
    }

    /// Light of the sweep that is scattered more than once, where it is asked for: polygons and what casts shadows keep it off.
    fn scatter(&self, params: &HalfParams) -> Option<Scattered> {
        let lit = self.light.as_ref().filter(|lit| scatter::is_wanted(self.volumes, &lit.light, params))?;
        let origin = self.input.sheets.shadow_origin;
        let beside = self.depths.as_ref().map(|depths| Beside { depths, others: lit.shadow, origin });
        let shadow = beside.as_ref().map(|beside| beside as &dyn Transmittance).or(lit.shadow);
        let splats = self.input.splats.as_ref().filter(|splats| !splats.cloud.is_empty());
        let scene = Scene::new((self.volumes, splats), &LitBy { shadow, ..*lit }, params, origin);
        let lights_surfaces =
            self.eye.are_lit() || splats.is_some_and(HalfSplats::have_surfaces) || self.volumes.iter().any(reflects);
        Some(Scattered::new(&scene, params.scattering, lights_surfaces))
    }

    /// Finds the voxels that matter, with the shadows there that are known, and sorts them for both images (steps 3 and 4).
    fn sort_voxels(&mut self, progress: &Progress) -> Result<(), Error> {
        let lights: Vec<LitBy<'_>> = self.light.iter().chain(self.mapped).copied().collect();
        for (v, placed) in self.placed.iter().enumerate() {
            let shape = &self.shapes[v];
            let mut reach = placed.lattice_reach(shape.extent(), self.sight.widest_pixel(&self.frame, placed));
            if let Some(buffer) = &self.light_buffer {
                let light = placed.lattice_reach(buffer.shape(v).extent(), 0.0);
                (0..3).for_each(|a| reach[a] = reach[a].max(light[a]));
            }
            let (lattice, voxels) = placed.voxels(reach);
            let receivers = placed.receivers(&voxels, lattice.rim);
            let shadows = Shadows::new(&receivers, &lights, self.input.sheets.shadow_origin, progress)?;
            let records = records(placed, &lattice, &voxels);
            self.visible += voxels.count();
            self.buckets.push(Buckets::new(&records, placed, &self.frame, &self.sight, shape));
            if let Some(buffer) = &mut self.light_buffer {
                let lists = Buckets::new(&records, placed, &self.frame, &buffer.sight, buffer.shape(v));
                buffer.push(lists);
            }
            let gradients = GradientVolume::new(&receivers, &lattice, &self.params);
            self.known.push(Known { voxels, shadows, gradients });
        }
        Ok(())
    }

    /// Runs the sweep. One tick a slab.
    pub(crate) fn run(
        mut self,
        layout: &ChannelLayout,
        form: &Accumulator,
        image: Option<&mut PolygonImage>,
        progress: &Progress,
    ) -> Result<(Vec<EyeBand>, HalfCounts), Error> {
        let mut bands = self.bands(form);
        let mut splats = self.splats(form);
        let mut counts = self.counts(&bands);
        let depths = self.depths.take();
        counts.bytes += depths.as_ref().map_or(0, LightDepths::bytes);
        let mut polygons = self.solid(depths.as_ref(), &mut counts);
        let mut panes = self.panes(depths.as_ref());
        for slab in 0..self.frame.slabs.count {
            progress.tick(1).map_err(cancelled)?;
            if let Some(buffer) = &mut self.light_buffer {
                buffer.arrive(slab, &self.frame);
            }
            if let Some(splats) = &mut splats {
                let volumes = self.light_buffer.as_ref().map(|buffer| self.illumination(buffer, slab, None));
                let through = volumes.as_ref().map(|volumes| (volumes, depths.as_ref()));
                let [eye, light] = splats.enter(slab, &self.lamps(), (through, self.at_surfaces()), layout);
                (counts.eye_fragments, counts.light_fragments) =
                    (counts.eye_fragments + eye, counts.light_fragments + light);
            }
            if let Some(panes) = &mut panes {
                self.enter_panes(panes, slab, splats.as_ref(), layout);
            }
            let drawn = (splats.as_ref(), panes.as_ref(), depths.as_ref());
            counts.eye_fragments += self.pass(&mut bands, layout, (slab, Step::Draw), drawn);
            if let Some(polygons) = &mut polygons {
                self.light_polygons(polygons, slab, splats.as_ref());
            }
            if let Some(buffer) = &mut self.light_buffer {
                let splats = splats.as_ref().and_then(|splats| splats.light.as_ref());
                counts.light_fragments += buffer.attenuate(slab, &self.frame, &self.placed, splats);
            }
            if let Some(splats) = &mut splats {
                splats.leave();
            }
        }
        if let Some(panes) = &mut panes {
            let behind = self.frame.slabs.count;
            self.enter_panes(panes, behind, splats.as_ref(), layout);
            self.pass(&mut bands, layout, (behind, Step::Draw), (None, Some(panes), depths.as_ref()));
            counts.bytes += panes.bytes();
        }
        if let (Some(mut polygons), Some(image)) = (polygons, image) {
            self.light_polygons(&mut polygons, self.frame.slabs.count, splats.as_ref());
            polygons.0.shade(&self.lamps(), self.input.sheets.shadow_origin, self.at_surfaces(), image);
        }
        counts.bytes += splats.as_ref().map_or(0, SplatSheets::bytes);
        counts.soft_passes =
            self.light_buffer.as_ref().and_then(|buffer| buffer.soft.as_ref()).map_or(0, |soft| soft.passes);
        // Depths are summed from the eye on, so a sweep that comes towards it needs a second one for them.
        if self.frame.back_to_front && !form.depth.is_empty() && !self.light_alone {
            counts.eye_fragments += self.sum_depths(&mut bands, layout, form, progress)?;
        }
        Ok((bands, counts))
    }

    /// Sums depths in a sweep from the last slab to the first. Number of footprint numbers.
    fn sum_depths(
        &self,
        bands: &mut [EyeBand],
        layout: &ChannelLayout,
        form: &Accumulator,
        progress: &Progress,
    ) -> Result<u64, Error> {
        let form = Accumulator { channels: Vec::new(), ..form.clone() };
        let mut drawn = self.bands(&form);
        let mut splats = self.splats(&form);
        let mut panes = self.panes(None);
        let mut fragments = 0;
        for slab in (0..=self.frame.slabs.count).rev() {
            progress.tick(0).map_err(cancelled)?;
            let splats = splats.as_mut().filter(|_| slab < self.frame.slabs.count);
            let splats = splats.map(|splats| {
                fragments += splats.draw(slab);
                &*splats
            });
            panes.iter_mut().for_each(|panes| panes.draw(slab));
            fragments += self.pass(&mut drawn, layout, (slab, Step::Depths), (splats, panes.as_ref(), None));
        }
        for (band, drawn) in bands.iter_mut().zip(drawn) {
            band.pixels.depth = drawn.pixels.depth;
        }
        Ok(fragments)
    }

    /// Light of the sweep on the polygons of a slab, or of what is behind the last.
    fn light_polygons(
        &self,
        (light, slabs): &mut (PolygonLight<'_>, PolygonSlabs),
        slab: u32,
        splats: Option<&SplatSheets<'_>>,
    ) {
        if let Some(buffer) = &self.light_buffer {
            let splats = splats.and_then(|splats| splats.light.as_ref());
            light.enter(slabs, slab, &self.frame, (&self.illumination(buffer, slab, None), splats));
        }
    }

    /// Opaque polygons of the sweep, if there are any.
    fn solid<'b>(
        &self,
        depths: Option<&'b LightDepths>,
        counts: &mut HalfCounts,
    ) -> Option<(PolygonLight<'b>, PolygonSlabs)>
    where
        'a: 'b,
    {
        let of = &self.eye.solid.as_ref()?.seen;
        let camera = self.input.sheets.camera;
        let slabs = PolygonSlabs::new(of, &self.frame, camera, self.inside());
        counts.polygon_pixels = slabs.regions;
        counts.bytes += slabs.bytes();
        Some((PolygonLight::new(of, camera, depths), slabs))
    }

    /// Translucent polygons of the sweep, if any are seen.
    fn panes<'b>(&self, depths: Option<&'b LightDepths>) -> Option<PaneSheets<'b>>
    where
        'a: 'b,
    {
        let of = self.eye.panes.as_ref()?;
        Some(PaneSheets::new(of, &self.frame, self.input.sheets.camera, (depths, self.inside())))
    }

    /// Takes up those of a slab, or of what is behind the last, with the light of the sweep.
    fn enter_panes(
        &self,
        panes: &mut PaneSheets<'_>,
        slab: u32,
        splats: Option<&SplatSheets<'_>>,
        layout: &ChannelLayout,
    ) {
        let splats = splats.and_then(|splats| splats.light.as_ref());
        let volumes = self.light_buffer.as_ref().map(|buffer| self.illumination(buffer, slab, None));
        let lit = (&self.lamps(), self.input.sheets.shadow_origin, self.at_surfaces());
        panes.enter(slab, &self.frame, volumes.as_ref().map(|volumes| (volumes, splats)), lit, layout);
    }

    /// Depths across the slabs between which all bodies lie.
    fn inside(&self) -> [f32; 2] {
        let depths = || self.input.bodies().corners().map(|corner| self.frame.point(corner).z).collect::<Vec<f64>>();
        let (near, far) =
            depths().into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(n, f), z| (n.min(z), f.max(z)));
        [near as f32, far as f32]
    }

    /// One slab in the eye's image. Number of footprint numbers.
    fn pass(
        &self,
        bands: &mut [EyeBand],
        layout: &ChannelLayout,
        (slab, step): (u32, Step),
        (splats, panes, depths): (Option<&SplatSheets<'_>>, Option<&PaneSheets<'_>>, Option<&LightDepths>),
    ) -> u64 {
        let one = |(index, eye): (usize, &mut EyeBand)| {
            let part = WHOLE;
            pulp::Arch::new().dispatch(OneSlab {
                of: self,
                layout,
                splats,
                panes,
                depths,
                index,
                slab,
                step,
                eye,
                part,
            })
        };
        bands.par_iter_mut().enumerate().map(one).sum()
    }

    /// The splats of the sweep, if there are any.
    fn splats(&self, form: &Accumulator) -> Option<SplatSheets<'a>> {
        let of = self.input.splats.as_ref().filter(|splats| !splats.cloud.is_empty())?;
        // Which of them lie before a translucent polygon their depths say.
        let depth = self.eye.panes.is_some() || !form.depth.is_empty();
        let planes = form.optical_depth.len();
        let channels = form.channels.len();
        let form = &Accumulator::new([1, 1], planes, channels, depth, !form.object.is_empty());
        Some(SplatSheets::new(of, &self.frame, self.light_buffer.as_ref(), self.input.opaque, form))
    }

    /// Light that is scattered to surfaces.
    fn at_surfaces(&self) -> Option<&SurfaceLight> {
        self.scattered.as_ref().and_then(|scattered| scattered.at_surfaces.as_ref())
    }

    fn lamps(&self) -> Lamps<'a> {
        let Self { light: carried, mapped, ambient, light_alone, .. } = *self;
        Lamps { carried, mapped, ambient, camera: self.input.sheets.camera, light_alone }
    }

    /// The light of the sweep at a slab, behind splats and among them.
    pub(crate) fn illumination<'b>(
        &'b self,
        buffer: &'b LightBuffer,
        slab: u32,
        splats: Option<&'b SplatLight<'b>>,
    ) -> Illumination<'b> {
        let paths = &self.paths[..];
        let volumes = self.volumes;
        let face = self.frame.slabs.face(slab);
        let width = self.frame.slabs.width as f32;
        Illumination { buffer, paths, volumes, splats, face, width }
    }

    fn bands(&self, form: &Accumulator) -> Vec<EyeBand> {
        let camera = &self.sight.camera;
        let opaque = self.input.opaque;
        let rim = usize::from(self.placed.iter().any(|v| v.compares));
        let one = |b: usize| {
            let mut band = Band::new(b, rim, &self.frame, camera, self.volumes);
            if !opaque.is_empty() {
                band.end_at(opaque, &self.frame, camera);
            }
            let pixels = Pixels::new(&band, form, self.params.is_half());
            EyeBand::new(band, &self.placed, pixels)
        };
        (0..(camera.size[1] as usize).div_ceil(ROWS)).into_par_iter().map(one).collect()
    }

    fn counts(&self, bands: &[EyeBand]) -> HalfCounts {
        let buffer = self.light_buffer.as_ref();
        let scattered = self.scattered.as_ref();
        let light_bytes = buffer.map_or(0, LightBuffer::bytes) + scattered.map_or(0, Scattered::bytes);
        let lists: u64 = self.buckets.iter().map(Buckets::bytes).sum();
        let eye: u64 = bands.iter().map(EyeBand::bytes).sum();
        HalfCounts {
            voxels: self.volumes.iter().map(|v| v.grid.values.len() as u64).sum(),
            visible: self.visible,
            sweeps: 1,
            slabs: self.frame.slabs.count.into(),
            scatter_cells: scattered.map_or(0, Scattered::cells),
            scatter_passes: scattered.map_or(0, |s| s.passes),
            light_bytes,
            bytes: light_bytes + lists + eye + buffer.map_or(0, LightBuffer::list_bytes),
            ..HalfCounts::default()
        }
    }

    /// Unit direction from what a pixel sees to the eye.
    #[inline]
    pub(crate) fn to_eye(&self, [x, y]: [usize; 2]) -> Vec3 {
        let camera = &self.sight.camera;
        let [right, up, forward] = camera.axes;
        let (_, along) = camera.view_ray(x as f64 + 0.5, y as f64 + 0.5);
        -(right * along.x + up * along.y + forward * along.z).normalize().as_vec3()
    }

    /// View depth of a pixel's ray at a depth across the slabs.
    pub(crate) fn view_depth(&self, [x, y]: [usize; 2], depth: f32) -> f64 {
        let ray = self.frame.ray(&self.sight.camera, x as f64 + 0.5, y as f64 + 0.5);
        (f64::from(depth) - ray.from.z) / ray.along.z
    }
}

/// The light's image, and those of its points where it has an extent.
fn light_buffer(
    (frame, planes): (&Frame, usize),
    params: &HalfParams,
    placed: &[Placed<'_>],
    bodies: &Bodies<'_>,
    (lit, samples): (&LitBy<'_>, u32),
) -> LightBuffer {
    let camera = lamp::camera_of(bodies, &lit.light, params);
    let volumes = bodies.volumes;
    let mut buffer = LightBuffer::new(frame, camera, volumes, placed);
    if let Some(penumbra) = Penumbra::new(frame, bodies, (&lit.light, samples), &camera, params.most_light_pixels) {
        buffer.soften(penumbra, planes);
    }
    buffer
}

fn brighter(light: &Light, gain: f64) -> Light {
    Light { intensity: light.intensity.map(|i| (f64::from(i) * gain) as f32), ..*light }
}
