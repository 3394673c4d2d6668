//! The opaque surface of a pixel, in f64: that of most weight among the nearest that together cover half of it.

use crate::footprint::{Fragment, Splat};

/// ε-z of opaque surfaces as a share of the radius, the share of a disc within which it may be the nearest, the coverage from
/// which on a surface is solid and how many are looked through, each four times as deep: part of the definition of an opaque splat.
const EPSILON_Z: f64 = 0.5;
const CORE: f64 = 0.45 * 0.45;
const SOLID: f64 = 0.48;
const MOST_LAYERS: usize = 8;

/// Weight of an opaque disc that faces away.
const FACING_AWAY: f64 = 1.0 / 256.0;

/// One opaque disc at the pixel.
pub(crate) struct Disc<'a> {
    pub(crate) id: u32,
    pub(crate) splat: &'a Splat,
    pub(crate) fragment: Fragment,
}

/// A solid surface.
pub(crate) struct Surface<'a> {
    /// Depth of its nearest disc.
    pub(crate) nearest: f64,
    /// Its discs and their weights.
    pub(crate) discs: Vec<(&'a Disc<'a>, f64)>,
}

/// The surface that a pixel shows.
pub(crate) fn surface<'a>(discs: &'a [Disc<'a>]) -> Option<Surface<'a>> {
    let (mut thin, mut coverage) = (f64::NEG_INFINITY, [0.0; 2]);
    let mut best: Option<Surface<'_>> = None;
    for layer in 0..MOST_LAYERS {
        let epsilon_z = EPSILON_Z * f64::from(1 << (2 * layer));
        let behind = || discs.iter().filter(|d| d.fragment.depth > thin);
        let nearest = behind().filter(|d| d.fragment.s < CORE).map(|d| d.fragment.depth).reduce(f64::min)?;
        let layer: Vec<&Disc<'_>> =
            behind().filter(|d| (d.fragment.depth - nearest).abs() < epsilon_z * d.splat.radius).collect();
        for disc in &layer {
            coverage[usize::from(disc.splat.faces_away)] +=
                disc.fragment.amount + f64::from(u8::from(disc.fragment.is_own));
        }
        thin = layer.iter().map(|d| d.fragment.depth).fold(nearest, f64::max);
        let weight = |d: &Disc<'_>| d.fragment.amount * if d.splat.faces_away { FACING_AWAY } else { 1.0 };
        let found = Surface { nearest, discs: layer.into_iter().map(|d| (d, weight(d))).collect() };
        best = best.filter(|best| best.weight() > found.weight()).or(Some(found));
        if coverage[0].max(coverage[1]) >= SOLID {
            return best;
        }
    }
    None
}

impl Surface<'_> {
    fn weight(&self) -> f64 {
        self.discs.iter().map(|(_, weight)| weight).sum()
    }
}
