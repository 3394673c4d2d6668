//! What half-vector sheets took: work counted, so that it can be compared where times cannot.

/// Work of one fold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct HalfCounts {
    /// Voxels of all volumes.
    pub voxels: u64,
    /// Voxels that the transfer functions may show, or that shape those.
    pub visible: u64,
    /// Sweeps: one a light.
    pub sweeps: u64,
    /// Slabs of all sweeps, a few before and behind the volumes included.
    pub slabs: u64,
    /// Footprint numbers added to the eye's sheets, or samples of lattices that these read, whole vectors.
    pub eye_fragments: u64,
    /// The same of the light's.
    pub light_fragments: u64,
    /// Cells of scattered light of one sweep, the most.
    pub scatter_cells: u64,
    /// Convolutions and corrections of scattered light; 0 where none is simulated.
    pub scatter_passes: u64,
    /// Images of a slab or of light that were moved for soft shadows, two a slab and point of a light; 0 where shadows are hard.
    pub soft_passes: u64,
    /// Pixels that show polygons before all that is in slabs, among it and behind it, of the first sweep (Figure 6).
    pub polygon_pixels: [u64; 3],
    /// Bytes of the light buffer of one sweep and of its scattered light, the largest; they do not grow with slabs.
    pub light_bytes: u64,
    /// Bytes of everything that one sweep holds, the largest.
    pub bytes: u64,
}

impl HalfCounts {
    /// Those of one sweep more over the same volumes.
    pub(crate) fn join(self, other: Self) -> Self {
        Self {
            voxels: self.voxels.max(other.voxels),
            visible: self.visible.max(other.visible),
            sweeps: self.sweeps + other.sweeps,
            slabs: self.slabs + other.slabs,
            eye_fragments: self.eye_fragments + other.eye_fragments,
            light_fragments: self.light_fragments + other.light_fragments,
            scatter_cells: self.scatter_cells.max(other.scatter_cells),
            scatter_passes: self.scatter_passes + other.scatter_passes,
            soft_passes: self.soft_passes + other.soft_passes,
            polygon_pixels: self.polygon_pixels,
            light_bytes: self.light_bytes.max(other.light_bytes),
            bytes: self.bytes.max(other.bytes),
        }
    }
}
