//! The transfer function of a volume, over how often its values occur.

use crate::event::Knot;
use organza::scene::{SceneObject, Source};
use organza::{Context, Error, SourceData, scene::Scene};
use organza_survey::Histogram;
use serde::Serialize;

/// Bins of a histogram on the page.
const BINS: usize = 128;

/// A histogram of a volume's values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Values {
    /// Least value.
    pub low: f64,
    /// Greatest value.
    pub high: f64,
    /// Logarithm of the count in bins of equal width, 0 to 1.
    pub heights: Vec<f32>,
}

/// The transfer function of a volume.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CurveRow {
    /// Its control points.
    pub knots: Vec<Knot>,
    /// The histogram, once it is counted.
    pub values: Option<Values>,
}

impl CurveRow {
    /// That of an object; `None` for what is no volume.
    pub(crate) fn of_object(object: &SceneObject, values: Option<&Values>) -> Option<Self> {
        let Source::Volume(volume) = &object.source else { return None };
        let knots = volume.transfer.points().iter().map(|point| Knot {
            value: number(point.value),
            color: point.color.map(number),
            extinction: number(point.extinction),
        });
        Some(Self { knots: knots.collect(), values: values.cloned() })
    }
}

/// A number with the few digits that single precision has: scenes are read as the same one.
pub(crate) fn number(single: f32) -> f64 {
    single.to_string().parse().unwrap_or(f64::from(single))
}

/// Counts the values of a volume; `None` for other objects, and where no value is known.
///
/// # Errors
/// Those of reading the file.
pub(crate) fn values_of(scene: &Scene, object: &SceneObject, context: Context<'_>) -> Result<Option<Values>, Error> {
    let Source::Volume(volume) = &object.source else { return Ok(None) };
    let mut limits = context.options.read_params();
    limits.frame = volume.frame;
    limits.array.clone_from(&object.array);
    let SourceData::Grid(grid) = context.files.data(scene, &volume.path, &limits, context.progress)? else {
        return Ok(None);
    };
    let finite = grid.values.iter().copied().filter(|value| value.is_finite());
    let range = finite.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    let [low, high] = range.map(f64::from);
    if low >= high {
        return Ok(None);
    }
    let counts = Histogram::new(&grid.values, [low, high], BINS).counts;
    let logarithm = |count: u64| libm::log1p(count as f64);
    let most = counts.iter().copied().map(logarithm).fold(f64::MIN_POSITIVE, f64::max);
    // Three digits are more than pixels show.
    let height = |count: u64| ((1e3 * logarithm(count) / most).round() / 1e3) as f32;
    Ok(Some(Values { low, high, heights: counts.into_iter().map(height).collect() }))
}
