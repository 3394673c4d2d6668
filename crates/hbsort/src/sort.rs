//! The steps of Figure 9 in a row: cull and project, choose ε, first level, second level, slices.

use crate::buckets;
use crate::crowd;
use crate::depth_bits::{DIGITS, DepthBits, MOST_PASSES, leaf_capacity};
use crate::first_level::{Distributed, distribute, scan_buckets};
use crate::project::{Extremes, Projector, extremes_of};
use crate::ranges::{BINS, Ranges, SAMPLERS, bucket_count};
use crate::scratch::{CHUNK, MOST_SPLATS, Method, SortInfo, ThicknessRule, resize};
use crate::slicing::Slicing;
use crate::{Error, Params, Scratch, cost, thickness};
use rayon::prelude::*;
use splat_core::{Camera, Cloud, Exceeded, SliceOrder};
use std::sync::{Mutex, PoisonError};

/// Slices whose index one task finds at least.
const INDEXED: usize = 1 << 12;

/// Culls the splats of a cloud against the view and orders the rest in slices of equal view-depth thickness.
///
/// A splat is kept when its sphere of cutoff radius reaches into the view pyramid (or the box of parallel rays) and
/// in front of the eye plane; so kept depths may be as small as −radius. `ids` restricts the sort to a subset, such as
/// the translucent splats; strictly ascending. Splats of one slice stand in the order of their ids; with
/// [`Params::exact`], more slices than [`Params::max_slices`], or most of very many splats in one of the two levels'
/// buckets, in the order of their depths, then ids. The result
/// has the same bits for any number of threads. Scaling scene and camera by a power of two changes no id.
///
/// # Errors
/// [`Error::Thickness`], [`Error::Ids`] or [`Error::Limit`]. A cloud whose columns differ in
/// length is cut to the shorter of positions and radii; splats that are no finite numbers are culled.
pub fn slice_cloud(
    cloud: &Cloud,
    ids: Option<&[u32]>,
    camera: &Camera,
    params: &Params,
    scratch: &mut Scratch,
) -> Result<SliceOrder, Error> {
    let len = cloud.len().min(cloud.radius.len());
    check_count(len)?;
    if let Some(ids) = ids {
        check_ids(ids, len)?;
    }
    params.given_thickness()?;
    let mut order = scratch.take_order(ids.map_or(len, <[u32]>::len))?;
    let projector = Projector::new(cloud, ids, camera, params.margin_px);
    let extremes = projector.project(&mut order.input_from_sorted);
    slice_projected(cloud, ids, Bits { extremes, order }, |id| projector.depth(id), params, scratch)
}

/// Results of a projection: the bits of the depths, in the place of the later ids, and their extremes.
pub(crate) struct Bits {
    pub(crate) extremes: Extremes,
    pub(crate) order: SliceOrder,
}

/// Slices the splats of a cloud, or those of `ids`, once their depths are known. `depth_of` gives a splat's depth by its
/// id.
pub(crate) fn slice_projected(
    cloud: &Cloud,
    ids: Option<&[u32]>,
    Bits { extremes, order }: Bits,
    depth_of: impl Fn(u32) -> f32 + Sync,
    params: &Params,
    scratch: &mut Scratch,
) -> Result<SliceOrder, Error> {
    let given = params.given_thickness()?;
    let n = order.input_from_sorted.len();
    let Some((near, far)) = extremes.depths() else { return Ok(nothing(order, params, n, scratch)) };
    let radius_of_place = |place: usize| cloud.radius[ids.map_or(place, |ids| ids[place] as usize)];
    let (thickness, rule) = given.map_or_else(
        || thickness::choose(f64::from(far) - f64::from(near), extremes.smallest_radius(), n, &radius_of_place),
        |t| (t, ThicknessRule::Given),
    );
    let slicing = slicing_of(near, far, thickness, params, n);
    let id_of = |place: u32| ids.map_or(place, |ids| ids[place as usize]);
    run(&slicing, Splats { depths: None, depth_of, id_of }, rule, order, scratch)
}

/// Orders ready view depths in slices; nothing is culled, and the id of a splat is its place in `depth`.
///
/// # Errors
/// [`Error::Depth`] for a depth that is not finite, [`Error::NoRadii`] without [`crate::Thickness::World`],
/// [`Error::Thickness`] or [`Error::Limit`].
pub fn slice_depths(depth: &[f32], params: &Params, scratch: &mut Scratch) -> Result<SliceOrder, Error> {
    check_count(depth.len())?;
    let thickness = params.given_thickness()?.ok_or(Error::NoRadii)?;
    let extremes = extremes_of(depth)?;
    let order = scratch.take_order(depth.len())?;
    let Some((near, far)) = extremes.depths() else { return Ok(nothing(order, params, 0, scratch)) };
    let slicing = slicing_of(near, far, thickness, params, depth.len());
    let splats = Splats { depths: Some(depth), depth_of: |id: u32| depth[id as usize], id_of: |place: u32| place };
    run(&slicing, splats, ThicknessRule::Given, order, scratch)
}

