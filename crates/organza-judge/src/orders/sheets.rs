//! The same splats in sheets, and how much each ordering pops as the view turns.
//!
//! A sheet holds the splats whose centres lie in a slab; in each pixel their extinctions add, their colours weigh by extinction, and sheets are
//! composited from the eye on. Slabs lie across the view (Neophytou and Mueller 2005), across the axis of the world that is nearest to the view
//! (Westover), or across the half vector of view and light (Zhang and Crawfis).
//!
//! Popping is measured where the slabs turn over: at the scene's view, at the nearest camera turn about the splats where another axis becomes the
//! nearest, and at the nearest turn where view and light are at right angles. Each turn has frames a tenth of a degree apart, of translucent
//! splats alone. The splats are lit once for all frames of a turn, so that frames differ by the order alone.

use super::{Options, Ordered, exact_input, image};
use ::reference::{Fragment, Input, fold_fragments};
use glam::{DMat3, DVec3};
use organza::plan::Plan;
use organza::scene::Scene;
use organza::{CostRecord, Error, Frame, Loaded, Progress};
use splat_core::Camera;

/// Steps of a turn, degrees.
const STEP: f64 = 0.1;

/// Longest side of its frames, pixels.
const SIDE: u32 = 96;

/// Stage that draws the scene's own view.
const PICTURES: &str = "pictures";

/// Ways without sheets, which come first.
const FIRST_SHEETS: usize = 2;

/// Neighbours are about half a radius apart.
const SPACING: f64 = 0.5;

/// Across what sheets lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Across {
    View,
    Axis,
    Half,
}

/// How the fragments of a pixel are put in order and joined.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Way {
    /// One by one, by their own depth.
    Fragments,
    /// One by one, by the view depth of their splats' centres.
    Centres,
    /// Sheets of so many voxels.
    Sheets(Across, u32),
}

/// A pixel of one way.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    color: [f32; 3],
    optical_depth: [f32; 3],
}

/// What sheets are made of.
pub(super) struct Splats<'a> {
    scene: &'a Scene,
    loaded: &'a Loaded,
    plan: &'a Plan,
    /// Mean radius, in the scale of the cloud.
    radius: f64,
    /// Middle of their centres.
    middle: DVec3,
    /// Direction from there to the first light.
    to_light: Option<DVec3>,
}

/// Splats by what they are sorted by in one view.
struct Keys {
    way: Way,
    /// By id; empty where fragments have keys of their own.
    of_splats: Vec<f64>,
}

impl Across {
    fn name(self) -> &'static str {
        match self {
            Self::View => "the view",
            Self::Axis => "an axis",
            Self::Half => "the half vector",
        }
    }
}

impl Way {
    /// Of sheets.
    fn name(self) -> Option<String> {
        match self {
            Self::Fragments | Self::Centres => None,
            Self::Sheets(across, 1) => Some(format!("sheets across {}, 1 voxel", across.name())),
            Self::Sheets(across, voxels) => Some(format!("sheets across {}, {voxels} voxels", across.name())),
        }
    }

    /// Of sheets, in the scale of the cloud.
    fn thickness(self, splats: &Splats<'_>) -> Option<f64> {
        match self {
            Self::Fragments | Self::Centres => None,
            Self::Sheets(_, voxels) => Some(splats.thickness(voxels)),
        }
    }
}

impl<'a> Splats<'a> {
    /// The translucent ones, of these ids.
    pub(super) fn new(scene: &'a Scene, loaded: &'a Loaded, plan: &'a Plan, ids: &[u32]) -> Self {
        let cloud = &loaded.cloud;
        let share = 1.0 / ids.len() as f64;
        let radius = ids.iter().map(|id| f64::from(cloud.radius[*id as usize])).sum::<f64>() * share;
        let middle = ids.iter().map(|id| cloud.position[*id as usize].as_dvec3()).sum::<DVec3>() * share;
        let middle = cloud.origin + middle;
        let to_light =
            loaded.lights.first().map(|light| light.light.irradiance(middle, 0.0).to_light.normalize_or_zero());
        Self { scene, loaded, plan, radius, middle, to_light }
    }

    /// Of sheets of so many voxels, in the scale of the cloud.
    fn thickness(&self, voxels: u32) -> f64 {
        self.radius * SPACING * f64::from(voxels)
    }

    fn ways(&self, voxels: &[u32]) -> Vec<Way> {
        let across = [Some(Across::View), Some(Across::Axis), self.to_light.map(|_| Across::Half)];
        let sheets =
            across.into_iter().flatten().flat_map(|across| voxels.iter().map(move |v| Way::Sheets(across, *v)));
        let one_by_one: [Way; FIRST_SHEETS] = [Way::Fragments, Way::Centres];
        one_by_one.into_iter().chain(sheets).collect()
    }

