//! STEP 2, second half, if extinction differs by channel: three depth buffers for one set of particles.
//!
//! An object of extinction κ has the particles of its largest channel. Each hides channel c with probability κ_c/κ_max, by
//! a separate random number. A thinned Poisson process is Poisson, so in channel c the object is as if drawn with
//! particles of κ_c alone: transmittance e^(−τ_c), without bias. A channel shows the nearest particle that hides it; a
//! particle is shaded once for all channels that show it.

use crate::ensemble::TileSums;
use crate::project::bins::Task;
use crate::project::resolve::{Resolve, solid};
use crate::project::tiles::{AREA, TILE};
use splat_core::shade::MAX_CHANNELS;

/// The depth buffers of one tile.
pub(crate) struct Colored {
    /// [`Record::key`] of the nearest particle that hides each channel, or `limit` where none is.
    nearest: Vec<[u64; 3]>,
    /// Initial depth of each pixel.
    limit: Vec<u64>,
    /// Of each pixel what the set shows so far: the channels that are hit, and their luminance.
    shown: Vec<(u32, f32)>,
    /// Pixels with hits.
    touched: Vec<u32>,
    corner: [usize; 2],
}

impl Colored {
    pub(crate) fn new() -> Self {
        Self {
            nearest: vec![[0; 3]; AREA],
            limit: vec![solid(f32::INFINITY); AREA],
            shown: vec![(0, 0.0); AREA],
            touched: Vec::new(),
            corner: [0; 2],
        }
    }

    /// Adds all sets of a batch to tile `t`.
    pub(crate) fn fold(&mut self, resolve: &Resolve<'_>, t: usize, sums: &mut TileSums<'_>) {
        let columns = resolve.plan.tiling.columns;
        self.corner = [t % columns * TILE, t / columns * TILE];
        resolve.limits(self.corner, &mut self.limit);
        self.nearest.iter_mut().zip(&self.limit).for_each(|(nearest, limit)| *nearest = [*limit; 3]);
        for set in 0..resolve.batch {
            for record in resolve.of_set(set).flat_map(|task| task.tile(t)) {
                let nearest = &mut self.nearest[record.pixel()];
                let hides = record.channels();
                for c in (0..3).filter(|c| hides >> c & 1 == 1) {
                    nearest[c] = record.key().min(nearest[c]);
                }
            }
            for task in resolve.of_set(set) {
                self.add(task, t, resolve, sums);
            }
            for k in self.touched.drain(..) {
                let (mask, luminance) = std::mem::take(&mut self.shown[k as usize]);
                sums.add_set(k as usize, mask, luminance);
            }
        }
    }

    /// Shades what is seen of one task, adds it, and clears the buffers behind it.
    fn add(&mut self, task: &Task, t: usize, resolve: &Resolve<'_>, sums: &mut TileSums<'_>) {
        let params = &resolve.shader.channels;
        let mut values = [0.0; MAX_CHANNELS];
        for (record, normal) in task.tile(t).iter().zip(task.normals(t)) {
            let pixel = record.pixel();
            let hides = record.channels();
            let nearest = &mut self.nearest[pixel];
            let mut mask = 0;
            for c in (0..3).filter(|c| hides >> c & 1 == 1) {
                if nearest[c] == record.key() {
                    nearest[c] = self.limit[pixel];
                    mask |= 1 << c;
                }
            }
            if mask == 0 {
                continue;
            }
            resolve.shade(record, *normal, task.object, self.corner, &mut values);
            let shown = &mut self.shown[pixel];
            if shown.0 == 0 {
                self.touched.push(pixel as u32);
            }
            shown.0 |= mask;
            shown.1 += sums.add_channels(params, pixel, &values[..params.channels()], mask);
            sums.name(pixel, record.depth, task.object);
            // One depth for all, as compositing by channel has it.
            if mask >> 1 & 1 == 1 {
                sums.locate(params, pixel, task.set, record.depth);
            }
        }
    }
}
