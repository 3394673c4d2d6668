//! Drawing: techniques in turns, front to back, into one accumulator.

use crate::choose::row;
use crate::cost::Prediction;
use crate::frame::Frame;
use crate::load::Loaded;
use crate::plan::Plan;
use crate::predict::prediction;
use crate::prepare::ranges::ranges;
use crate::scene::Scene;
use crate::technique::{Finished, Fold, Session};
use crate::{CostRecord, Error, Layers, Progress, RenderOptions};
use std::ops::Range;

/// Runs the planned passes of a frame, and keeps the layers that its scene asks for.
pub(crate) fn draw(frame: &Frame<'_>, session: &mut Session<'_>, cost: &mut CostRecord) -> Result<Layers, Error> {
    let layers = draw_ranges(frame, &ranges(frame), session, cost)?;
    frame.progress.finish();
    Ok(layers)
}

/// The same in these ranges of depth, which follow each other. A long drawing is announced before it begins, where the session
/// announces any.
pub(crate) fn draw_ranges(
    frame: &Frame<'_>,
    ranges: &[Range<f32>],
    session: &mut Session<'_>,
    cost: &mut CostRecord,
) -> Result<Layers, Error> {
    let mut folds: Vec<Box<dyn Fold + '_>> =
        frame.plan.techniques.iter().map(|technique| (row(*technique).begin)(frame)).collect();
    folds.iter_mut().try_for_each(|fold| fold.prepare(session, cost))?;
    let predicted = prediction(frame, &folds, ranges, session.options);
    frame.progress.plan(session.options.rates.stages(&predicted.drawing));
    if session.announces
        && let Some(sentence) = predicted.announcement(rayon::current_num_threads())
    {
        frame.progress.announce(&sentence);
    }
    session.predicted = predicted;
    let mut accumulator = frame.accumulator();
    for range in ranges {
        for fold in &mut folds {
            fold.fold(range.clone(), &mut accumulator, session, cost)?;
        }
    }
    for technique in &frame.plan.techniques {
        row(*technique).steps.last().into_iter().for_each(|step| cost.join(step.pass));
    }
    let glass = folds.iter_mut().find_map(|fold| fold.glass());
    let layers = frame.finish(&accumulator, glass.as_ref(), cost)?;
    let mut finished = Finished { layers, opaque: Some(frame.opaque(cost)?) };
    folds.iter_mut().for_each(|fold| fold.finish(&mut finished));
    let mut layers = finished.layers;
    // Back into the scene's unit.
    layers.scale_depths(libm::exp2(f64::from(frame.loaded.exponent)) as f32);
    frame.settings.layers.keep(&mut layers);
    Ok(layers)
}

/// A scene that was loaded and planned.
#[derive(Clone, Copy)]
pub struct Planned<'a> {
    /// The scene to draw.
    pub scene: &'a Scene,
    /// Its data.
    pub loaded: &'a Loaded,
    /// The plan that [`plan_loaded`](crate::plan_loaded) makes from both.
    pub plan: &'a Plan,
    /// The limits of the render.
    pub options: &'a RenderOptions,
}

