//! Drawing with a clock, and the distance of a picture from a reference.

use super::{Facts, Request};
use organza::plan::Plan;
use organza::scene::Scene;
use organza::{
    Context, CostRecord, Error, Files, Loaded, Planned, Progress, RenderOptions, draw_loaded, load, plan_loaded,
    same_splats,
};
use reference::metrics::{Display, Errors, Image, Linear, Viewing, compare, epsilon_8_bit, flip, psnr};
use splat_core::{Cloud, PackedCloud, SplatKind};
use std::time::Instant;
use tsm::mapping::{Mapping, Table};

/// A drawn picture with its time and its memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// The beauty layer.
    pub image: Image<Linear>,
    /// Seconds of all passes but loading and conversion.
    pub seconds: f64,
    /// Seconds of loading and conversion; `None` when splats of an earlier frame served again.
    pub convert_seconds: Option<f64>,
    /// Footprint fragments evaluated.
    pub fragments: u64,
    /// Bytes of the buffers that the passes made.
    pub bytes: u64,
}

/// The difference between a picture and a reference, by several measures.
#[derive(Debug, Clone, PartialEq)]
pub struct Distance {
    /// Errors of linear radiance.
    pub linear: Errors,
    /// Errors of the displayed picture, 0 to 1.
    pub display: Errors,
    /// Peak signal-to-noise ratio of the displayed picture, dB; infinite for equal pictures.
    pub psnr: f64,
    /// Mean LDR-FLIP of the displayed picture.
    pub flip: f64,
    /// ε of Zhang and Pajarola 2007, 8-bit units.
    pub epsilon: f64,
}

impl Distance {
    /// Compares two pictures; `exposure` is that of the displayed picture.
    ///
    /// # Errors
    /// [`Error::Internal`] for unequal sizes.
    pub fn between(image: &Image<Linear>, reference: &Image<Linear>, exposure: f64) -> Result<Self, Error> {
        let shown: [Image<Display>; 2] = [image.display(exposure), reference.display(exposure)];
        let [a, b] = &shown;
        let measure = || {
            Ok::<_, reference::metrics::MetricError>(Self {
                linear: compare(image, reference)?,
                display: compare(a, b)?,
                psnr: psnr(a, b)?,
                flip: flip(a, b, &Viewing::default())?.mean,
                epsilon: epsilon_8_bit(a, b)?,
            })
        };
        measure().map_err(|e| Error::Internal(e.to_string()))
    }
}

/// Repeats of one setting.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Timed {
    /// The picture of the first draw; where repeats have seeds, one picture each; none if it could not be drawn.
    pub images: Vec<Image<Linear>>,
    /// Seconds of each repeat, loading and conversion left out.
    pub seconds: Vec<f64>,
    /// Seconds of loading and conversion, of the repeats that needed it.
    pub convert_seconds: Vec<f64>,
    /// Fragments of one repeat.
    pub fragments: Option<u64>,
    /// Bytes of one repeat.
    pub bytes: Option<u64>,
    /// Why it could not be drawn.
    pub failure: Option<String>,
}

impl Timed {
    /// The first picture, if any was drawn.
    pub fn image(&self) -> Option<&Image<Linear>> {
        self.images.first()
    }

    /// `keep` says whether the picture may differ from those that are there.
    pub(super) fn add(&mut self, frame: Frame, with_clock: bool, keep: bool) {
        self.seconds.extend(with_clock.then_some(frame.seconds));
        self.convert_seconds.extend(frame.convert_seconds);
        self.fragments = Some(frame.fragments);
        self.bytes = Some(frame.bytes);
        if keep || self.images.is_empty() {
            self.images.push(frame.image);
        }
    }
}

/// Draws requests on the CPU; splats are kept while requests differ in size and render settings alone.
pub struct Renderer<'a> {
    options: &'a RenderOptions,
    progress: &'a Progress,
    /// Those of the first scene stay, beside those of the latest.
    loaded: Vec<(Scene, Loaded)>,
}

impl<'a> Renderer<'a> {
    /// Nothing loaded yet.
    pub fn new(options: &'a RenderOptions, progress: &'a Progress) -> Self {
        Self { options, progress, loaded: Vec::new() }
    }

    /// Draws.
    ///
    /// # Errors
    /// As [`organza::render`].
    pub fn draw(&mut self, request: &Request) -> Result<Frame, Error> {
        self.within_stage(|renderer| renderer.frame(request))
    }

