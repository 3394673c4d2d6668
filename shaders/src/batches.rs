//! Which steps are submitted together.
//!
//! A system resets a device that is busy with one submission for seconds, and a screen that the device draws stands still
//! as long as one takes. So a submission should take no longer than [`LONGEST`]; fewer are faster. What steps take is known
//! from the run before.

use std::ops::Range;
use std::time::Duration;

/// How long one submission should take at most.
pub const LONGEST: Duration = Duration::from_millis(200);

/// Ranges of steps, in order: as many in a row as take no longer than [`LONGEST`] by their `nanoseconds`. A step that takes
/// longer is alone.
///
/// ```
/// use splat_shaders::batches;
/// assert_eq!(batches(&[150e6, 40e6, 30e6, 300e6, 1e6]), [0..2, 2..3, 3..4, 4..5]);
/// // Where nothing is known, each step is alone.
/// assert_eq!(batches(&[f64::INFINITY; 3]), [0..1, 1..2, 2..3]);
/// assert_eq!(batches(&[]), []);
/// ```
pub fn batches(nanoseconds: &[f64]) -> Vec<Range<usize>> {
    let longest = LONGEST.as_nanos() as f64;
    let mut ranges = Vec::new();
    let mut first = 0;
    let mut sum = 0.0;
    for (at, took) in nanoseconds.iter().enumerate() {
        if at > first && sum + took > longest {
            ranges.push(first..at);
            (first, sum) = (at, 0.0);
        }
        sum += took;
    }
    if first < nanoseconds.len() {
        ranges.push(first..nanoseconds.len());
    }
    ranges
}
