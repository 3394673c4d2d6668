//! Expected errors of settings, from a few small pictures. Each setting is turned alone, and their errors add up as independent errors do.
//!
//! Every picture is compared with the small picture of the scene's stated settings, as both are displayed.
//! - **Samples of a pixel**: each value is drawn. Edges are lines, whose pixels are a share of the picture that goes with one over its width, so their
//!   RMSE goes with the root of the width of a pixel and their mean FLIP with the width; detail that is finer than pixels errs by the same at every
//!   size. Powers between these are taken: a fourth, and three quarters.
//! - **Splats**: a base of a sixteenth, and a half and a quarter of it are drawn. A share s of all errs by C·(1/s − 1)ʰ: independent choices would
//!   have h = ½, larger footprints less. h comes from both pictures. With a base s₀ of which a share t is drawn, the same law gives
//!   C·s₀⁻ʰ·(1/t − 1)ʰ. Pixels of small pictures average what is finer: grain would err in proportion to one over their width, blur by the same at
//!   every size. A power between is taken, a fourth, and none for FLIP, which looks at what is coarse.
//! - **Sets of particles**: of a half of the sets in the base, which are among them. The mean of n sets of all N differs from that of all by σ·√(1/n − 1/N); with
//!   other samples of a pixel all sets are others, and their variances add up.

use super::rung::{Rung, antialias_values, is_random};
use super::small::{Drawing, part_of};
use super::trial::{TRIAL_SIDE, TRIAL_SPLATS, Trial};
use crate::Error;
use crate::cost::Prediction;
use crate::load::Loaded;
use reference::metrics::{Display, Image, MetricError, Viewing, compare, flip};

/// Pixels along the longer side of a small picture, at most.
const PROBE_SIDE: u32 = 96;
/// Sets of particles in a small picture, at most.
const PROBE_SETS: u32 = 8;
/// Orders of splats that are taken, where noise would give others.
const ORDERS: std::ops::RangeInclusive<f64> = 0.1..=1.0;
/// Fewest pixels of a degree that FLIP's filters can tell apart.
const LEAST_PIXELS_PER_DEGREE: f64 = 16.0;

// Errors of typical scenes: medians over `scenes/` of what small pictures told at 240x180 pixels. They stand in where such pictures would take too much of a
// requested time.
/// RMSE of one sample of a pixel in the place of four: 16 scenes, 0.006 to 0.052.
const TYPICAL_SAMPLES: f64 = 0.018;
/// C of fewer splats, in RMSE: 18 scenes, 0.003 to 0.075.
const TYPICAL_SPLATS: f64 = 0.01;
/// h of fewer splats: 18 scenes, 0.12 to 0.6.
const TYPICAL_ORDER: f64 = 0.43;
/// σ of one set of particles, in RMSE: 4 scenes, 0.07 to 0.17.
const TYPICAL_SET: f64 = 0.14;
/// Mean FLIP over RMSE: 313 settings, of which 80 % have 1.1 to 2.6.
const FLIP_OF_RMSE: f64 = 2.0;

/// Powers of a pixel's width that the errors of a measure go with.
#[derive(Debug, Clone, Copy)]
struct OfWidth {
    /// Of fewer samples.
    samples: f64,
    /// Of fewer splats.
    splats: f64,
}

const OF_RMSE: OfWidth = OfWidth { samples: 0.25, splats: -0.25 };
const OF_FLIP: OfWidth = OfWidth { samples: 0.75, splats: 0.0 };

/// Differences of two displayed pictures.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExpectedError {
    /// Root mean square of the channels' differences, 0 to 1.
    pub rmse: f64,
    /// Mean FLIP, 0 to 1, of the whole picture, seen from 0.7 m on a screen 0.7 m wide with 3840 pixels.
    pub flip: f64,
}

/// What the settings of a scene err by.
pub(super) struct Errors {
    asked: Rung,
    /// Whether pictures of the scene told it, not those of others.
    pub(super) are_probed: bool,
    rmse: Curves,
    flip: Curves,
    /// Counted work of the base, and of a quarter of its splats; `None` where nothing is made of splats.
    pub(super) thinned: Option<Thinned>,
}

/// Counted work of two small pictures that differ in their splats alone.
pub(super) struct Thinned {
    pub(super) base: Prediction,
    pub(super) quarter: Prediction,
}

