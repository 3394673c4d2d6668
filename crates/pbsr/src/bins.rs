//! Projected particles of one task, sorted by tile: a counting sort of a few thousand records in the nearest cache.

use crate::project::{BLOCK, Footing, Projector, View};
use crate::stream::{Stage, scramble};
use crate::{PackedColor, PackedNormal, Particles, Sampler};
use splat_core::rng;

/// Side of a tile, pixels: its depths fit the first cache.
pub(crate) const TILE: usize = 64;

/// Pixels of a tile.
pub(crate) const AREA: usize = TILE * TILE;

/// Where the bits of the channels begin that a particle does not hide.
const CLEAR: u32 = 28;

/// One particle on one pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Record {
    /// Pixel of the tile (12 bits), place within the pixel (two of 8 bits), channels that it does not hide (3 bits).
    place: u32,
    pub(crate) depth: f32,
    pub(crate) normal: PackedNormal,
    pub(crate) color: PackedColor,
}

impl Record {
    #[inline(always)]
    pub(crate) fn pixel(&self) -> usize {
        (self.place & 0xfff) as usize
    }

    /// Sorts by depth, bits of positive numbers do; at equal depths by chance, which is the place in the pixel. Of two
    /// particles with the same key the first is seen.
    #[inline(always)]
    pub(crate) fn key(&self) -> u64 {
        u64::from(self.depth.to_bits()) << 32 | u64::from(self.place.wrapping_mul(0x9e37_79b1))
    }

    /// Channels that it hides, bit c for channel c.
    #[inline(always)]
    pub(crate) fn channels(&self) -> u32 {
        !self.place >> CLEAR & 7
    }

    /// Place in the pixel, (0, 1).
    #[inline(always)]
    pub(crate) fn within(&self) -> [f32; 2] {
        [self.place >> 12, self.place >> 20].map(|v| ((v & 255) as f32 + 0.5) * (1.0 / 256.0))
    }
}

/// Tiles of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Tiling {
    pub(crate) size: [usize; 2],
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

impl Tiling {
    pub(crate) fn new(size: [u32; 2]) -> Self {
        let size = size.map(|s| s as usize);
        Self { size, columns: size[0].div_ceil(TILE), rows: size[1].div_ceil(TILE) }
    }

    pub(crate) fn tiles(&self) -> usize {
        self.columns * self.rows
    }

    /// Where pixel (x, y) stands in tile order.
    pub(crate) fn index(&self, x: usize, y: usize) -> usize {
        (y / TILE * self.columns + x / TILE) * AREA + y % TILE * TILE + x % TILE
    }
}

/// Work of one task: a run of chunks of one set of one object.
#[derive(Debug, Default)]
pub(crate) struct Task {
    pub(crate) set: u64,
    pub(crate) object: u32,
    /// Rank of the run among those of the object.
    pub(crate) run: usize,
    pub(crate) chunks: std::ops::Range<usize>,
    records: Vec<Record>,
    /// First record of each tile, and the end.
    starts: Vec<u32>,
    pub(crate) particles: u64,
}

/// What a task needs beside its own: kept by each thread.
pub(crate) struct Staging {
    particles: Particles,
    view: View,
    /// Tiles and records, of which the first `len` count.
    tiles: Vec<u32>,
    records: Vec<Record>,
    len: usize,
}

impl Default for Staging {
    fn default() -> Self {
        Self { particles: Particles::default(), view: View::EMPTY, tiles: Vec::new(), records: Vec::new(), len: 0 }
    }
}

impl Task {
    /// The records of a tile.
    #[inline]
    pub(crate) fn tile(&self, t: usize) -> &[Record] {
        &self.records[self.starts[t] as usize..self.starts[t + 1] as usize]
    }

    pub(crate) fn records(&self) -> u64 {
        self.records.len() as u64
    }

    pub(crate) fn bytes(&self) -> u64 {
        (self.records.capacity() * size_of::<Record>() + self.starts.capacity() * 4) as u64
    }

    /// Samples the chunks, projects and sorts. Each particle hides a channel with the probability in `shares`, if there are
    /// some, else it hides all.
    pub(crate) fn fill(
        &mut self,
        sampler: &dyn Sampler,
        projector: &Projector,
        tiling: &Tiling,
        shares: Option<[f32; 3]>,
        staging: &mut Staging,
    ) {
        staging.len = 0;
        self.particles = 0;
        self.starts.clear();
        self.starts.resize(tiling.tiles() + 1, 0);
        let mut scratch = std::mem::take(&mut staging.particles);
        let key = thinning_key(self.object, self.set, self.run);
        let channels = rng::bits(u64::from(self.object), Stage::Channels as u64, self.set, self.run as u64);
        for chunk in self.chunks.clone() {
            let particles = sampler.chunk(self.set, chunk, &mut scratch);
            let numbers = (key, self.particles);
            match shares {
                None => staging.stage(particles, projector, tiling, numbers, |_| 0, &mut self.starts),
                Some(shares) => {
                    let clear = |i| clear(thinning(channels, i), shares);
                    staging.stage(particles, projector, tiling, numbers, clear, &mut self.starts);
                }
            }
            self.particles += particles.len() as u64;
        }
        staging.particles = scratch;
        self.sort(&staging.tiles[..staging.len], &staging.records[..staging.len]);
    }

