//! STEP 2, second half: the depth buffer of one tile (Tanaka 2012, section 2). Each pixel shows its nearest particle.

use crate::PackedColor;
use crate::ensemble::TileSums;
use crate::project::bins::{Record, Task};
use crate::project::flat::{self, Flat, Shown};
use crate::project::resolve::{Resolve, solid};
use crate::project::tiles::{AREA, TILE};
use splat_core::shade::MAX_CHANNELS;

/// The key of a pixel that nothing hides.
const OPEN: u64 = solid(f32::INFINITY);

/// The depth buffer of one tile.
pub(crate) struct Nearest {
    /// [`Record::key`] of the nearest particle, or `limit` where none is.
    nearest: Vec<u64>,
    /// Initial depth of each pixel: the occluder's, so that no particle at it or behind it is seen. Empty without an occluder.
    limit: Vec<u64>,
    /// Records of one task that are seen: their numbers, or their pixels and colours.
    seen: Vec<u32>,
    colors: Vec<PackedColor>,
    flat: Flat,
    corner: [usize; 2],
}

impl Nearest {
    pub(crate) fn new() -> Self {
        Self {
            nearest: vec![OPEN; AREA],
            limit: Vec::new(),
            seen: Vec::new(),
            colors: Vec::new(),
            flat: Flat::new(),
            corner: [0; 2],
        }
    }

    /// Adds all sets of a batch to tile `t`.
    pub(crate) fn fold(&mut self, resolve: &Resolve<'_>, t: usize, sums: &mut TileSums<'_>) {
        let columns = resolve.plan.tiling.columns;
        self.corner = [t % columns * TILE, t / columns * TILE];
        if resolve.scene.occluder.is_some() {
            self.limit.resize(AREA, OPEN);
            resolve.limits(self.corner, &mut self.limit);
            self.nearest.copy_from_slice(&self.limit);
        }
        for set in 0..resolve.batch {
            self.collect(resolve, set, t);
            self.add(resolve, set, t, sums);
            if set % flat::SETS == flat::SETS - 1 || set == resolve.batch - 1 {
                self.flat.drain(sums);
            }
        }
    }

    /// The nearest particle of each pixel among all objects of one set.
    #[inline]
    fn collect(&mut self, resolve: &Resolve<'_>, set: usize, t: usize) {
        for task in resolve.of_set(set) {
            for record in task.tile(t) {
                let nearest = &mut self.nearest[record.pixel()];
                *nearest = record.key().min(*nearest);
            }
        }
    }

    /// Shades what is seen of that set, adds it, and clears the buffer.
    #[inline]
    fn add(&mut self, resolve: &Resolve<'_>, set: usize, t: usize, sums: &mut TileSums<'_>) {
        for task in resolve.of_set(set) {
            let records = task.tile(t);
            if resolve.plan.shaded[task.object as usize] {
                let n = self.see(records, |i, _| i as u32);
                self.shade(n, task, t, resolve, sums);
            } else {
                let n = self.see(records, |_, record| record.pixel() as u32);
                let look = &resolve.scene.objects[task.object as usize].look;
                let shown = Shown { emission: look.material.emission, color_unit: look.color_unit };
                self.flat.add(&self.seen[..n], &self.colors, shown, sums.inverse_unit);
            }
        }
    }

    /// Lists the records that are the nearest of their pixels, and makes their pixels empty; returns their number.
    #[inline]
    fn see(&mut self, records: &[Record], note: impl Fn(usize, &Record) -> u32) -> usize {
        let room = (records.len() + flat::BLOCK).next_power_of_two();
        if self.seen.len() < room {
            self.seen.resize(room, 0);
            self.colors.resize(room, PackedColor::default());
        }
        let nearest = &mut self.nearest[..AREA];
        let seen = &mut self.seen[..];
        let colors = &mut self.colors[..];
        // Written always, kept when seen: whether a particle is seen cannot be foreseen.
        let mut n = 0;
        for (i, record) in records.iter().enumerate() {
            let pixel = record.pixel();
            let is_seen = nearest[pixel] == record.key();
            let empty = self.limit.get(pixel).copied().unwrap_or(OPEN);
            nearest[pixel] = if is_seen { empty } else { nearest[pixel] };
            (seen[n], colors[n]) = (note(i, record), record.color);
            n += usize::from(is_seen);
        }
        n
    }

    fn shade(&self, n: usize, task: &Task, t: usize, resolve: &Resolve<'_>, sums: &mut TileSums<'_>) {
        let params = &resolve.shader.channels;
        let records = task.tile(t);
        let normals = task.normals(t);
        let mut values = [0.0; MAX_CHANNELS];
        for &i in &self.seen[..n] {
            let record = &records[i as usize];
            resolve.shade(record, normals[i as usize], task.object, self.corner, &mut values);
            sums.add(params, record.pixel(), &values[..params.channels()]);
            sums.locate(params, record.pixel(), task.set, record.depth);
            sums.name(record.pixel(), record.depth, task.object);
        }
    }
}