/// How one measure goes with each setting.
#[derive(Debug, Clone, Default, PartialEq)]
struct Curves {
    /// Of fewer samples.
    samples: Vec<OfSamples>,
    /// C and h of fewer splats.
    scale: f64,
    order: f64,
    /// σ of one set.
    of_a_set: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct OfSamples {
    antialias: u32,
    error: f64,
}

/// A measure of each picture in which one setting was turned, and the settings of the others.
struct Probed {
    asked: Rung,
    base: Rung,
    /// Longer side of the small pictures over that of the whole.
    smaller: f64,
    samples: Vec<Turned>,
    thinned: Vec<Turned>,
    noise: Option<Turned>,
}

/// A picture with one setting turned, against the base.
struct Turned {
    rung: Rung,
    error: ExpectedError,
}

impl Errors {
    /// Draws the small pictures; where a time has to be kept to, they are no larger than the trial's. Errors are those of typical scenes where the pictures would
    /// take longer than `most_seconds`, as a trial tells.
    pub(super) fn new(
        drawing: &Drawing<'_>,
        loaded: &mut Loaded,
        trial: &Trial,
        has_time: bool,
        most_seconds: f64,
    ) -> Result<Self, Error> {
        let asked = Rung::of_scene(drawing.scene);
        let has_splats = !loaded.cloud.is_empty();
        let whole = drawing.scene.camera.size;
        let longest = whole[0].max(whole[1]);
        let most = if has_time { PROBE_SIDE.min(longest.div_ceil(TRIAL_SIDE)) } else { PROBE_SIDE };
        let size = part_of(whole, longest.div_ceil(most));
        let is_random = is_random(drawing.scene);
        let base = Rung {
            splat_share: asked.splat_share * TRIAL_SPLATS,
            sets: if is_random { asked.sets.min(PROBE_SETS) } else { asked.sets },
            ..asked
        };
        let coarser = antialias_values(asked).into_iter().skip(1).map(|antialias| Rung { antialias, ..base });
        let parts = if has_splats { &[0.5, 0.25][..] } else { &[] };
        let fewer = parts.iter().map(|part| Rung { splat_share: part * base.splat_share, ..base });
        let noisy = (is_random && base.sets >= 2).then_some(Rung { sets: base.sets / 2, ..base });
        let every = std::iter::once(base).chain(coarser.clone()).chain(fewer.clone()).chain(noisy);
        if every.map(|rung| trial.seconds(rung, size)).sum::<f64>() > most_seconds {
            return Self::typical(drawing, loaded, asked, base, size);
        }
        let mut small = |rung: Rung| displayed(drawing, loaded, rung, size);
        let reference = small(base)?;
        let smaller = f64::from(size[0].max(size[1])) / f64::from(longest);
        let mut probed = Probed { asked, base, smaller, samples: Vec::new(), thinned: Vec::new(), noise: None };
        let turned = |rung: Rung, shown: &Shown| {
            Ok::<_, Error>(Turned { rung, error: difference(&shown.image, &reference.image, smaller)? })
        };
        for rung in coarser {
            probed.samples.push(turned(rung, &small(rung)?)?);
        }
        let mut quarter = None;
        for rung in fewer {
            let shown = small(rung)?;
            probed.thinned.push(turned(rung, &shown)?);
            quarter = Some(shown.predicted);
        }
        if let Some(rung) = noisy {
            probed.noise = Some(turned(rung, &small(rung)?)?);
        }
        let thinned = quarter.map(|quarter| Thinned { base: reference.predicted, quarter });
        Ok(Self {
            asked,
            are_probed: true,
            rmse: Curves::new(&probed, OF_RMSE, |error| error.rmse),
            flip: Curves::new(&probed, OF_FLIP, |error| error.flip),
            thinned,
        })
    }

    /// Errors of typical scenes, without a picture: only the work of two is counted.
    fn typical(
        drawing: &Drawing<'_>,
        loaded: &mut Loaded,
        asked: Rung,
        base: Rung,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let has_splats = !loaded.cloud.is_empty();
        let mut counted = |rung: Rung| drawing.small(loaded, rung, size, 0.0).map(|small| small.predicted);
        let thinned = match has_splats {
            true => Some(Thinned {
                base: counted(base)?,
                quarter: counted(Rung { splat_share: 0.25 * base.splat_share, ..base })?,
            }),
            false => None,
        };
        let rmse = Curves::typical(asked, 1.0);
        Ok(Self { asked, are_probed: false, rmse, flip: Curves::typical(asked, FLIP_OF_RMSE), thinned })
    }

