//! What a light shines through: a picture, bilinear between the centres of its pixels, and dark around it; for bare points.

use glam::DVec3;
use splat_core::SlideProjection;

/// A picture before a light.
#[derive(Debug, Clone, PartialEq)]
pub struct Slide {
    projection: SlideProjection,
    size: [usize; 2],
    pixels: Vec<[f64; 3]>,
}

impl Slide {
    /// The reference's form of a noun.
    pub fn from_slide(slide: &splat_core::Slide) -> Self {
        let image = slide.image();
        let pixels = image.pixels.iter().map(|p| p.map(f64::from)).collect();
        Self { projection: *slide.projection(), size: image.size.map(|n| n as usize), pixels }
    }

    /// Factor on the light that arrives at a world point, per channel.
    pub fn passing(&self, p: DVec3) -> [f64; 3] {
        let SlideProjection { origin, axis, across, down } = self.projection;
        let way = p - origin;
        let depth = axis.map_or(1.0, |axis| way.dot(axis));
        let at = [across, down].map(|side| 0.5 + way.dot(side) / depth);
        if depth <= 0.0 || at.iter().any(|v| !(0.0..=1.0).contains(v)) {
            return [0.0; 3];
        }
        let mut sum = [0.0; 3];
        for corner in 0..4 {
            let mut weight = 1.0;
            let mut index = [0; 2];
            for a in 0..2 {
                let place = at[a] * self.size[a] as f64 - 0.5;
                let low = place.floor();
                let is_next = corner >> a & 1 == 1;
                weight *= if is_next { place - low } else { 1.0 - (place - low) };
                index[a] = (low + f64::from(u8::from(is_next))).clamp(0.0, self.size[a] as f64 - 1.0) as usize;
            }
            let pixel = self.pixels[index[1] * self.size[0] + index[0]];
            (0..3).for_each(|c| sum[c] += weight * pixel[c]);
        }
        sum
    }
}