/// Draws a planned scene by the processor alone, and keeps the layers that it asks for. The passes that ran are added to `cost`.
/// A long drawing is not announced: a comparison draws many.
///
/// # Errors
/// As [`crate::render`]; [`Error::Cancelled`] also where a random technique was interrupted between its sets.
pub fn draw_loaded(planned: &Planned<'_>, progress: &Progress, cost: &mut CostRecord) -> Result<Layers, Error> {
    let Planned { scene, loaded, plan, options } = *planned;
    let frame = Frame::new(scene, loaded, plan, progress);
    let mut session = Session {
        options,
        checkpoint: None,
        kept: None,
        warnings: &mut Vec::new(),
        sets: None,
        predicted: Prediction::default(),
        announces: false,
    };
    let layers = draw(&frame, &mut session, cost)?;
    if session.sets.is_some_and(|sets| sets.interrupted) { Err(Error::Cancelled) } else { Ok(layers) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::{load, plan_loaded};
    use crate::scene::{LoadOptions, parse};
    use crate::{Context, Files};
    use splat_core::LayerData;

    /// Fog, a pane and a wall behind them, in every layer.
    const SCENE: &[u8] = br#"
        version = 1
        [camera]
        position = [0.2, 0.1, 4]
        target = [0, 0, 0]
        size = [40, 30]
        [[light]]
        kind = "point"
        position = [2, 3, 4]
        intensity = [20, 18, 16]
        [[object]]
        name = "fog"
        medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.7, spacing = 0.12 }
        [[object]]
        name = "pane"
        rectangle = { center = [0, 0, 0.3], u = [1.2, 0, 0.5], v = [0, 1.2, 0], spacing = 0.1 }
        opacity = 0.4
        [[object]]
        name = "wall"
        rectangle = { center = [0.5, 0, -2], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }
        [render]
        layers = ["effects", "shadow", "normal", "depth", "object"]
        particles = { repeat_level = 400 }
    "#;

    /// The picture by a technique, in ranges that end at these depths and behind all.
    fn drawn(technique: &str, seed: u64, ends: &[f32]) -> Layers {
        let overrides = [format!("render.technique=\"{technique}\""), format!("render.seed={seed}")];
        let overrides = overrides.iter().map(|o| crate::scene::Override::parse(o).unwrap()).collect();
        let options = LoadOptions { overrides, ..LoadOptions::default() };
        let scene = parse("seam.toml".as_ref(), SCENE, &options).unwrap();
        let options = RenderOptions::default();
        let progress = Progress::new();
        let context = Context { files: &Files::default(), options: &options, progress: &progress };
        let loaded = load(&scene, context).unwrap();
        let plan = plan_loaded(&scene, &loaded, &options).unwrap();
        let frame = Frame::new(&scene, &loaded, &plan, &progress);
        let unit = libm::exp2(f64::from(-loaded.exponent)) as f32;
        let cuts = ends.iter().map(|end| end * unit);
        let cuts: Vec<f32> = [f32::NEG_INFINITY].into_iter().chain(cuts).chain([f32::INFINITY]).collect();
        let ranges: Vec<Range<f32>> = cuts.windows(2).map(|w| w[0]..w[1]).collect();
        let mut session = Session {
            options: &options,
            checkpoint: None,
            kept: None,
            warnings: &mut Vec::new(),
            sets: None,
            predicted: Prediction::default(),
            announces: false,
        };
        draw_ranges(&frame, &ranges, &mut session, &mut CostRecord::default()).unwrap()
    }

    /// All numbers of two pictures, layer by layer.
    fn numbers<'a>(a: &'a Layers, b: &'a Layers) -> Vec<(&'static str, Vec<[f32; 2]>)> {
        assert_eq!(a.images.keys().collect::<Vec<_>>(), b.images.keys().collect::<Vec<_>>());
        let flat = |data: &LayerData| -> Vec<f32> {
            match data {
                LayerData::Scalar(v) => v.clone(),
                LayerData::Rgb(v) => v.iter().flatten().copied().collect(),
                LayerData::Id(v) => v.iter().map(|id| *id as f32).collect(),
            }
        };
        let pair = |(name, data): (&&'static str, &LayerData)| {
            (*name, flat(data).into_iter().zip(flat(&b.images[name])).map(|(a, b)| [a, b]).collect())
        };
        a.images.iter().map(pair).collect()
    }

    const TWO: [f32; 1] = [4.1];
    const SEVEN: [f32; 6] = [3.2, 3.7, 4.0, 4.3, 4.6, 5.5];

    #[test]
    fn splats_in_one_two_and_seven_ranges_give_one_picture() {
        for technique in ["points", "reference"] {
            let whole = drawn(technique, 0, &[]);
            for ends in [&TWO[..], &SEVEN] {
                for (name, pairs) in numbers(&whole, &drawn(technique, 0, ends)) {
                    let near = |[a, b]: &[f32; 2]| a == b || (a - b).abs() <= 1e-6 * a.abs().max(1.0);
                    let worst = pairs.iter().find(|pair| !near(pair));
                    assert_eq!(worst, None, "{technique}, {name}, {} ranges", ends.len() + 1);
                }
            }
        }
    }

    #[test]
    fn particles_in_one_two_and_seven_ranges_agree_within_their_noise() {
        let whole = drawn("particles", 1, &[]);
        for ends in [&TWO[..], &SEVEN] {
            let other = drawn("particles", 2, ends);
            for (name, pairs) in numbers(&whole, &other) {
                if !["beauty", "alpha", "direct", "ambient", "background"].contains(&name) {
                    continue;
                }
                // Pixels are independent, the channels of one are not.
                let channels = pairs.len() / (40 * 30);
                let of_pixel = |p: &[[f32; 2]]| p.iter().map(|[a, b]| f64::from(b - a)).sum::<f64>() / p.len() as f64;
                let differences: Vec<f64> = pairs.chunks(channels).map(of_pixel).collect();
                let n = differences.len() as f64;
                let bias = differences.iter().sum::<f64>() / n;
                let square = differences.iter().map(|d| d * d).sum::<f64>() / n;
                // Three standard errors of the mean difference, and rounding.
                let error = (square / n).sqrt();
                assert!(bias.abs() <= 3.0 * error + 1e-7, "{name}, {} ranges: {bias:e} of {error:e}", ends.len() + 1);
            }
        }
    }
}