    /// What settings are expected to err by.
    pub(super) fn expected(&self, rung: Rung) -> ExpectedError {
        if rung == self.asked {
            return ExpectedError::default();
        }
        ExpectedError { rmse: self.rmse.error(rung, self.asked), flip: self.flip.error(rung, self.asked) }
    }
}

impl Curves {
    /// Of a measure that goes with these powers of a pixel's width.
    fn new(probed: &Probed, of_width: OfWidth, measure: impl Fn(&ExpectedError) -> f64) -> Self {
        let Probed { asked, base, .. } = *probed;
        let square = |turned: &Turned| measure(&turned.error).powi(2);
        let of_a_set_sq = probed.noise.as_ref().map_or(0.0, |turned| {
            square(turned) / (f64::from(turned.rung.sets).recip() - f64::from(base.sets).recip())
        });
        // Where another setting is turned, every set is another one.
        let without_noise = |turned: &Turned| {
            let finer = f64::from(base.antialias) / f64::from(turned.rung.antialias);
            (square(turned) - of_a_set_sq * (1.0 + finer * finer) / f64::from(base.sets)).max(0.0).sqrt()
        };
        let of_samples = libm::pow(probed.smaller, of_width.samples);
        let of_splats = libm::pow(probed.smaller, of_width.splats);
        let samples = probed.samples.iter();
        let samples = samples
            .map(|turned| OfSamples { antialias: turned.rung.antialias, error: of_samples * without_noise(turned) });
        let thinned: Vec<f64> = probed.thinned.iter().map(without_noise).collect();
        let half = thinned.first().copied().unwrap_or(0.0);
        let quarter = thinned.last().copied().unwrap_or(0.0);
        // 1/t − 1 is 1 for a half, 3 for a quarter.
        let order =
            if half > 0.0 && quarter > 0.0 { libm::log(quarter / half) / libm::log(3.0) } else { *ORDERS.end() };
        let order = order.clamp(*ORDERS.start(), *ORDERS.end());
        let share = base.splat_share / asked.splat_share;
        Self {
            samples: samples.collect(),
            scale: of_splats * half * libm::pow(share, order),
            order,
            of_a_set: of_a_set_sq.sqrt(),
        }
    }

    /// Of a measure that is so many times the RMSE, in typical scenes.
    fn typical(asked: Rung, times_rmse: f64) -> Self {
        // The error goes with the width of a sample; from two samples along a side to one, that grows by half a pixel.
        let coarser = |antialias: u32| 2.0 * (f64::from(antialias).recip() - f64::from(asked.antialias).recip());
        let samples = antialias_values(asked).into_iter().skip(1);
        let error = |antialias: u32| times_rmse * TYPICAL_SAMPLES * coarser(antialias);
        Self {
            samples: samples.map(|antialias| OfSamples { antialias, error: error(antialias) }).collect(),
            scale: times_rmse * TYPICAL_SPLATS,
            order: TYPICAL_ORDER,
            of_a_set: times_rmse * TYPICAL_SET,
        }
    }

