//! Projected particles of one task, sorted by tile: a counting sort of a few thousand records in the first-level cache.
//!
//! Blocks of particles are projected in lanes, down to the tile. Particles that are thinned out go to an extra
//! tile behind all others, which costs less than to remove them from their lanes.

use crate::project::tiles::{Tiling, place};
use crate::project::{BLOCK, EVERYWHERE, Footing, Projector, View};
use crate::stream::{Stage, scramble};
use crate::{PackedColor, PackedNormal, Particles, Sampler};
use splat_core::rng;
use std::ops::Range;

/// Where the bits of the channels begin that a particle does not hide.
const CLEAR: u32 = 28;

/// One particle on one pixel.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Record {
    /// Pixel of the tile (12 bits), place within the pixel (two of 8 bits), channels that it does not hide (3 bits).
    place: u32,
    pub(crate) depth: f32,
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

/// Work of one task: a run of chunks of one set of one object.
#[derive(Debug, Default)]
pub(crate) struct Task {
    pub(crate) set: u64,
    pub(crate) object: u32,
    /// Rank of the run among those of the object.
    pub(crate) run: usize,
    pub(crate) chunks: Range<usize>,
    records: Vec<Record>,
    /// Of each record, where they are asked for.
    normals: Vec<PackedNormal>,
    /// First record of each tile, and the end.
    starts: Vec<u32>,
    pub(crate) particles: u64,
}

/// Inputs of a task that projects its particles and sorts them by tile.
pub(crate) struct Filling<'a> {
    pub(crate) sampler: &'a dyn Sampler,
    pub(crate) projector: &'a Projector,
    pub(crate) tiling: &'a Tiling,
    /// Probabilities with which each particle hides a channel; `None` where it hides all.
    pub(crate) shares: Option<[f32; 3]>,
    /// Whether normals are kept.
    pub(crate) normals: bool,
    /// View depths between which particles count.
    pub(crate) depths: [f32; 2],
}

/// Scratch memory of a task, kept by each thread.
pub(crate) struct Staging {
    particles: Particles,
    view: View,
    /// Columns of records in the order of their particles, with those of particles that are not kept.
    tiles: Vec<u32>,
    places: Vec<u32>,
    depths: Vec<f32>,
    normals: Vec<PackedNormal>,
    colors: Vec<PackedColor>,
}

impl Default for Staging {
    fn default() -> Self {
        Self {
            particles: Particles::default(),
            view: View::EMPTY,
            tiles: Vec::new(),
            places: Vec::new(),
            depths: Vec::new(),
            normals: Vec::new(),
            colors: Vec::new(),
        }
    }
}

impl Task {
    /// The records of a tile.
    #[inline]
    pub(crate) fn tile(&self, t: usize) -> &[Record] {
        &self.records[self.starts[t] as usize..self.starts[t + 1] as usize]
    }

    /// The normals of the records of a tile, where they are kept.
    #[inline]
    pub(crate) fn normals(&self, t: usize) -> &[PackedNormal] {
        &self.normals[self.starts[t] as usize..self.starts[t + 1] as usize]
    }

    pub(crate) fn records(&self) -> u64 {
        self.records.len() as u64
    }

    pub(crate) fn bytes(&self) -> u64 {
        let normals = self.normals.capacity() * size_of::<PackedNormal>();
        (self.records.capacity() * size_of::<Record>() + normals + self.starts.capacity() * 4) as u64
    }

    /// Samples the chunks, projects and sorts.
    pub(crate) fn fill(&mut self, with: &Filling<'_>, staging: &mut Staging) {
        staging.clear();
        self.particles = 0;
        let mut scratch = std::mem::take(&mut staging.particles);
        let key = thinning_key(self.object, self.set, self.run);
        let channels = rng::bits(u64::from(self.object), Stage::Channels as u64, self.set, self.run as u64);
        for chunk in self.chunks.clone() {
            let particles = with.sampler.chunk(self.set, chunk, &mut scratch);
            staging.stage(particles, with, [key, channels], self.particles);
            self.particles += particles.len() as u64;
        }
        staging.particles = scratch;
        self.sort(staging, with.tiling.tiles(), with.normals);
    }

    /// Sorts by tile.
    fn sort(&mut self, staged: &Staging, tiles: usize, normals: bool) {
        self.starts.clear();
        self.starts.resize(tiles + 1, 0);
        staged.tiles.iter().for_each(|tile| self.starts[*tile as usize] += 1);
        let mut before = 0;
        for start in &mut self.starts {
            before += std::mem::replace(start, before);
        }
        // What is not kept goes to one place behind all.
        let kept = self.starts[tiles] as usize;
        self.records.resize(kept + 1, Record::default());
        self.normals.resize(if normals { kept + 1 } else { 0 }, PackedNormal::default());
        let columns = staged.tiles.iter().zip(&staged.places).zip(&staged.depths).zip(&staged.colors);
        for (i, (((&tile, &place), &depth), &color)) in columns.enumerate() {
            let start = &mut self.starts[tile as usize];
            let at = *start as usize;
            *start += u32::from((tile as usize) < tiles);
            self.records[at] = Record { place, depth, color };
            if normals {
                self.normals[at] = staged.normals[i];
            }
        }
        self.records.truncate(kept);
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
    ((bits >> 41) as i32 as f32 + 0.5) * (1.0 / (1u32 << 23) as f32)
}

/// The bits of the channels that a particle of this number in (0, 1) does not hide. One number for all three: what one
/// channel hides, another that absorbs more hides too, so pictures have no more colour noise than they must.
#[inline(always)]
fn clear(random: f32, shares: [f32; 3]) -> u32 {
    (0..3).fold(0, |bits, c| bits | u32::from(random >= shares[c]) << (CLEAR + c as u32))
}

impl Staging {
    fn clear(&mut self) {
        self.tiles.clear();
        self.places.clear();
        self.depths.clear();
        self.normals.clear();
        self.colors.clear();
    }

