//! The `surfels` technique (Zhang and Pajarola 2007): translucent surfaces as discs. Rays meet the discs exactly, each layer averages
//! its discs, and layers are composited in order.

mod discs;
mod glass;
mod groups;
mod plans;

use crate::cost::{Count, Item, Translucent, samples};
use crate::frame::Frame;
use crate::frame::matter::Matter;
use crate::pass;
use crate::scene::{LightPoint, Scene, SurfelGroups, SurfelLayers, Technique};
use crate::technique::{Asked, Fold, Session, points};
use crate::{CostRecord, Error, RenderOptions, stage};
use deferred_blend::grouping::Membership;
use deferred_blend::{BlendInput, Blended, Discs, Floors, Glass, Layering, Params, Surfaces, blend};
pub(crate) use discs::opaque;
use discs::{disc_input, params, refuse, with_shown};
use glass::{bending, surfaces, unit};
pub(crate) use groups::counts as group_counts;
pub(crate) use plans::plans;
use splat_core::glam::Vec3;
use splat_core::raster::GlassImage;
use splat_core::{Accumulator, Cloud, Direction, SplatKind};
use std::ops::Range;

/// Bytes of a disc: where rays meet it, what it shows, its normal and place, and an entry in the lists of two tiles.
const DISC_BYTES: u64 = 96 + 28 + 12 + 4 + 2 * 4;

/// Bytes of a sample of opaque discs: what light falls on, in tiles and as a picture.
const OPAQUE_BYTES: u64 = 4 * 2 * (10 + 2);

/// Bytes of a sample of what is mirrored and bent.
const GLASS_BYTES: u64 = 24;

/// Bytes of the discs, and of what bent rays meet and see.
pub(crate) fn bytes(matter: &Matter<'_>, _: &[LightPoint], _: bool, _: &RenderOptions) -> u64 {
    let discs = matter.cloud.map_or(0, |cloud| cloud.len() as u64);
    let bounds = matter.scene.materials.iter().any(|m| m.material.bounds_matter());
    let glass = if bounds { Surfaces::bytes(discs) + GLASS_BYTES * matter.camera.pixels() } else { 0 };
    let group_bytes = groups::bytes(matter.scene, discs, matter.cloud.map_or(0, |cloud| cloud.bytes()));
    let is_solid = |cloud: &Cloud| cloud.kind.contains(&SplatKind::Opaque);
    let opaque = if matter.cloud.is_some_and(is_solid) { OPAQUE_BYTES * matter.camera.pixels() } else { 0 };
    DISC_BYTES * discs + glass + group_bytes + opaque
}

/// Whether the object is a surface whose material has what discs alone show: matter inside that bends light, or bumps.
pub(crate) fn is_offered(asked: &Asked<'_>) -> bool {
    let material = asked.material();
    !asked.object.source.is_medium() && (material.bounds_matter() || material.bump.height > 0.0)
}

/// Whether light falls on bumps, or what to set so that it does.
pub(crate) fn bumps(scene: &Scene) -> Result<(), &'static str> {
    scene.render.surfels.lights_pixels.then_some(()).ok_or("set render.surfels.shading = \"pixels\"")
}

/// Discs whose fragments are averaged and composited, range by range, and rays that are bent.
pub(crate) fn counts(scene: &Scene, translucent: &Translucent) -> Vec<Count> {
    if !translucent.any {
        return Vec::new();
    }
    let bends = scene.materials.iter().any(|m| m.material.bounds_matter());
    vec![
        Count::new(Item::SurfelDisc, translucent.splats),
        Count::new(Item::BoxedDisc, if bends { translucent.splats } else { 0.0 }),
        Count::new(Item::SurfelFragment, translucent.fragments),
        Count::new(Item::SurfelSample, samples(scene) * translucent.ranges),
        Count::new(Item::BentSample, if bends { samples(scene) } else { 0.0 }),
    ]
}

/// Begins a frame.
pub(crate) fn begin<'a>(frame: &'a Frame<'a>) -> Box<dyn Fold + 'a> {
    Box::new(Surfels { frame, members: None, discs: None, surfaces: None, glass: None })
}

