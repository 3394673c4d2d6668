//! The files, options and progress that every step from a scene to its picture reads.

use super::files::Files;
use crate::RenderOptions;
use splat_core::Progress;

/// The files, options and progress that every step from a scene to its picture reads beside the scene.
#[derive(Clone, Copy)]
pub struct Context<'a> {
    /// Files that were read, which no step reads again.
    pub files: &'a Files,
    /// Limits, and the treatment of invalid input.
    pub options: &'a RenderOptions,
    /// The stages, for those who wait; it cancels the work as well.
    pub progress: &'a Progress,
}