    /// Projects the particles of a chunk, of which the first has the number `before` in its run. `keys` are the counters
    /// of the numbers that thin them out, and of those that choose channels.
    fn stage(&mut self, particles: &Particles, with: &Filling<'_>, keys: [u64; 2], before: u64) {
        for (block, offsets) in particles.position.chunks(BLOCK).enumerate() {
            let first = block * BLOCK;
            let n = offsets.len();
            let number = before + first as u64;
            with.projector.view(offsets, with.tiling, &mut self.view);
            if with.depths != EVERYWHERE {
                self.view.leave_out(n, with.depths, with.tiling.tiles() as u32);
            }
            if let Some(shares) = with.shares {
                let places = self.view.place[..n].iter_mut();
                places.zip(number..).for_each(|(place, i)| *place |= clear(thinning(keys[1], i), shares));
            }
            let normals = &particles.normal[first..first + n];
            let colors = &particles.color[first..first + n];
            if self.view.wide || normals.iter().fold(false, |any, n| any | n.is_per_crossing()) {
                self.one_by_one(particles, first..first + n, with, keys[0], before);
                continue;
            }
            if self.view.thin {
                let outside = with.tiling.tiles() as u32;
                pulp::Arch::new().dispatch(Thin { view: &mut self.view, key: keys[0], number, outside });
            }
            self.tiles.extend_from_slice(&self.view.tile[..n]);
            self.places.extend_from_slice(&self.view.place[..n]);
            self.depths.extend_from_slice(&self.view.z[..n]);
            self.colors.extend_from_slice(colors);
            if with.normals {
                self.normals.extend_from_slice(normals);
            }
        }
    }
    /// A block with particles that are widened or whose k depends on their normal.
    fn one_by_one(&mut self, particles: &Particles, range: Range<usize>, with: &Filling<'_>, key: u64, before: u64) {
        let projector = with.projector;
        let outside = with.tiling.tiles() as u32;
        for (j, i) in range.enumerate() {
            let normal = particles.normal[i];
            let color = particles.color[i];
            let number = before + i as u64;
            let x = self.view.x[j];
            let y = self.view.y[j];
            let depth = self.view.z[j];
            let mut k = self.view.k[j];
            let tile = self.view.tile[j];
            let place = self.view.place[j];
            if normal.is_per_crossing() {
                k *= projector.cosine(particles.position[i], normal);
            }
            if k > 1.0 {
                let foot = projector.widened(x, y, k);
                let clear = place & (7 << CLEAR);
                self.widened(&foot, Record { place: clear, depth, color }, normal, key.wrapping_add(number), with);
            } else if tile != outside && (k >= 1.0 || thinning(key, number) < k) {
                self.push(tile, Record { place, depth, color }, normal, with.normals);
            }
        }
    }

    /// A particle on several pixels; its places in them are random.
    fn widened(&mut self, foot: &Footing, record: Record, normal: PackedNormal, key: u64, with: &Filling<'_>) {
        for y in foot.y[0]..foot.y[1] {
            for x in (foot.x[0]..foot.x[1]).filter(|x| foot.covers(*x, y)) {
                let x = x as u32;
                let y = y as u32;
                let within = scramble(key ^ u64::from(x) << 48 ^ u64::from(y) << 32) as u32 & 0xffff;
                let (tile, place) = place(x, y, within, with.tiling.columns as u32);
                self.push(tile, Record { place: place | record.place, ..record }, normal, with.normals);
            }
        }
    }

    fn push(&mut self, tile: u32, record: Record, normal: PackedNormal, normals: bool) {
        self.tiles.push(tile);
        self.places.push(record.place);
        self.depths.push(record.depth);
        self.colors.push(record.color);
        if normals {
            self.normals.push(normal);
        }
    }
}

/// Puts the particles of a block that are thinned out out of the image.
struct Thin<'a> {
    view: &'a mut View,
    key: u64,
    /// Number of the first in its run.
    number: u64,
    outside: u32,
}

impl pulp::NullaryFnOnce for Thin<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { view, key, number, outside } = self;
        for j in 0..BLOCK {
            let k = view.k[j];
            let kept = (k >= 1.0) | (thinning(key, number + j as u64) < k);
            view.tile[j] = if kept { view.tile[j] } else { outside };
        }
    }
}