    /// Normal of sheets, away from the eye.
    fn normal(&self, across: Across, camera: &Camera) -> DVec3 {
        let forward = camera.axes[2];
        match across {
            Across::View => forward,
            Across::Axis => {
                let axis = nearest_axis(forward);
                DVec3::AXES[axis] * forward[axis].signum()
            }
            Across::Half => {
                let light = self.to_light.unwrap_or(-forward);
                // Light from behind the eye goes with the view; other light comes towards it.
                let bisector = if forward.dot(light) <= 0.0 { forward - light } else { forward + light };
                bisector.normalize()
            }
        }
    }

    fn keys(&self, way: Way, camera: &Camera) -> Keys {
        let cloud = &self.loaded.cloud;
        let middle = self.middle;
        let depths =
            |normal: DVec3| cloud.position.iter().map(move |p| normal.dot(cloud.origin + p.as_dvec3() - middle));
        let of_splats = match way {
            Way::Fragments => Vec::new(),
            Way::Centres => depths(camera.axes[2]).collect(),
            Way::Sheets(across, voxels) => {
                let thickness = self.thickness(voxels);
                depths(self.normal(across, camera)).map(|depth| (depth / thickness).floor()).collect()
            }
        };
        Keys { way, of_splats }
    }

    /// The nearest turns at which something turns over, degrees.
    fn turns(&self, camera: &Camera) -> Vec<f64> {
        let forward = |degrees: f64| turned(camera, self.middle, degrees).axes[2];
        let first = |side: &dyn Fn(DVec3) -> i32| {
            let here = side(forward(0.0));
            let steps = (1..=1800).flat_map(|n| [f64::from(n) * STEP, -f64::from(n) * STEP]);
            steps.into_iter().find(|degrees| side(forward(*degrees)) != here)
        };
        let right_angle = self.to_light.and_then(|light| first(&|view| i32::from(view.dot(light) < 0.0)));
        let starts = [Some(0.0), first(&|view| nearest_axis(view) as i32), right_angle];
        starts.into_iter().flatten().collect()
    }
}

/// Adds the pictures by sheets to those by other orderings, and says how much each of them pops, and the ordering named `by_centre`.
pub(super) fn ways(
    splats: &Splats<'_>,
    frame: &Frame<'_>,
    by_centre: &str,
    effort: &Options,
    orderings: &mut Vec<Ordered>,
    progress: &Progress,
) -> Result<(), Error> {
    progress.enter();
    let ways = splats.ways(effort.voxels());
    let turns = splats.turns(&splats.loaded.camera);
    let name = |turn: usize| format!("turn {} of {}", turn + 1, turns.len());
    // A turn has several frames, which are small.
    progress.plan([(PICTURES.to_owned(), 1.0)].into_iter().chain((0..turns.len()).map(|turn| (name(turn), 2.0))));
    progress.begin(PICTURES);
    draw(splats, frame, &ways[FIRST_SHEETS..], orderings, progress)?;
    let mut steps = vec![0.0f64; ways.len()];
    for (turn, degrees) in turns.iter().enumerate() {
        progress.begin(&name(turn));
        for (most, step) in steps.iter_mut().zip(largest_steps(splats, &ways, *degrees, effort.steps(), progress)?) {
            *most = most.max(step);
        }
    }
    for (way, step) in ways.iter().zip(&steps).skip(1).filter(|_| steps[0] > 0.0) {
        let name = way.name().unwrap_or_else(|| by_centre.to_owned());
        if let Some(row) = orderings.iter_mut().find(|o| o.name == name) {
            row.pop = Some(step / steps[0]);
        }
    }
    progress.leave();
    Ok(())
}

/// The scene's picture by each way of sheets.
fn draw(
    splats: &Splats<'_>,
    frame: &Frame<'_>,
    ways: &[Way],
    orderings: &mut Vec<Ordered>,
    progress: &Progress,
) -> Result<(), Error> {
    let mut cost = CostRecord::default();
    let shaded = frame.shaded(&mut cost)?;
    let input = exact_input(splats.loaded, &frame.camera, shaded, frame.raster_params().resampling_sigma_px);
    let keys: Vec<Keys> = ways.iter().map(|way| splats.keys(*way, &frame.camera)).collect();
    let by_way =
        |_, fragments: &[Fragment]| -> Vec<Pixel> { keys.iter().map(|k| composite(&input, fragments, k)).collect() };
    let opaque = &frame.opaque(&mut cost)?.depth;
    let pixels = fold_fragments(&input, opaque, by_way, Some(progress)).map_err(|_| Error::Cancelled)?;
    let world = libm::exp2(f64::from(splats.loaded.exponent));
    for (n, way) in ways.iter().enumerate() {
        let mut accumulator = frame.accumulator();
        let planes = accumulator.optical_depth.len();
        for (k, pixel) in pixels.iter().map(|by_way| by_way[n]).enumerate() {
            accumulator.channels.iter_mut().zip(pixel.color).for_each(|(plane, v)| plane[k] = v);
            let depth = |p: usize| pixel.optical_depth[if planes == 1 { 1 } else { p }];
            accumulator.optical_depth.iter_mut().enumerate().for_each(|(p, plane)| plane[k] = depth(p));
        }
        let shown = image(&frame.finish(&accumulator, None, &mut cost)?)?;
        let thickness = way.thickness(splats).map(|thickness| thickness * world);
        orderings.push(Ordered { thickness, ..Ordered::new(way.name().unwrap_or_default(), shown) });
    }
    Ok(())
}

