//! The `points` technique (Gunjee 2007): translucent splats in slices, composited in order.

mod on_device;

use crate::device;
use crate::frame::{Frame, Shaded, record};
use crate::load::Loaded;
use crate::pass;
use crate::plan::{Plan, PlannedSetting};
use crate::scene::{Scene, Technique};
use crate::technique::{EVERYWHERE, Fold, Session};
use crate::{CostRecord, Error, stage};
use splat_core::raster;
use splat_core::raster::FoldInput;
use splat_core::{Accumulation, Accumulator, Direction, SliceOrder};
use std::borrow::Cow;
use std::ops::Range;

/// Begins a frame.
pub(crate) fn begin<'a>(frame: &'a Frame<'a>) -> Box<dyn Fold + 'a> {
    Box::new(Points { frame, order: None })
}

/// The translucent splats of a frame that are the technique's own.
struct Points<'a> {
    frame: &'a Frame<'a>,
    /// Once it was made.
    order: Option<SliceOrder>,
}

impl Fold for Points<'_> {
    fn fold(
        &mut self,
        range: Range<f32>,
        into: &mut Accumulator,
        _: &mut Session<'_>,
        cost: &mut CostRecord,
    ) -> Result<(), Error> {
        let frame = self.frame;
        let whole = range == EVERYWHERE && frame.plan.techniques.len() == 1;
        if whole && self.by_device(into, cost)? {
            return Ok(());
        }
        frame.maps(cost)?;
        if self.order.is_none() {
            let order = sorted(frame, Technique::Points, &sort_params(frame), cost)?;
            self.order = Some(match frame.settings.points.first_slices {
                Some(n) => order.first_slices(usize::try_from(n).unwrap_or(usize::MAX)),
                None => order,
            });
        }
        let order = self.order.as_ref().expect("invariant: the order was made above");
        // Ranges of other techniques' things between them would finish pixels earlier.
        let in_one_go = whole && order.direction == Direction::FrontToBack;
        frame.shaded_in_order(in_one_go.then_some(&order.input_from_sorted), cost)?;
        frame.opaque(cost)?;
        composite(frame, order, range, into, cost)
    }
}

/// Slices of the translucent splats of a technique; an empty order without any.
pub(super) fn sorted(
    frame: &Frame<'_>,
    technique: Technique,
    params: &hbsort::Params,
    cost: &mut CostRecord,
) -> Result<SliceOrder, Error> {
    let cloud = frame.drawn();
    let camera = &frame.camera;
    let translucent = frame.translucent(technique);
    if translucent.is_empty() {
        return Ok(SliceOrder::default());
    }
    frame.progress.begin(stage::SORT);
    frame.tick()?;
    cost.measure(pass::SORT, |stage| {
        let helped = frame.helper.and_then(|helper| device::order(helper, cloud, translucent, camera, params));
        let order = helped.map_or_else(
            || hbsort::slice_cloud(cloud, Some(translucent), camera, params, &mut hbsort::Scratch::default()),
            Ok,
        );
        let order = order.map_err(|e| Error::Internal(e.to_string()))?;
        stage.items_in = translucent.len() as u64;
        stage.items_out = order.input_from_sorted.len() as u64;
        stage.bytes = order.bytes();
        Ok(order)
    })
}

/// Why splats are in exact order inside slices whatever a scene states; `None` where it decides.
fn exact_because(depths: bool, plan: &Plan, loaded: &Loaded) -> Option<&'static str> {
    // Depths are made from splats in order, not from slices, and Gaussians were fitted to pictures in order. Of thick media the first splats
    // hide the others of their slice.
    if depths {
        Some("layers of depth are made from splats in order")
    } else if plan.eye_table.is_some() {
        Some("the first splats of a thick medium hide the others of their slice")
    } else if !loaded.cloud.gaussians.is_empty() {
        Some("3D Gaussians were fitted to pictures in exact order")
    } else {
        None
    }
}

