//! Kernel sections: a kernel along the view, cut into slabs (Figure 1b).
//!
//! The kernel along the view is the profile of the footprints, so value, slope and curvature vanish at the rim. A section is
//! its integral over a slab, a difference of [`Footprint::share_before`] at the slab's faces. Sections of one kernel sum to 1 at
//! each of 256 phases, the places where a kernel may begin within its first slab. Every slab that it touches gets its section: 5
//! for the paper's extent of 2.0 slabs, which it writes 4 of.

use splat_core::Footprint;

/// Places within a slab at which a kernel may begin.
pub const PHASES: u32 = 256;

/// Kernel sums below this are none: footprints and sections are shares of 1.
pub(crate) const LEAST_WEIGHT: f32 = 1e-12;

/// Sections of one kernel, front to back, `touched` many, for a kernel that begins `phase`/256 slabs behind the near face of
/// its first slab. `reach` is the cutoff radius R over the slab width.
pub fn sections(phase: u32, reach: f64, footprint: &Footprint) -> Vec<f64> {
    let count = touched(reach);
    // The far face of slab i, from the kernel's centre, in units of R.
    let face = |i: usize| {
        let slabs = i as f64 - f64::from(phase) / f64::from(PHASES);
        footprint.share_before(slabs / reach - 1.0)
    };
    let faces: Vec<f64> = (0..=count).map(face).collect();
    faces.windows(2).map(|f| f[1] - f[0]).collect()
}

/// The most slabs that a kernel touches: it begins in the first and is 2R long.
pub fn touched(reach: f64) -> usize {
    (2.0 * reach).ceil() as usize + 1
}

/// Sections of one kernel in a slab and in its neighbours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SectionsAround {
    pub(crate) before: f32,
    pub(crate) here: f32,
    pub(crate) after: f32,
}

impl SectionsAround {
    /// Whether the kernel reaches none of the three.
    #[inline(always)]
    pub(crate) fn are_none(self) -> bool {
        self.before == 0.0 && self.here == 0.0 && self.after == 0.0
    }
}

/// The sections of all phases as voxels read them: zeros, the sections, zeros.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SectionTable {
    weights: Vec<f32>,
    stride: usize,
    /// Slabs that a kernel touches at most.
    pub(crate) touched: usize,
}

impl SectionTable {
    pub(crate) fn new(reach: f64, footprint: &Footprint) -> Self {
        let touched = touched(reach);
        let stride = 8 + touched.next_multiple_of(8) + 8;
        let mut weights = vec![0.0; stride * PHASES as usize];
        for (phase, row) in weights.chunks_exact_mut(stride).enumerate() {
            let sections = sections(phase as u32, reach, footprint);
            row[8..].iter_mut().zip(sections).for_each(|(to, from)| *to = from as f32);
        }
        Self { weights, stride, touched }
    }

    /// The sections of eight slabs in a row, of which the first lies `first` slabs behind the one in which the kernel begins:
    /// −8 < `first` < touched.
    #[inline(always)]
    pub(crate) fn eight(&self, phase: u32, first: isize) -> &[f32] {
        let begin = phase as usize * self.stride + (8 + first) as usize;
        &self.weights[begin..begin + 8]
    }

    /// The sections of the slab before a slab, of itself and of the one behind it, that lies `slab` behind the one in which the kernel begins:
    /// −7 < `slab` ≤ touched.
    #[inline(always)]
    pub(crate) fn around(&self, phase: u32, slab: isize) -> SectionsAround {
        let eight = self.eight(phase, slab - 1);
        SectionsAround { before: eight[0], here: eight[1], after: eight[2] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_integrals_of_the_profile() {
        let footprint = Footprint { cutoff: 2.5 };
        let n = 200_000;
        let place = |i: usize| (i as f64 + 0.5) / n as f64 * 2.0 - 1.0;
        let whole: f64 = (0..n).map(|i| footprint.profile(place(i) * place(i))).sum();
        // Slabs a quarter of the kernel long, which begins half a slab behind a face.
        let found = sections(128, 2.0, &footprint);
        let ends = [-0.75, -0.25, 0.25, 0.75, 1.0];
        for (k, section) in found.iter().enumerate() {
            let part = (0..n).filter(|i| place(*i) < ends[k] && (k == 0 || place(*i) >= ends[k - 1]));
            let expected = part.map(|i| footprint.profile(place(i) * place(i))).sum::<f64>() / whole;
            assert!((section - expected).abs() < 1e-6, "section {k}: {section}, expected {expected}");
        }
    }

    #[test]
    fn eight_slabs_in_a_row_begin_anywhere() {
        let footprint = Footprint { cutoff: 2.8 };
        let table = SectionTable::new(2.0, &footprint);
        let sections_of_kernel = sections(77, 2.0, &footprint);
        for first in -7..table.touched as isize {
            let expected = (first..first + 8).map(|i| sections_of_kernel.get(i as usize).map_or(0.0, |w| *w as f32));
            assert_eq!(table.eight(77, first), expected.collect::<Vec<f32>>());
        }
    }
}