    /// What `work` plans shares the present stage.
    fn within_stage<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        self.progress.enter();
        let out = work(self);
        self.progress.leave();
        out
    }

    fn frame(&mut self, request: &Request) -> Result<Frame, Error> {
        let mut scene = request.scene.clone();
        scene.camera.size = scene.camera.size.map(|s| s.saturating_mul(request.oversample));
        let options = self.options;
        let progress = self.progress;
        let (loaded, convert_seconds) = self.load(&scene)?;
        let plain = request.packed.then(|| pack(&mut loaded.cloud)).transpose()?;
        let mut cost = CostRecord::default();
        let layers = plan_loaded(&scene, loaded, options).and_then(|plan| {
            draw_loaded(&Planned { scene: &scene, loaded, plan: &plan, options }, progress, &mut cost)
        });
        plain.into_iter().for_each(|plain| loaded.cloud = plain);
        let layers = layers?;
        let beauty = layers.rgb("beauty").ok_or_else(|| Error::Internal("a render has no beauty layer".into()))?;
        let image = Image::from_layer(layers.size, beauty).map_err(|e| Error::Internal(e.to_string()))?;
        Ok(Frame {
            image: if request.oversample > 1 { image.box_downsampled(request.oversample as usize) } else { image },
            seconds: cost.stages.iter().map(|s| s.seconds).sum(),
            convert_seconds,
            fragments: cost.stages.iter().map(|s| s.fragments).sum(),
            bytes: cost.stages.iter().map(|s| s.bytes).sum(),
        })
    }

    /// The facts of a scene that the knobs of a technique need.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn facts(&mut self, scene: &Scene) -> Result<Facts, Error> {
        self.within_stage(|renderer| renderer.look(scene))
    }

    fn look(&mut self, scene: &Scene) -> Result<Facts, Error> {
        let options = self.options;
        let progress = self.progress;
        let (loaded, _) = self.load(scene)?;
        let plan = plan_loaded(scene, loaded, options)?;
        let frame = organza::Frame::new(scene, loaded, &plan, progress);
        let maps = frame.maps(&mut CostRecord::default())?;
        // Cells that a light states stay what they are.
        let free = maps.iter().zip(&plan.shadow_tables).filter_map(|(map, table)| {
            let table = table.as_ref()?;
            map.as_ref().filter(|_| !table.light_states_cells)
        });
        Ok(Facts {
            slice_thickness: slice_thickness(loaded)?,
            has_maps: maps.iter().any(Option::is_some),
            cells: free.map(|map| longest_side(map.table())).max(),
            bytes_per_splat: bytes_per_splat(&loaded.cloud),
        })
    }

    /// Width of the slabs that a scene drawn by `sheets` states, world units; `None` if no slab holds a volume or a splat.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn slab_width(&mut self, scene: &Scene) -> Result<Option<f64>, Error> {
        self.within_stage(|renderer| {
            let options = renderer.options;
            let progress = renderer.progress;
            let (loaded, _) = renderer.load(scene)?;
            let plan = plan_loaded(scene, loaded, options)?;
            organza::Frame::new(scene, loaded, &plan, progress).slab_width(options, &mut CostRecord::default())
        })
    }

    /// Whether a pass of [`organza::pass`] would run for a scene.
    ///
    /// # Errors
    /// As [`Renderer::draw`].
    pub fn runs(&mut self, scene: &Scene, pass: &str) -> Result<bool, Error> {
        self.within_stage(|renderer| {
            let options = renderer.options;
            let (loaded, _) = renderer.load(scene)?;
            Ok(plan_loaded(scene, loaded, options)?.passes.iter().any(|p| p.name == pass))
        })
    }

    /// The reason why a scene cannot be drawn with its settings, if it cannot.
    ///
    /// # Errors
    /// As [`Renderer::draw`], except that a refusal of the planner is no error.
    pub fn refused(&mut self, scene: &Scene) -> Result<Option<String>, Error> {
        self.within_stage(|renderer| renderer.refusal(scene))
    }

    fn refusal(&mut self, scene: &Scene) -> Result<Option<String>, Error> {
        let options = self.options;
        let (loaded, _) = self.load(scene)?;
        match plan_loaded(scene, loaded, options) {
            Err(e @ (Error::Input { .. } | Error::Limit(_) | Error::TooLarge { .. })) => Ok(Some(e.to_string())),
            other => other.map(|_| None),
        }
    }

    /// The splats of a scene, converted now unless those at hand are the same; with the seconds that took.
    fn load(&mut self, scene: &Scene) -> Result<(&mut Loaded, Option<f64>), Error> {
        let mut seconds = None;
        let at = self.loaded.iter().position(|(loaded_for, _)| same_splats(loaded_for, scene));
        let at = match at {
            Some(at) => at,
            None => {
                self.loaded.truncate(1);
                let start = Instant::now();
                let loaded =
                    load(scene, Context { files: &Files::default(), options: self.options, progress: self.progress })?;
                seconds = Some(start.elapsed().as_secs_f64());
                self.loaded.push((scene.clone(), loaded));
                self.loaded.len() - 1
            }
        };
        let loaded = &mut self.loaded[at].1;
        loaded.retarget(scene);
        Ok((loaded, seconds))
    }
}

