//! Limits of a render, and its treatment of invalid input.

use crate::cost::Rates;
use crate::device::Device;
use convert::Cache;
use read::{ReadParams, Textures};
use splat_core::MemoryAccount;
use std::path::PathBuf;
use std::sync::Arc;

/// Limits of a render, and its treatment of invalid input.
#[derive(Debug, Clone)]
pub struct RenderOptions {
    /// Bytes that all buffers together may take: files while they are read and what is kept of them, images, checkpoints, splats, pictures.
    pub max_memory: u64,
    /// Leave out records with values that are not finite instead of refusing the file.
    pub drop_invalid: bool,
    /// Refuse files with a fault that could be mended, see [`read::Fix`].
    pub strict: bool,
    /// Make one point of points at the same place, for every object.
    pub merge_duplicates: bool,
    /// File of the sums of the technique `particles`. The render reads the file first, if it exists, and writes it
    /// every few seconds, at the end and at an interrupt. A render that is stopped at any moment goes on from it and
    /// ends in the same bits.
    pub checkpoint: Option<PathBuf>,
    /// Cache of slow conversions, which later runs read; it changes no picture.
    pub cache: Option<Arc<Cache>>,
    /// The device on which the passes run that can, opened once for all pictures; `None`: the processor alone.
    pub device: Option<Arc<Device>>,
    /// Whether the device composites the splats too: beauty then differs from the processor's by rounding, up to 10⁻⁵ of
    /// the brightest splat.
    pub device_composites: bool,
    /// Time of each kind of work, for predictions; it changes no picture.
    pub rates: Rates,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            max_memory: 8 << 30,
            drop_invalid: false,
            strict: false,
            merge_duplicates: false,
            checkpoint: None,
            cache: None,
            device: None,
            device_composites: false,
            rates: Rates::default(),
        }
    }
}

impl RenderOptions {
    /// The limits that apply to a file as it is read. Textures are kept: splats ask them for colours.
    pub fn read_params(&self) -> ReadParams {
        let memory = MemoryAccount::new(self.max_memory);
        ReadParams {
            memory,
            drop_invalid: self.drop_invalid,
            strict: self.strict,
            textures: Textures::Kept,
            ..ReadParams::default()
        }
    }
}