/// Settings of the order and of the sums of translucent splats, where there are any.
pub(crate) fn settings(scene: &Scene, loaded: &Loaded, plan: &Plan) -> Vec<PlannedSetting> {
    if !plan.passes.iter().any(|planned| planned.name == pass::SORT) {
        return Vec::new();
    }
    let points = &scene.render.points;
    let stated = scene.render.stated;
    let because = exact_because(scene.render.layers.set().depth, plan, loaded);
    let plain = because.unwrap_or("slices alone leave splats within them out of order, and save little time");
    let key = "render.points.exact";
    let exact = match because {
        Some(reason) if !points.exact => PlannedSetting {
            key: key.to_owned(),
            value: "true".to_owned(),
            is_stated: stated.exact,
            reason: format!("the scene states false, and {reason}"),
        },
        _ => PlannedSetting::new(key, points.exact, stated.exact, plain),
    };
    let precision = precision(points.accumulation);
    let is_stated = stated.accumulation_of_points;
    vec![exact, PlannedSetting::new("render.points.accumulation", precision, is_stated, IN_F32)]
}

/// Why the plan takes single precision for sums.
pub(crate) const IN_F32: &str = "sums of half precision stall where many terms are added";

/// A precision, as a scene has it.
pub(crate) fn precision(accumulation: Accumulation) -> &'static str {
    match accumulation {
        Accumulation::F32 => "\"f32\"",
        Accumulation::F16 => "\"f16\"",
    }
}

fn sort_params(frame: &Frame<'_>) -> hbsort::Params {
    let points = &frame.settings.points;
    hbsort::Params {
        direction: points.direction,
        thickness: frame.loaded.slice_thickness.map_or(hbsort::Thickness::Auto, hbsort::Thickness::World),
        exact: points.exact || exact_because(frame.layers.depth, frame.plan, frame.loaded).is_some(),
        margin_px: frame.filter_reach_px(),
        ..hbsort::Params::default()
    }
}

impl Frame<'_> {
    /// Composites the splats of an order of [`Frame::drawn`] in front of the opaque ones, behind all that the accumulator holds, as
    /// the technique `points` does. Adds the time and the counts to `cost`.
    ///
    /// # Errors
    /// [`Error::Cancelled`], and those of [`Frame::maps`].
    pub fn composite(&self, order: &SliceOrder, into: &mut Accumulator, cost: &mut CostRecord) -> Result<(), Error> {
        composite(self, order, EVERYWHERE, into, cost)
    }
}

/// Composites the splats of an order whose centres lie at view depths in `range` in front of the opaque ones, behind all that the accumulator holds.
fn composite(
    frame: &Frame<'_>,
    order: &SliceOrder,
    range: Range<f32>,
    into: &mut Accumulator,
    cost: &mut CostRecord,
) -> Result<(), Error> {
    let mut ids = Cow::Borrowed(order.input_from_sorted.as_slice());
    if ids.is_empty() {
        return Ok(());
    }
    let mut direction = order.direction;
    let whole = range == EVERYWHERE;
    if (frame.layers.depth || !whole) && direction == Direction::BackToFront {
        // Depths, and one range after the other, are made front to back. The picture is the same.
        ids.to_mut().reverse();
        direction = Direction::FrontToBack;
    }
    let ids = if whole { &ids[..] } else { &ids[within(frame, &ids, range)] };
    let Shaded { projected, values, .. } = frame.shaded(cost)?;
    let opaque = frame.opaque(cost)?;
    frame.progress.begin(stage::COMPOSITE);
    frame.tick()?;
    cost.measure(pass::SPLAT, |stage| {
        stage.items_in = ids.len() as u64;
        let materials = &frame.loaded.materials;
        let params = frame.raster_params();
        let input = FoldInput { projected, order: ids, values, materials, opaque, direction, params: &params };
        let counts = raster::fold(&input, into, Some(frame.progress));
        let counts = counts.map_err(|e| Error::from_core("compositing", e))?;
        record(stage, &counts);
        Ok::<_, Error>(())
    })?;
    frame.tick()
}

/// The part of an order, front to back, whose centres lie at view depths in a range. Ranges that meet share no splat and lose
/// none: where slices are not sorted inside, a splat belongs to where the order has it.
fn within(frame: &Frame<'_>, ids: &[u32], range: Range<f32>) -> Range<usize> {
    let cloud = frame.drawn();
    let place = frame.camera.view_from_offset(cloud.origin);
    let before = |limit: f32| ids.partition_point(|i| place.depth(cloud.position[*i as usize]) < limit);
    let start = if range.start <= 0.0 { 0 } else { before(range.start) };
    let end = if range.end == f32::INFINITY { ids.len() } else { before(range.end) };
    start..end.max(start)
}
