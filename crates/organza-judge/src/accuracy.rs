//! Accuracy against time: sweeps the knob of each approximation, and judges every picture by its error and its time.
//!
//! ```text
//! Sweep (a technique's knobs) ─► settings ─► curves ─► limit ─► repeats, shuffled ─► Study ─► json, csv, html
//! ```
//!
//! A technique joins with a [`Sweep`] and a function that draws a [`Request`]; no other module knows it.
//!
//! Two errors are kept apart. A knob's **own error** compares a picture with the one whose knob alone is at its end: it shows the
//! order of convergence, undisturbed by the other knobs. The **error against the limit** compares with the picture whose knobs are all
//! at their ends. Each reference has an error estimate (Richardson, from the fitted order). Plots leave out errors below ten times
//! that estimate. A random technique without bias takes the limit of another, is drawn with several seeds, and shows intervals
//! instead. A technique with a limit of its own stands beside the others where all are held against physical truth, and nowhere else.

mod changes;
mod frontier;
mod judging;
mod knob;
mod ladder;
mod limit;
mod measure;
mod plot;
mod random;
mod repeat;
mod report;
mod resolve;
mod sampled;
mod settings;
mod shown;
mod study;
mod verdict;

pub use changes::{Change, changes, lines};
pub use frontier::{Candidate, Hold, TOLD_APART, frontier, hold};
pub use judging::{Judged, judge};
pub use knob::particles::particles;
pub use knob::points::{Facts, in_points, points};
pub use knob::sheets::{in_sheets, sheets};
pub use knob::surfels::{in_surfels, surfels};
pub use knob::{Knob, Request, Skipped, Step, Sweep, Theory};
pub use ladder::{RUNGS_ASIDE, Rung, knobs_of, ladder};
pub use limit::Limit;
pub use measure::{Distance, Frame, Renderer, Timed};
pub use random::{SEEDS, Yardsticks, random_study};
pub use report::{Absent, Machine, Report, write};
pub use resolve::{Curve, CurvePoint, Settled, settle};
pub use sampled::Sampled;
pub use settings::Setting;
pub use shown::{Apart, DifferencePicture, apart, difference_picture};
pub use study::{Draw, Outcome, Study, least_seconds, study};
pub use verdict::verdict;

pub(crate) use plot::{COLORS, Mark, Plot, Series, escaped};
pub(crate) use report::SHARED_COLUMNS;
pub(crate) use report::pictures::{data_uri, difference, png};

pub use crate::truth::Truth;

use organza::scene::Scene;

/// The amount of work that a report may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// A smaller picture, fewer steps, fewer repeats.
    pub quick: bool,
    /// Doublings of each knob's end beyond the default; more make the reference more accurate.
    pub finer: u32,
    /// Seed of the order in which repeats are drawn.
    pub seed: u64,
}

impl Options {
    /// Timed repeats of each setting.
    pub fn repeats(&self) -> usize {
        if self.quick { 2 } else { 5 }
    }

    /// Further repeats of what the frontier hangs on.
    pub fn hold(&self) -> Hold {
        if self.quick { Hold { calm: 1, most: 3 } } else { Hold { calm: 8, most: 20 } }
    }

    /// Bytes that a study takes at most unless the user allows more: ends of knobs would fill any memory.
    pub fn memory(&self) -> u64 {
        if self.quick { 3 << 30 } else { 6 << 30 }
    }

    /// Samples a pixel of the physical truth.
    pub fn truth_samples(&self) -> u32 {
        if self.quick { 64 } else { 1024 }
    }

    /// Longest side of the picture, pixels, unless the user has requested a size.
    pub fn longest_side(&self) -> u32 {
        if self.quick { 192 } else { 320 }
    }
}

/// Makes the picture of `scene` small enough that many of it can be drawn; its shape stays.
pub fn shrink(scene: &mut Scene, longest_side: u32) {
    let longest = scene.camera.size[0].max(scene.camera.size[1]);
    if longest > longest_side {
        let side = |s: u32| (u64::from(s) * u64::from(longest_side)).div_ceil(u64::from(longest)) as u32;
        scene.camera.size = scene.camera.size.map(side);
    }
}
