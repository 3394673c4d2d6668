//! How a box in the world lies in the view, from a few points of it: enough to count work, not to cull by.

use splat_core::{Camera, DAabb, glam::DVec3};

/// Points along a side of the box.
const SIDE: u32 = 8;
/// Share of the rectangle about a projected box that the box covers, on average of directions.
const COVERED: f64 = 0.75;

/// How a box lies in the view.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Extent {
    /// Share of its volume that is in view, 0 to 1.
    pub(crate) share: f64,
    /// Samples of the picture that it covers.
    pub(crate) samples: f64,
    /// Mean width of a world unit in it, samples.
    pub(crate) samples_per_unit: f64,
}

impl Extent {
    /// How a box lies in the view of a camera whose pixels are samples.
    pub(crate) fn new(bounds: &DAabb, camera: &Camera) -> Self {
        let size = bounds.max - bounds.min;
        let focal = camera.focal_px();
        let half = camera.size.map(|s| 0.5 * f64::from(s));
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE);
        let mut seen = 0.0;
        let mut sum = 0.0;
        let mut low = [f64::INFINITY; 2];
        let mut high = [f64::NEG_INFINITY; 2];
        for k in 0..SIDE.pow(3) {
            let part = DVec3::new(place(k % SIDE), place(k / SIDE % SIDE), place(k / SIDE / SIDE));
            let p = camera.view_from_world(bounds.min + size * part);
            let scale = if camera.is_orthographic() { focal } else { focal / p.z };
            let at = [p.x * scale, p.y * scale];
            if p.z <= 0.0 || at[0].abs() > half[0] || at[1].abs() > half[1] {
                continue;
            }
            seen += 1.0;
            sum += scale;
            for axis in 0..2 {
                low[axis] = low[axis].min(at[axis]);
                high[axis] = high[axis].max(at[axis]);
            }
        }
        if seen == 0.0 {
            return Self::default();
        }
        // Middles of parts lie half a part within the box.
        let widened = f64::from(SIDE) / f64::from(SIDE - 1);
        let rectangle = [0, 1].map(|axis| ((high[axis] - low[axis]) * widened).min(2.0 * half[axis]));
        Self {
            share: seen / f64::from(SIDE.pow(3)),
            samples: COVERED * rectangle[0] * rectangle[1],
            samples_per_unit: sum / seen,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_half_out_of_view_has_half_its_share() {
        let projection = splat_core::Projection::Orthographic { height: 2.0 };
        let camera =
            Camera { position: DVec3::ZERO, axes: [DVec3::X, DVec3::Y, DVec3::Z], projection, size: [100, 100] };
        let whole = Extent::new(&DAabb::new(DVec3::new(-0.5, -0.5, 1.0), DVec3::new(0.5, 0.5, 2.0)), &camera);
        assert_eq!((whole.share, whole.samples_per_unit), (1.0, 50.0));
        assert!((whole.samples - COVERED * 2500.0).abs() < 1e-6, "{whole:?}");
        let half = Extent::new(&DAabb::new(DVec3::new(0.5, -0.5, 1.0), DVec3::new(1.5, 0.5, 2.0)), &camera);
        assert_eq!(half.share, 0.5);
        let behind = Extent::new(&DAabb::new(DVec3::new(0.0, 0.0, -2.0), DVec3::new(1.0, 1.0, -1.0)), &camera);
        assert_eq!(behind, Extent::default());
    }
}
