//! Exact compositing: all fragments of a pixel, sorted, one by one.

use crate::splats::footprint::{Profile, Splat, profiles};
use rayon::prelude::*;
use splat_core::{Camera, Cloud, Error, FootprintStack, Material, Progress, SHADED_EFFECTS, SplatKind};

/// What the fragments of a pixel are sorted by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Order {
    /// View depth of the splat's centre, then id: what a sort of splats can reach at best.
    Centre,
    /// View depth of the fragment itself, then id: the truth per pixel.
    Fragment,
}

/// Splats with one list of values each, seen by a camera.
pub struct Input<'a> {
    /// The splats.
    pub cloud: &'a Cloud,
    /// The viewer.
    pub camera: &'a Camera,
    /// Footprints by id.
    pub footprints: &'a FootprintStack,
    /// Materials by id.
    pub materials: &'a [Material],
    /// `channels` numbers a splat, by splat id.
    pub values: &'a [f32],
    /// Numbers a splat; the first three are a colour.
    pub channels: usize,
    /// Standard deviation of the resampling filter, pixels.
    pub resampling_sigma_px: f32,
    /// Sort key.
    pub order: Order,
}

/// An image in f64, row by row from the top left.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactImage {
    /// Σ weight·value per pixel and channel, opaque surfaces included, background not.
    pub values: Vec<Vec<f64>>,
    /// Transmittance to the background per channel.
    pub transmittance: Vec<[f64; 3]>,
}

/// ε-z of opaque surfaces, part of the definition of an opaque splat.
const EPSILON_Z: f64 = 0.5;

/// Composites all splats of the input exactly, in f64. Rows of pixels are reported to `progress`, and work stops where that is
/// cancelled.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn composite(input: &Input<'_>, progress: Option<&Progress>) -> Result<ExactImage, Error> {
    let profiles = profiles(input.footprints);
    let splats = splats(input, &profiles);
    let pixels = by_pixel(input, &splats, |ids, x, y| pixel(input, &splats, ids, x, y), progress)?;
    let mut image = ExactImage { values: Vec::new(), transmittance: Vec::new() };
    for p in pixels {
        image.values.push(p.values);
        image.transmittance.push(p.transmittance);
    }
    Ok(image)
}

/// A translucent fragment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fragment {
    /// Id of its splat.
    pub splat: u32,
    /// View depth by which it is sorted.
    pub depth: f64,
    /// Optical depth where its material absorbs with factor 1, without what an opaque surface hides.
    pub optical_depth: f64,
    /// Squared distance from the splat's centre over its squared radius, below 1.
    pub distance_sq: f64,
}

/// What becomes of the fragments of every pixel, sorted near to far: the way to composite the same splats exactly into anything.
/// `solid` has for each pixel the view depth of an opaque surface, which hides what lies behind it, and +∞ where there is none;
/// it may be empty. Opaque splats have no fragments. Rows of pixels are reported to `progress`, and work stops where that is
/// cancelled.
///
/// # Errors
/// [`Error::Cancelled`].
pub fn fold_fragments<T: Send>(
    input: &Input<'_>,
    solid: &[f32],
    fold: impl Fn(usize, &[Fragment]) -> T + Sync,
    progress: Option<&Progress>,
) -> Result<Vec<T>, Error> {
    let width = input.camera.size[0] as usize;
    let profiles = profiles(input.footprints);
    let splats = splats(input, &profiles);
    let of_pixel = |ids: &[u32], x: usize, y: usize| {
        let k = y * width + x;
        let surface = solid.get(k).map_or(f64::INFINITY, |d| f64::from(*d));
        fold(k, &fragments(input, &splats, ids, x, y, surface))
    };
    by_pixel(input, &splats, of_pixel, progress)
}

fn splats<'a>(input: &Input<'_>, profiles: &'a [Profile]) -> Vec<Option<Splat<'a>>> {
    (0..input.cloud.len()).into_par_iter().map(|i| Splat::new(input, profiles, i)).collect()
}

/// Something of every pixel from the splats that may reach it, row by row.
fn by_pixel<T: Send>(
    input: &Input<'_>,
    splats: &[Option<Splat<'_>>],
    of_pixel: impl Fn(&[u32], usize, usize) -> T + Sync,
    progress: Option<&Progress>,
) -> Result<Vec<T>, Error> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    let [width, height] = input.camera.size.map(|s| s as usize);
    progress.add_total(height as u64);
    let mut by_row: Vec<Vec<u32>> = vec![Vec::new(); height];
    for (i, splat) in splats.iter().enumerate() {
        if let Some(splat) = splat {
            splat.range(1, height).for_each(|y| by_row[y].push(i as u32));
        }
    }
    let rows: Result<Vec<Vec<T>>, Error> = by_row
        .par_iter()
        .enumerate()
        .map(|(y, ids)| {
            progress.tick(1)?;
            let mut lists: Vec<Vec<u32>> = vec![Vec::new(); width];
            for &i in ids {
                let splat = splats[i as usize].as_ref().expect("invariant: listed splats exist");
                splat.range(0, width).for_each(|x| lists[x].push(i));
            }
            Ok(lists.iter().enumerate().map(|(x, ids)| of_pixel(ids, x, y)).collect())
        })
        .collect();
    Ok(rows?.into_iter().flatten().collect())
}