    /// Sorts by tile; `starts` holds the number of each tile's records, one place on.
    fn sort(&mut self, of_tile: &[u32], staged: &[Record]) {
        self.starts[0] = 0;
        for t in 1..self.starts.len() {
            self.starts[t] += self.starts[t - 1];
        }
        self.records.resize(staged.len(), Record::default());
        for (tile, record) in of_tile.iter().zip(staged) {
            let at = &mut self.starts[*tile as usize];
            self.records[*at as usize] = *record;
            *at += 1;
        }
        // Each start has moved to the end of its tile.
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }
}

/// Counter of the numbers that thin out the particles of one run of chunks.
pub(crate) fn thinning_key(object: u32, set: u64, run: usize) -> u64 {
    rng::bits(u64::from(object), Stage::Thinning as u64, set, run as u64)
}

/// The number in (0, 1) of particle `i` of a run.
#[inline(always)]
pub(crate) fn thinning(key: u64, i: u64) -> f32 {
    let bits = scramble(key.wrapping_add(i.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
    ((bits >> 41) as f32 + 0.5) * (1.0 / (1u32 << 23) as f32)
}

/// The bits of the channels that a particle of this number in (0, 1) does not hide. One number for all three: what one
/// channel hides, another that absorbs more hides too, so pictures have no more colour noise than they must.
#[inline(always)]
fn clear(random: f32, shares: [f32; 3]) -> u32 {
    (0..3).fold(0, |bits, c| bits | u32::from(random >= shares[c]) << (CLEAR + c as u32))
}

impl Staging {
    /// Room for `n` records and a block more.
    fn grow(&mut self, n: usize) {
        if self.records.len() < n + BLOCK {
            self.tiles.resize((n + BLOCK).next_power_of_two(), 0);
            self.records.resize(self.tiles.len(), Record::default());
        }
    }

    /// Projects the particles of a chunk, of which the first has the number `before` in its run; counts those of each
    /// tile, one place on in `counts`. `clear` gives the bits of what a particle does not hide, by its number.
    fn stage(
        &mut self,
        particles: &Particles,
        projector: &Projector,
        tiling: &Tiling,
        (key, before): (u64, u64),
        clear: impl Fn(u64) -> u32,
        counts: &mut [u32],
    ) {
        let columns = tiling.columns as u32;
        let mut n = self.len;
        for (block, offsets) in particles.position.chunks(BLOCK).enumerate() {
            let first = block * BLOCK;
            let number = before + first as u64;
            projector.view(offsets, &mut self.view);
            self.grow(n);
            let attributes = particles.normal[first..].iter().zip(&particles.color[first..]);
            for (j, (&normal, &color)) in attributes.enumerate().take(offsets.len()) {
                let (x, y, depth, mut k) = (self.view.x[j], self.view.y[j], self.view.z[j], self.view.k[j]);
                if normal.is_per_crossing() {
                    k *= projector.cosine(offsets[j], normal);
                }
                let record = Record { place: clear(number + j as u64), depth, normal, color };
                if k > 1.0 {
                    self.len = n;
                    self.widened(
                        &projector.widened(x, y, k),
                        record,
                        key.wrapping_add(number + j as u64),
                        columns,
                        counts,
                    );
                    n = self.len;
                    continue;
                }
                let seen = self.view.seen[j] & ((k >= 1.0) || thinning(key, number + j as u64) < k);
                let [px, py] = [0, 1].map(|a| self.view.pixel[a][j]);
                let (tile, place) = place(px, py, self.view.within[j], columns);
                self.tiles[n] = tile;
                self.records[n] = Record { place: place | record.place, ..record };
                counts[if seen { tile as usize + 1 } else { 0 }] += 1;
                n += usize::from(seen);
            }
        }
        self.len = n;
    }

    /// A particle on several pixels; its places in them are random.
    fn widened(&mut self, foot: &Footing, record: Record, key: u64, columns: u32, counts: &mut [u32]) {
        for y in foot.y[0]..foot.y[1] {
            for x in foot.x[0]..foot.x[1] {
                let (x, y) = (x as u32, y as u32);
                let within = scramble(key ^ u64::from(x) << 48 ^ u64::from(y) << 32) as u32 & 0xffff;
                let (tile, place) = place(x, y, within, columns);
                self.tiles[self.len] = tile;
                self.records[self.len] = Record { place: place | record.place, ..record };
                counts[tile as usize + 1] += 1;
                self.len += 1;
                // A place for the next, and for what remains of the block.
                self.grow(self.len);
            }
        }
    }
}

/// Tile of a pixel, and the place in the tile as a record has it; `within` are two of 8 bits.
#[inline(always)]
fn place(x: u32, y: u32, within: u32, columns: u32) -> (u32, u32) {
    const SIDE: u32 = TILE as u32;
    let tile = (y / SIDE).wrapping_mul(columns).wrapping_add(x / SIDE);
    (tile, (y % SIDE * SIDE + x % SIDE) | ((within & 0xffff) << 12))
}