pub(crate) fn check_count(n: usize) -> Result<(), Error> {
    if n as u64 <= MOST_SPLATS {
        return Ok(());
    }
    let what = "an order".into();
    let hint = "sort parts of the cloud, one behind the other".into();
    Err(Error::Limit(Exceeded { what, needed: n as u64, limit: Some(MOST_SPLATS), unit: "splats", hint }))
}

pub(crate) fn check_ids(ids: &[u32], len: usize) -> Result<(), Error> {
    let sorted = ids.windows(2).all(|w| w[0] < w[1]);
    if sorted && ids.last().is_none_or(|&last| (last as usize) < len) {
        return Ok(());
    }
    let bad = |i: &usize| ids[*i] as usize >= len || (*i > 0 && ids[*i - 1] >= ids[*i]);
    let index = (0..ids.len()).find(bad).unwrap_or(0);
    Err(Error::Ids { index, found: ids[index], len })
}

/// Two levels hold at most 2²⁰ slices, and no more than a multiple of the splats: else emptying buckets would cost
/// more than sorting.
fn slicing_of(near: f32, far: f32, thickness: f64, params: &Params, n: usize) -> Slicing {
    let limit = params.max_slices.min(Params::MOST_SLICES).min(16 * n as u64 + 4096);
    let limit = if params.exact { 0 } else { limit };
    Slicing::new(near, far, thickness, params.direction, limit)
}

fn nothing(mut order: SliceOrder, params: &Params, n: usize, scratch: &mut Scratch) -> SliceOrder {
    order.input_from_sorted.clear();
    order.direction = params.direction;
    order.culled = n as u64;
    scratch.info = SortInfo { items_in: n as u64, bytes: scratch.bytes(), ..SortInfo::default() };
    order
}

/// Splats as the sort sees them.
struct Splats<'a, D, I> {
    /// Depths by place; `None` where their bits stand in the order.
    depths: Option<&'a [f32]>,
    /// A splat's depth by its id.
    depth_of: D,
    /// A splat's id by its place.
    id_of: I,
}

/// The two levels and the slices, once near, far and ε are known. `order` holds the bits of the depths, unless the splats
/// have them.
fn run<D: Fn(u32) -> f32 + Sync, I: Fn(u32) -> u32 + Sync>(
    slicing: &Slicing,
    Splats { depths, depth_of, id_of }: Splats<'_, D, I>,
    rule: ThicknessRule,
    mut order: SliceOrder,
    scratch: &mut Scratch,
) -> Result<SliceOrder, Error> {
    let n = order.input_from_sorted.len();
    let bits = |place: usize| depths.map_or_else(|| order.input_from_sorted[place], |d| d[place].to_bits());
    let ranges = slicing.buckets > 0 && crowd::crowds(slicing, n, bits);
    let slicing = if ranges { &slicing.without_levels() } else { slicing };
    let method = if slicing.buckets > 0 { Method::TwoLevels } else { Method::DepthBits };
    let buckets = if slicing.buckets > 0 { slicing.buckets as usize } else { bucket_count(n) };
    prepare(scratch, method, n, buckets)?;
    let ids = &mut order.input_from_sorted;
    let kept = match method {
        Method::DepthBits => {
            let depth_at = |place: usize| depth_of(id_of(place as u32));
            by_depth_bits(slicing, depths, depth_at, &id_of, ids, scratch)
        }
        _ => by_two_levels(slicing, depths, &id_of, ids, scratch),
    };
    ids.truncate(kept);
    let slices = buckets::join_slices(&scratch.bucket_starts, ids, &mut scratch.bucket_slices);
    resize(&mut order.slice_starts, slices + 1)?;
    let starts = &scratch.bucket_starts;
    let found = &scratch.bucket_slices;
    buckets::gather_marks(0..buckets, starts, ids, found, &mut order.slice_starts[..slices]);
    order.slice_starts[slices] = kept as u32;
    resize(&mut order.slice_indices, slices)?;
    index_slices(slicing, &mut order, &depth_of);
    scratch.info = SortInfo { items_in: n as u64, rule, method, buckets: buckets as u32, bytes: scratch.bytes() };
    Ok(SliceOrder {
        direction: slicing.direction,
        near: slicing.near,
        far: slicing.far,
        thickness: slicing.thickness,
        slices: slicing.slices,
        culled: (n - kept) as u64,
        ..order
    })
}