/// The translucent fragments of a pixel before a surface, sorted.
fn fragments(
    input: &Input<'_>,
    splats: &[Option<Splat<'_>>],
    ids: &[u32],
    x: usize,
    y: usize,
    surface_depth: f64,
) -> Vec<Fragment> {
    let mut fragments: Vec<Fragment> = Vec::new();
    for &i in ids {
        let splat = splats[i as usize].as_ref().expect("invariant: listed splats exist");
        let Some(f) = splat.fragment(input, x, y) else { continue };
        let seen = match splat.kind {
            SplatKind::Medium => splat.share_before(surface_depth, &f),
            SplatKind::Surface => f64::from(f.depth < surface_depth),
            SplatKind::Opaque => 0.0,
        };
        if seen > 0.0 {
            let depth = if input.order == Order::Centre { splat.depth } else { f.depth };
            fragments.push(Fragment { splat: i, depth, optical_depth: f.amount * seen, distance_sq: f.distance_sq });
        }
    }
    fragments.sort_by(|a, b| a.depth.total_cmp(&b.depth).then(a.splat.cmp(&b.splat)));
    fragments
}

struct Pixel {
    values: Vec<f64>,
    transmittance: [f64; 3],
}

fn pixel(input: &Input<'_>, splats: &[Option<Splat<'_>>], ids: &[u32], x: usize, y: usize) -> Pixel {
    let at = |i: u32| {
        let splat = splats[i as usize].as_ref().expect("invariant: listed splats exist");
        splat.fragment(input, x, y).map(|f| (splat, f))
    };
    let solid = opaque(input, ids, &at);
    let surface_depth = solid.as_ref().map_or(f64::INFINITY, |s| s.0);
    let fragments = fragments(input, splats, ids, x, y, surface_depth);
    let mut out = Pixel { values: vec![0.0; input.channels], transmittance: [1.0; 3] };
    for f in &fragments {
        let material = input.cloud.material[f.splat as usize] as usize;
        let keep = input.materials[material].extinction_rgb.map(|k| (-f.optical_depth * f64::from(k)).exp());
        for (c, value) in out.values.iter_mut().enumerate() {
            let p = band(c, input.channels);
            *value +=
                out.transmittance[p] * (1.0 - keep[p]) * f64::from(input.values[f.splat as usize * input.channels + c]);
        }
        (0..3).for_each(|c| out.transmittance[c] *= keep[c]);
    }
    if let Some((_, color)) = solid {
        for (c, value) in out.values.iter_mut().enumerate() {
            *value += out.transmittance[band(c, input.channels)] * color[c];
        }
        out.transmittance = [0.0; 3];
    }
    out
}

/// The wavelength that attenuates channel `c`. One colour comes first, or every effect apart; what is no colour, normal
/// and shadow, goes with green.
fn band(c: usize, channels: usize) -> usize {
    const APART: usize = 3 * SHADED_EFFECTS.len();
    let colored = match channels {
        0..3 => 0,
        3..APART => 3,
        _ => APART,
    };
    if c < colored { c % 3 } else { 1 }
}

/// Nearest opaque surface: depth and blended values.
fn opaque<'a>(
    input: &Input<'_>,
    ids: &[u32],
    at: &impl Fn(u32) -> Option<(&'a Splat<'a>, crate::splats::footprint::Fragment)>,
) -> Option<(f64, Vec<f64>)> {
    let solid = |i: u32| at(i).filter(|(splat, _)| splat.kind == SplatKind::Opaque);
    let nearest = ids
        .iter()
        .filter_map(|&i| solid(i))
        .filter(|(_, f)| f.is_solid)
        .map(|(_, f)| f.depth)
        .fold(f64::INFINITY, f64::min);
    if nearest == f64::INFINITY {
        return None;
    }
    let mut weight = 0.0;
    let mut depth = 0.0;
    let mut values = vec![0.0; input.channels];
    for &i in ids {
        let Some((splat, f)) = solid(i) else { continue };
        if (f.depth - nearest).abs() <= EPSILON_Z * splat.radius {
            weight += f.amount;
            depth += f.amount * f.depth;
            for (c, value) in values.iter_mut().enumerate() {
                *value += f.amount * f64::from(input.values[i as usize * input.channels + c]);
            }
        }
    }
    (weight > 0.0).then(|| (depth / weight, values.iter().map(|v| v / weight).collect()))
}
