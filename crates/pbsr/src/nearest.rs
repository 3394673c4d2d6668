//! STEP 2, second half: the depth buffer of one tile (Tanaka 2012, section 2). Of the particles on a pixel the nearest is seen.

use crate::PackedColor;
use crate::bins::{AREA, Record, TILE, Task};
use crate::ensemble::TileSums;
use crate::flat;
use crate::render::{Resolve, solid};
use crate::shade::MAX_CHANNELS;
use splat_core::Shading;

/// The depth buffer of one tile.
pub(crate) struct Nearest {
    /// [`Record::key`] of the nearest particle, or `limit` where none is.
    nearest: Vec<u64>,
    /// What a pixel starts with: the occluder's depth, and nothing is behind it or at it.
    limit: Vec<u64>,
    /// Records of one task that are seen: their numbers, or their pixels and colours.
    seen: Vec<(u32, PackedColor)>,
    corner: [usize; 2],
}

impl Nearest {
    pub(crate) fn new() -> Self {
        let open = vec![solid(f32::INFINITY); AREA];
        Self { nearest: open.clone(), limit: open, seen: Vec::new(), corner: [0; 2] }
    }

    /// Adds all sets of a batch to tile `t`.
    pub(crate) fn fold(&mut self, all: &Resolve<'_>, t: usize, sums: &mut TileSums<'_>) {
        let columns = all.plan.tiling.columns;
        self.corner = [t % columns * TILE, t / columns * TILE];
        all.limits(self.corner, &mut self.limit);
        self.nearest.copy_from_slice(&self.limit);
        for set in 0..all.batch {
            self.collect(all, set, t);
            self.add(all, set, t, sums);
        }
    }

    /// The nearest particle of each pixel among all objects of one set.
    #[inline]
    fn collect(&mut self, all: &Resolve<'_>, set: usize, t: usize) {
        for task in all.of_set(set) {
            for record in task.tile(t) {
                let nearest = &mut self.nearest[record.pixel()];
                *nearest = record.key().min(*nearest);
            }
        }
    }

    /// Shades what is seen of that set, adds it, and clears the buffer.
    #[inline]
    fn add(&mut self, all: &Resolve<'_>, set: usize, t: usize, sums: &mut TileSums<'_>) {
        let channels = &all.shader.channels;
        for task in all.of_set(set) {
            let records = task.tile(t);
            let material = &all.scene.objects[task.object as usize].look.material;
            // Beauty alone of what is shown as it is needs neither place nor normal.
            if channels.only_beauty() && material.shading == Shading::Unlit {
                let n = self.see(records, |seen, _, record| *seen = (record.pixel() as u32, record.color));
                flat::add(sums, &self.seen[..n], material.emission);
            } else {
                let n = self.see(records, |seen, i, _| seen.0 = i as u32);
                self.shade(n, task, records, all, sums);
            }
        }
    }

    /// Lists the records that are the nearest of their pixels, and makes their pixels empty; returns their number.
    #[inline]
    fn see(&mut self, records: &[Record], note: impl Fn(&mut (u32, PackedColor), usize, &Record)) -> usize {
        if self.seen.len() < records.len() {
            self.seen.resize(records.len().next_power_of_two(), Default::default());
        }
        // Written always, kept when seen: whether a particle is seen cannot be foreseen.
        let mut n = 0;
        for (i, record) in records.iter().enumerate() {
            let pixel = record.pixel();
            let is_seen = self.nearest[pixel] == record.key();
            self.nearest[pixel] = if is_seen { self.limit[pixel] } else { self.nearest[pixel] };
            note(&mut self.seen[n], i, record);
            n += usize::from(is_seen);
        }
        n
    }

    fn shade(&self, n: usize, task: &Task, records: &[Record], all: &Resolve<'_>, sums: &mut TileSums<'_>) {
        let params = &all.shader.channels;
        let mut values = [0.0; MAX_CHANNELS];
        for &(i, _) in &self.seen[..n] {
            let record = &records[i as usize];
            all.shade(record, task.object, self.corner, &mut values);
            sums.add(params, record.pixel(), &values[..params.channels()]);
            sums.locate(params, record.pixel(), task.set, record.depth);
            sums.name(record.pixel(), record.depth, task.object);
        }
    }
}