/// The discs of a frame that are the technique's own.
struct Surfels<'a> {
    frame: &'a Frame<'a>,
    /// Their groups, where the scene asks for some.
    members: Option<Membership>,
    /// Once they were projected.
    discs: Option<Discs>,
    /// What bent rays may meet.
    surfaces: Option<Surfaces<'a>>,
    /// Light that was mirrored and bent so far.
    glass: Option<GlassImage>,
}

impl<'a> Fold for Surfels<'a> {
    fn fold(
        &mut self,
        range: Range<f32>,
        into: &mut Accumulator,
        _: &mut Session<'_>,
        cost: &mut CostRecord,
    ) -> Result<(), Error> {
        let frame = self.frame;
        let params = params(frame);
        // Opaque discs alone are met by rays before.
        if !frame.plan.passes.iter().any(|planned| planned.name == pass::SURFELS) {
            return Ok(());
        }
        if self.discs.is_none() {
            if let Some(asked) = frame.settings.surfels.layers.groups() {
                let ids = frame.translucent(Technique::Surfels);
                self.members = Some(groups::members(frame, asked, ids, false, cost)?);
            }
            self.discs = Some(project(frame, &params, self.members.as_ref(), cost)?);
        }
        let opaque = &frame.opaque(cost)?.depth;
        if self.surfaces.is_none() && frame.plan.bends {
            let values = &frame.shaded(cost)?.values;
            let made = cost.measure(pass::SURFELS, |stage| Ok::<_, Error>(surfaces(frame, values, stage)))?;
            self.surfaces = Some(made);
        }
        let discs = self.discs.as_ref().expect("invariant: discs were projected above");
        let background = frame.background();
        let [right, up, ahead] = frame.camera.axes;
        let sky = |d: Vec3, solid_angle: f32| {
            let [x, y, z] = d.as_dvec3().to_array();
            background.toward(right * x + up * y + ahead * z, f64::from(solid_angle))
        };
        let bending = bending(frame);
        let unit = unit(frame);
        let straight = !frame.settings.surfels.bent_behind;
        let glass = self.surfaces.as_ref().map(|surfaces| Glass { bending, sky: &sky, surfaces, straight, unit });
        let before = self.glass.take();
        let layering = layering(&frame.settings.surfels.layers, self.members.as_ref(), discs, &params);
        self.glass = with_shown(frame, cost, |shown, cost| {
            frame.progress.begin(stage::SURFELS);
            frame.tick()?;
            cost.measure(pass::SURFELS, |stage| {
                let input = BlendInput { discs, shown, opaque, range, layering, glass };
                let made = blend(&input, &params, into, Some(frame.progress)).map_err(refuse)?;
                let Blended { counts, glass } = made.behind(before);
                stage.items_in = counts.discs;
                stage.items_out = counts.layers;
                stage.fragments = counts.fragments;
                stage.bytes = counts.bytes;
                Ok(glass)
            })
        })?;
        Ok(())
    }

    fn glass(&mut self) -> Option<GlassImage> {
        self.glass.take()
    }
}

/// How the scene tells layers apart.
fn layering<'a>(asked: &SurfelLayers, members: Option<&'a Membership>, discs: &Discs, params: &Params) -> Layering<'a> {
    let floors = |asked: &SurfelGroups| {
        let groups = members.expect("invariant: what needs groups has some").groups();
        Floors { groups, steps: asked.depth_steps.unwrap_or_else(|| discs.depth_steps(params)) }
    };
    match asked {
        SurfelLayers::Gaps => Layering::Gaps,
        SurfelLayers::Peeled(most) => Layering::Peeled(*most),
        SurfelLayers::Algorithm1(groups) => Layering::Algorithm1(floors(groups)),
        SurfelLayers::Algorithm2(groups) => Layering::Algorithm2(floors(groups)),
    }
}

/// The discs, near ones first, as large as their groups draw them.
fn project(
    frame: &Frame<'_>,
    params: &Params,
    members: Option<&Membership>,
    cost: &mut CostRecord,
) -> Result<Discs, Error> {
    let near_first = hbsort::Params { direction: Direction::FrontToBack, ..hbsort::Params::default() };
    let order = points::sorted(frame, Technique::Surfels, &near_first, cost)?;
    frame.progress.begin(stage::SURFELS);
    frame.tick()?;
    cost.measure(pass::SURFELS, |stage| {
        let discs = Discs::project_members(&disc_input(frame, &order.input_from_sorted), params, members);
        stage.bytes = discs.bytes();
        Ok(discs)
    })
}