/// Which slices those are that begin at `slice_starts`: as their first splats tell.
fn index_slices(slicing: &Slicing, order: &mut SliceOrder, depth_of: &(impl Fn(u32) -> f32 + Sync)) {
    let SliceOrder { input_from_sorted: ids, slice_starts: starts, slice_indices: indices, .. } = order;
    let index_of = |(index, start): (&mut u64, &u32)| *index = slicing.slice_of(depth_of(ids[*start as usize]));
    indices.par_iter_mut().zip(&starts[..]).with_min_len(INDEXED).for_each(index_of);
}

/// Makes every buffer as large as the sort needs it.
fn prepare(scratch: &mut Scratch, method: Method, n: usize, buckets: usize) -> Result<(), Error> {
    resize(&mut scratch.entries, cost::entry_words(method, n))?;
    resize(&mut scratch.rows, n.div_ceil(CHUNK) * (buckets + 1))?;
    resize(&mut scratch.bucket_starts, buckets + 1)?;
    resize(&mut scratch.bucket_slices, buckets)?;
    if method == Method::DepthBits {
        resize(&mut scratch.samples, SAMPLERS * BINS)?;
        resize(&mut scratch.bucket_of_bin, BINS)?;
        scratch.leaves.resize_with(scratch.leaves.len().max(rayon::current_num_threads()), Mutex::default);
        for leaf in &mut scratch.leaves {
            let leaf = leaf.get_mut().unwrap_or_else(PoisonError::into_inner);
            resize(&mut leaf.entries, 2 * leaf_capacity(n, buckets))?;
            resize(&mut leaf.counts, MOST_PASSES * DIGITS)?;
        }
    }
    Ok(())
}

/// The paper's order; number of kept splats.
fn by_two_levels(
    slicing: &Slicing,
    depths: Option<&[f32]>,
    id_of: impl Fn(u32) -> u32 + Sync,
    ids: &mut [u32],
    scratch: &mut Scratch,
) -> usize {
    let buckets = slicing.buckets as usize;
    let entries = &mut bytemuck::cast_slice_mut::<u64, u32>(&mut scratch.entries)[..ids.len()];
    distribute(slicing, ids, depths, entries, &mut scratch.rows);
    scan_buckets(&scratch.rows, &mut scratch.bucket_starts);
    let distributed = Distributed { entries, rows: &scratch.rows, buckets };
    let starts = &scratch.bucket_starts;
    let kept = starts[buckets] as usize;
    let order = |b: usize, out: &mut [u32]| crate::second_level::slice_bucket(distributed, b, &id_of, out);
    buckets::for_each(0..buckets, starts, &mut ids[..kept], &mut scratch.bucket_slices, &order);
    kept
}

/// The order by depth, then place; number of kept splats.
fn by_depth_bits<D: Fn(usize) -> f32 + Sync, I: Fn(u32) -> u32 + Sync>(
    slicing: &Slicing,
    depths: Option<&[f32]>,
    depth_at: D,
    id_of: I,
    ids: &mut [u32],
    scratch: &mut Scratch,
) -> usize {
    let n = ids.len();
    let ranges = {
        // The ids are the bits of the depths until the second level writes them.
        let at = |place: usize| depths.map_or_else(|| f32::from_bits(ids[place]), |d| d[place]);
        Ranges::sample(slicing, &at, n, &mut scratch.samples, &mut scratch.bucket_of_bin)
    };
    ranges.distribute(slicing, ids, depths, &mut scratch.entries, &mut scratch.rows);
    scan_buckets(&scratch.rows, &mut scratch.bucket_starts);
    let distributed = Distributed { entries: &scratch.entries, rows: &scratch.rows, buckets: ranges.buckets };
    let leaf_capacity = leaf_capacity(n, ranges.buckets);
    let sort = DepthBits { slicing, ranges, distributed, leaf_capacity, depth_at, id_of };
    let starts = &scratch.bucket_starts;
    let leaves = &scratch.leaves;
    let kept = starts[ranges.buckets] as usize;
    let order = |b: usize, out: &mut [u32]| sort.order_bucket(b, leaves, out);
    buckets::for_each(0..ranges.buckets, starts, &mut ids[..kept], &mut scratch.bucket_slices, &order);
    kept
}