    fn error(&self, rung: Rung, asked: Rung) -> f64 {
        let samples =
            self.samples.iter().find(|sample| sample.antialias == rung.antialias).map_or(0.0, |sample| sample.error);
        let thinned = self.scale * libm::pow(asked.splat_share / rung.splat_share - 1.0, self.order);
        let is_alike = rung.antialias == asked.antialias && rung.splat_share == asked.splat_share;
        let sets = f64::from(rung.sets).recip();
        let asked_sets = f64::from(asked.sets).recip();
        let finer = f64::from(asked.antialias) / f64::from(rung.antialias);
        let variance = if is_alike { sets - asked_sets } else { finer * finer * sets + asked_sets };
        (samples * samples + thinned * thinned + self.of_a_set.powi(2) * variance).sqrt()
    }
}

/// A small picture as it is displayed, and its counted work.
struct Shown {
    image: Image<Display>,
    predicted: Prediction,
}

fn displayed(drawing: &Drawing<'_>, loaded: &mut Loaded, rung: Rung, size: [u32; 2]) -> Result<Shown, Error> {
    let small = drawing.small(loaded, rung, size, f64::INFINITY)?;
    let layers = small.layers.ok_or_else(|| Error::Internal("a small picture was not drawn".into()))?;
    let beauty = layers.rgb("beauty").ok_or_else(|| Error::Internal("a render has no beauty layer".into()))?;
    let image = Image::from_layer(layers.size, beauty).map_err(internal)?;
    Ok(Shown { image: image.display(drawing.scene.render.exposure), predicted: small.predicted })
}

/// How two small pictures differ; FLIP as the whole picture is looked at, whose pixels are smaller.
fn difference(image: &Image<Display>, reference: &Image<Display>, smaller: f64) -> Result<ExpectedError, Error> {
    let pixels_per_degree = (smaller * Viewing::default().pixels_per_degree).max(LEAST_PIXELS_PER_DEGREE);
    Ok(ExpectedError {
        rmse: compare(image, reference).map_err(internal)?.rmse,
        flip: flip(image, reference, &Viewing { pixels_per_degree }).map_err(internal)?.mean,
    })
}

fn internal(error: MetricError) -> Error {
    Error::Internal(error.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    const ASKED: Rung = Rung { antialias: 2, splat_share: 1.0, sets: 64 };

    fn turned(rung: Rung, rmse: f64) -> Turned {
        Turned { rung, error: ExpectedError { rmse, flip: 0.0 } }
    }

    /// Errors by laws that are known, probed with this base.
    fn curves(base: Rung, smaller: f64, of_a_set: f64) -> Curves {
        let thinning = |share: f64| 0.01 * (base.splat_share.powf(-0.4)) * (1.0 / share - 1.0f64).powf(0.4);
        let noise_sq = |finer: f64| of_a_set * of_a_set * (1.0 + finer * finer) / f64::from(base.sets);
        let with = |error: f64, finer: f64| (error * error + noise_sq(finer)).sqrt();
        let samples = vec![turned(Rung { antialias: 1, ..base }, with(0.02, 2.0))];
        let thinned = [0.5, 0.25]
            .map(|part| turned(Rung { splat_share: part * base.splat_share, ..base }, with(thinning(part), 1.0)));
        let half = Rung { sets: base.sets / 2, ..base };
        let sets = of_a_set * (f64::from(half.sets).recip() - f64::from(base.sets).recip()).sqrt();
        let noise = Some(turned(half, sets));
        let probed = Probed { asked: ASKED, base, smaller, samples, thinned: thinned.into(), noise };
        Curves::new(&probed, OF_RMSE, |error| error.rmse)
    }

    #[test]
    fn errors_of_each_setting_are_found_from_any_base_and_with_noise() {
        for share in [1.0, 1.0 / 16.0] {
            for of_a_set in [0.0, 0.05] {
                let curves = curves(Rung { splat_share: share, sets: 8, ..ASKED }, 1.0, of_a_set);
                let near = |rung: Rung, expected: f64| {
                    let found = curves.error(rung, ASKED);
                    assert!((found - expected).abs() < 1e-9, "{rung:?}: {found} {expected}");
                };
                let eighth = Rung { splat_share: 0.125, ..ASKED };
                let again = of_a_set * (2.0f64 / 64.0).sqrt();
                near(eighth, (0.01 * 7.0f64.powf(0.4)).hypot(again));
                near(Rung { sets: 16, ..ASKED }, of_a_set * (1.0f64 / 16.0 - 1.0 / 64.0).sqrt());
                near(Rung { antialias: 1, ..ASKED }, 0.02f64.hypot(of_a_set * (5.0f64 / 64.0).sqrt()));
            }
        }
    }

    #[test]
    fn in_a_larger_picture_fewer_samples_err_less_and_fewer_splats_more() {
        let same = curves(ASKED, 1.0, 0.0);
        let larger = curves(ASKED, 1.0 / 16.0, 0.0);
        let times = |rung: Rung| larger.error(rung, ASKED) / same.error(rung, ASKED);
        assert!((times(Rung { antialias: 1, ..ASKED }) - 0.5).abs() < 1e-9);
        assert!((times(Rung { splat_share: 0.5, ..ASKED }) - 2.0).abs() < 1e-9);
    }
}