/// Thickness of the slices in which the translucent splats of a scene are ordered, world units; `None` where none is in view.
fn slice_thickness(loaded: &Loaded) -> Result<Option<f64>, Error> {
    let translucent: Vec<u32> =
        (0u32..).zip(&loaded.cloud.kind).filter(|(_, k)| **k != SplatKind::Opaque).map(|(i, _)| i).collect();
    let thickness = loaded.slice_thickness.map_or(hbsort::Thickness::Auto, hbsort::Thickness::World);
    let params = hbsort::Params { thickness, ..hbsort::Params::default() };
    let mut scratch = hbsort::Scratch::default();
    let order = hbsort::slice_cloud(&loaded.cloud, Some(&translucent), &loaded.camera, &params, &mut scratch)
        .map_err(|e| Error::Internal(e.to_string()))?;
    let is_visible = !order.input_from_sorted.is_empty();
    Ok(is_visible.then(|| order.thickness * f64::from(loaded.exponent).exp2()))
}

impl Facts {
    /// The facts that a plan alone gives: its predicted cells of shadow tables, and no packed splats.
    ///
    /// # Errors
    /// [`Error::Internal`] where splats cannot be ordered.
    pub fn of_plan(loaded: &Loaded, plan: &Plan) -> Result<Self, Error> {
        let longest = |table: &organza::ShadowTable| table.predicted.size[0].max(table.predicted.size[1]);
        let tables = || plan.shadow_tables.iter().chain(&plan.other_tables).flatten();
        let free = tables().filter(|table| !table.light_states_cells);
        let cells = free.map(longest).max().map(|cells| cells.min(u64::from(u32::MAX)) as u32);
        let has_maps = tables().next().is_some();
        Ok(Self { slice_thickness: slice_thickness(loaded)?, has_maps, cells, bytes_per_splat: None })
    }
}

fn bytes_per_splat(cloud: &Cloud) -> Option<[f64; 2]> {
    let packed = PackedCloud::new(cloud).ok().filter(|packed| !packed.is_empty())?;
    Some([cloud.bytes(), packed.bytes()].map(|bytes| bytes as f64 / cloud.len() as f64))
}

/// Splats as they are after they were packed, in the place of those that they were made of, which are given back.
fn pack(cloud: &mut Cloud) -> Result<Cloud, Error> {
    let packed = PackedCloud::new(cloud).map_err(|e| Error::Internal(e.to_string()))?;
    Ok(std::mem::replace(cloud, packed.unpack()))
}

fn longest_side(table: &Table) -> u32 {
    let [columns, rows] = match table {
        Table::Octahedral(m) => m.size(),
        Table::PolarAzimuth(m) => m.size(),
        Table::Planar(m) => m.size(),
    };
    columns.max(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_splats_are_drawn_a_little_otherwise_and_leave_the_others_as_they_were() {
        let text = br#"
            version = 1
            [camera]
            position = [0.3, 0.2, 4]
            target = [0, 0, 0]
            size = [24, 16]
            [[light]]
            kind = "point"
            position = [2, 4, 1]
            intensity = [20, 20, 20]
            [[object]]
            name = "fog"
            medium_ball = { center = [0, 0, 0], radius = 1, extinction = 2, spacing = 0.1 }
        "#;
        let scene = organza::scene::parse("s.toml".as_ref(), text, &Default::default()).unwrap();
        let scene = scene.drawn_by(organza::scene::Technique::Points);
        let options = RenderOptions::default();
        let progress = Progress::new();
        let mut renderer = Renderer::new(&options, &progress);
        let mut draw = |packed| renderer.draw(&Request { scene: scene.clone(), oversample: 1, packed }).unwrap().image;
        let [plain, packed, again] = [false, true, false].map(&mut draw);
        assert!(plain == again && plain != packed);
        assert!(compare(&packed, &plain).unwrap().rmse < 2e-4);
        let [bytes, packed] = renderer.facts(&scene).unwrap().bytes_per_splat.unwrap();
        assert!(packed < 17.0 && bytes >= 40.0, "{bytes} {packed}");
    }
}