/// The largest step from frame to frame of a turn about so many degrees, by way.
fn largest_steps(
    splats: &Splats<'_>,
    ways: &[Way],
    degrees: f64,
    steps: i32,
    progress: &Progress,
) -> Result<Vec<f64>, Error> {
    let mut frame = Frame::new(splats.scene, splats.loaded, splats.plan, progress).with_hidden();
    let camera = smaller(turned(&splats.loaded.camera, splats.middle, degrees));
    frame.camera = camera;
    let sigma = frame.raster_params().resampling_sigma_px;
    let shaded = frame.shaded(&mut CostRecord::default())?;
    let picture = |step: i32| {
        let camera = turned(&camera, splats.middle, STEP * (f64::from(step) - 0.5 * f64::from(steps)));
        let input = exact_input(splats.loaded, &camera, shaded, sigma);
        let keys: Vec<Keys> = ways.iter().map(|way| splats.keys(*way, &camera)).collect();
        let by_way = |_, fragments: &[Fragment]| keys.iter().map(|k| composite(&input, fragments, k).color).collect();
        fold_fragments(&input, &[], by_way, Some(progress)).map_err(|_| Error::Cancelled)
    };
    let mut largest = vec![0.0f64; ways.len()];
    let mut before: Vec<Vec<[f32; 3]>> = picture(0)?;
    for step in 1..=steps {
        let next = picture(step)?;
        for (one, other) in before.iter().zip(&next) {
            for (most, (a, b)) in largest.iter_mut().zip(one.iter().zip(other)) {
                *most = (0..3).map(|c| f64::from((a[c] - b[c]).abs())).fold(*most, f64::max);
            }
        }
        before = next;
    }
    Ok(largest)
}

/// A pixel by one way.
fn composite(input: &Input<'_>, fragments: &[Fragment], keys: &Keys) -> Pixel {
    let key = |f: &Fragment| match keys.way {
        Way::Fragments => f.depth,
        _ => keys.of_splats[f.splat as usize],
    };
    let mut sorted: Vec<(f64, &Fragment)> = fragments.iter().map(|f| (key(f), f)).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut color = [0.0f64; 3];
    let mut so_far = [0.0f64; 3];
    for sheet in sorted.chunk_by(|a, b| a.0 == b.0) {
        let mut depth = [0.0; 3];
        let mut sum = [0.0; 3];
        for (_, f) in sheet {
            let material = &input.materials[usize::from(input.cloud.material[f.splat as usize])];
            for c in 0..3 {
                let channel_depth = f.optical_depth * f64::from(material.extinction_rgb[c]);
                depth[c] += channel_depth;
                sum[c] += channel_depth * f64::from(input.values[f.splat as usize * input.channels + c]);
            }
        }
        for c in (0..3).filter(|c| depth[*c] > 0.0) {
            color[c] += libm::exp(-so_far[c]) * -libm::expm1(-depth[c]) * sum[c] / depth[c];
            so_far[c] += depth[c];
        }
    }
    Pixel { color: color.map(|c| c as f32), optical_depth: so_far.map(|depth| depth as f32) }
}

/// The axis of the world nearest to a direction.
fn nearest_axis(direction: DVec3) -> usize {
    let size = direction.abs();
    if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    }
}

/// A camera turned about a place and its own upward axis.
fn turned(camera: &Camera, about: DVec3, degrees: f64) -> Camera {
    let turn = DMat3::from_axis_angle(camera.axes[1], degrees.to_radians());
    let position = about + turn * (camera.position - about);
    let axes = camera.axes.map(|axis| turn * axis);
    Camera { position, axes, ..*camera }
}

/// With as many pixels as frames of a turn have.
fn smaller(camera: Camera) -> Camera {
    let longest = camera.size[0].max(camera.size[1]);
    let side = |n: u32| if longest > SIDE { (n * SIDE).div_ceil(longest) } else { n };
    Camera { size: camera.size.map(side), ..camera }
}
