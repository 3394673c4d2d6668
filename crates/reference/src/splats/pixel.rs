//! A pixel of an accumulator, summed in f64.

use splat_core::{Accumulator, DepthFragment, DepthProfile};

/// What a pixel of an [`Accumulator`] has, front to back, in f64: taken from there, added to, and stored there again.
#[derive(Debug, Clone)]
pub struct PixelSum {
    /// One plane, or three.
    optical_depth: Vec<f64>,
    channels: Vec<f64>,
    depth: Option<DepthProfile>,
    object: Option<u32>,
}

impl PixelSum {
    /// Pixel `k` of an accumulator as it is.
    ///
    /// # Panics
    /// If the accumulator has fewer pixels.
    pub fn from_accumulator(accumulator: &Accumulator, k: usize) -> Self {
        let at = |planes: &[Vec<f32>]| planes.iter().map(|plane| f64::from(plane[k])).collect();
        Self {
            optical_depth: at(&accumulator.optical_depth),
            channels: at(&accumulator.channels),
            depth: accumulator.depth.get(k).copied(),
            object: accumulator.object.get(k).copied(),
        }
    }

    /// Planes of optical depth, one or three.
    pub fn planes(&self) -> usize {
        self.optical_depth.len()
    }

    /// Adds a fragment of an object behind all so far: its optical depth by plane, its `values` by channel, of which each is hidden by
    /// the plane `plane_of` it. `depth` says where it lies, given the optical depths before and behind it in the middle plane.
    pub fn add(
        &mut self,
        optical_depth: [f64; 3],
        values: &[f32],
        plane_of: impl Fn(usize) -> usize,
        object: u32,
        depth: impl FnOnce([f32; 2]) -> DepthFragment,
    ) {
        for (c, (sum, value)) in self.channels.iter_mut().zip(values).enumerate() {
            let plane = plane_of(c);
            *sum += libm::exp(-self.optical_depth[plane]) * -libm::expm1(-optical_depth[plane]) * f64::from(*value);
        }
        let middle = self.planes() / 2;
        let before = self.optical_depth[middle];
        self.optical_depth.iter_mut().zip(optical_depth).for_each(|(sum, depth)| *sum += depth);
        let behind = self.optical_depth[middle];
        if behind <= before {
            return;
        }
        if let Some(profile) = &mut self.depth {
            profile.add(&depth([before as f32, behind as f32]));
        }
        if let Some(first) = self.object.as_mut().filter(|first| **first == u32::MAX) {
            *first = object;
        }
    }

    /// Whether pixel `k` of an accumulator has what was stored of it.
    pub fn is_rounded_in(&self, accumulator: &Accumulator, k: usize) -> bool {
        let same = |planes: &[Vec<f32>], sums: &[f64]| planes.iter().zip(sums).all(|(plane, v)| plane[k] == *v as f32);
        same(&accumulator.optical_depth, &self.optical_depth) && same(&accumulator.channels, &self.channels)
    }

    /// Rounds it into pixel `k` of an accumulator.
    pub fn store(&self, accumulator: &mut Accumulator, k: usize) {
        let store = |planes: &mut [Vec<f32>], sums: &[f64]| {
            planes.iter_mut().zip(sums).for_each(|(plane, v)| plane[k] = *v as f32);
        };
        store(&mut accumulator.optical_depth, &self.optical_depth);
        store(&mut accumulator.channels, &self.channels);
        accumulator.depth.get_mut(k).into_iter().zip(self.depth).for_each(|(to, from)| *to = from);
        accumulator.object.get_mut(k).into_iter().zip(self.object).for_each(|(to, from)| *to = from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiny_optical_depths_add_up_where_single_precision_stalls() {
        let mut accumulator = Accumulator::new([1, 1], 1, 3, false, true);
        let mut pixel = PixelSum::from_accumulator(&accumulator, 0);
        let n = 1 << 20;
        for i in 0..n {
            let nowhere = |_: [f32; 2]| unreachable!("no depths are kept");
            pixel.add([1e-9; 3], &[1.0, 0.5, 0.0], |_| 0, i, nowhere);
        }
        assert!(!pixel.is_rounded_in(&accumulator, 0));
        pixel.store(&mut accumulator, 0);
        assert!(pixel.is_rounded_in(&accumulator, 0));
        let opacity = -libm::expm1(-1e-9 * f64::from(n));
        assert!((f64::from(accumulator.channels[0][0]) / opacity - 1.0).abs() < 1e-7);
        assert_eq!(accumulator.channels[1][0], 0.5 * accumulator.channels[0][0]);
        assert_eq!(accumulator.object, [0]);
    }
}
