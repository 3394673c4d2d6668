//! What sheets took: work counted, so that it can be compared where times cannot.

/// Work of one fold.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SheetCounts {
    /// Voxels of all volumes.
    pub voxels: u64,
    /// Voxels that the transfer functions may show, or that shape those, with those of the rims around the volumes.
    pub visible: u64,
    /// Voxels splatted, each as often as there are tiles that it reaches.
    pub records: u64,
    /// Of these, those that no pixel wanted: under opaque pixels, which is early splat elimination, or beside the picture.
    pub hidden: u64,
    /// Footprint numbers multiplied into pixels, each for all sections at once.
    pub fragments: u64,
    /// Those of splats, each for one slab.
    pub splat_fragments: u64,
    /// Pixels of sheets that footprints touched, within their bounds; what is opaque by then is counted, too.
    pub touched: u64,
    /// Pixels of sheets classified, whole vectors.
    pub shaded: u64,
    /// Tiles without any voxel, or opaque from the beginning.
    pub tiles_skipped: u64,
    /// Slabs between the nearest volume and the farthest, a few before and behind included.
    pub slabs: u64,
    /// Bytes of the buffers made.
    pub bytes: u64,
}

impl SheetCounts {
    pub(crate) fn add(self, other: Self) -> Self {
        Self {
            voxels: self.voxels + other.voxels,
            visible: self.visible + other.visible,
            records: self.records + other.records,
            hidden: self.hidden + other.hidden,
            fragments: self.fragments + other.fragments,
            splat_fragments: self.splat_fragments + other.splat_fragments,
            touched: self.touched + other.touched,
            shaded: self.shaded + other.shaded,
            tiles_skipped: self.tiles_skipped + other.tiles_skipped,
            slabs: self.slabs + other.slabs,
            bytes: self.bytes + other.bytes,
        }
    }
}
