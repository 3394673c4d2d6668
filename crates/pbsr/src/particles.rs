//! Particles: small opaque points with position, normal and colour (Tanaka 2012, section 2), 20 bytes each.
//!
//! The paper's fourth attribute, the cross-section, is one number a sampler ([`crate::Sampler::cross_section`]).

use glam::Vec3;
use splat_core::glam;

/// A unit normal in 30 bits (octahedral, error below 2·10⁻⁴), or none; and whether the particle's surface has the same
/// opacity at every angle.
///
/// Source of the mapping: Z. Cigolle et al.: *A Survey of Efficient Representations for Independent Unit Vectors*, 2014.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PackedNormal(u32);

const HAS_NORMAL: u32 = 1 << 30;
const PER_CROSSING: u32 = 1 << 31;
const STEPS: f32 = 32766.0;

impl PackedNormal {
    /// Packs a unit vector; zero and vectors that are not finite give none.
    #[inline]
    pub fn new(n: Vec3) -> Self {
        let sum = n.x.abs() + n.y.abs() + n.z.abs();
        if !(sum > 0.0 && sum < f32::INFINITY) {
            return Self(0);
        }
        let inverse = 1.0 / sum;
        let x = n.x * inverse;
        let y = n.y * inverse;
        let (u, v) =
            if n.z >= 0.0 { (x, y) } else { ((1.0 - y.abs()) * 1f32.copysign(x), (1.0 - x.abs()) * 1f32.copysign(y)) };
        let step = |w: f32| ((w * 0.5 + 0.5) * STEPS + 0.5) as i32 as u32;
        Self(HAS_NORMAL | step(u) | step(v) << 15)
    }

    /// The same normal on a surface whose opacity does not depend on the angle
    /// ([`splat_core::optics::SurfaceOpacity::PerCrossing`]).
    #[inline]
    pub fn per_crossing(self) -> Self {
        Self(self.0 | PER_CROSSING)
    }

    /// Whether the opacity does not depend on the angle.
    #[inline]
    pub fn is_per_crossing(self) -> bool {
        self.0 & PER_CROSSING != 0
    }

    /// The bits, as kernels read them.
    #[cfg(feature = "gpu")]
    pub(crate) fn bits(self) -> u32 {
        self.0
    }

    /// The unit normal, or zero for none.
    #[inline]
    pub fn get(self) -> Vec3 {
        if self.0 & HAS_NORMAL == 0 {
            return Vec3::ZERO;
        }
        let part = |bits: u32| (bits & 0x7fff) as f32 * (2.0 / STEPS) - 1.0;
        let x = part(self.0);
        let y = part(self.0 >> 15);
        let z = 1.0 - x.abs() - y.abs();
        let fold = (-z).max(0.0);
        Vec3::new(x - fold.copysign(x), y - fold.copysign(y), z).normalize()
    }
}

/// A linear colour in 32 bits: three mantissas of nine bits and a shared exponent, 2⁻²⁴ to 65408. Rounded to the
/// nearest, the relative error is at most 1/512 of the largest channel. Objects whose colours lie elsewhere have a
/// [`color_unit`](crate::Appearance::color_unit).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PackedColor(u32);

impl PackedColor {
    /// White.
    pub const WHITE: Self = Self(256 | 256 << 9 | 256 << 18 | 16 << 27);

    /// Packs a colour, rounded to the nearest; negative and not finite channels count as 0, large ones as 65408.
    #[inline]
    pub fn new(color: [f32; 3]) -> Self {
        // The number before 511.5: what is rounded stays below 512.
        Steps::up_to(color, 511.5 - 1.0 / 32768.0).rounded(0.5)
    }

    /// Packs a colour for a particle at a random place. A hash of the place rounds it up or down, so that the mean over
    /// many particles is the colour itself. Colours that need no rounding stay as they are.
    #[inline]
    pub fn at(color: [f32; 3], place: Vec3) -> Self {
        Steps::new(color).at(place)
    }

    /// The bits, as kernels read them.
    #[cfg(feature = "gpu")]
    pub(crate) fn bits(self) -> u32 {
        self.0
    }

    /// The colour.
    #[inline]
    pub fn get(self) -> [f32; 3] {
        let scale = f32::from_bits(((self.0 >> 27) + 127 - 15 - 9) << 23);
        [self.0, self.0 >> 9, self.0 >> 18].map(|v| (v & 511) as f32 * scale)
    }
}

/// A colour in steps of its packed form, not rounded yet.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steps {
    /// Of each channel, below 512.
    channels: [f32; 3],
    exponent: u32,
}

impl Steps {
    #[inline]
    pub(crate) fn new(color: [f32; 3]) -> Self {
        Self::up_to(color, 511.0)
    }

    /// Of which the largest is at most `most`, 256 or more.
    #[inline]
    fn up_to(color: [f32; 3], most: f32) -> Self {
        let c = color.map(|v| if v > 0.0 { v.min(65408.0) } else { 0.0 });
        let largest = c[0].max(c[1]).max(c[2]);
        // Exponent of two above the largest channel, from its bits; rounding may carry into the next.
        let mut exponent = ((largest.to_bits() >> 23) as i32 - 126).max(-15);
        let scale = |e: i32| f32::from_bits(((9 - e + 127) as u32) << 23);
        if largest * scale(exponent) > most {
            exponent += 1;
        }
        let s = scale(exponent);
        Self { channels: c.map(|v| v * s), exponent: (exponent + 15) as u32 }
    }

    /// Whole steps below what the channels are with `more`.
    #[inline]
    fn rounded(self, more: f32) -> PackedColor {
        let [r, g, b] = self.channels.map(|v| (v + more) as i32 as u32);
        PackedColor(r | g << 9 | b << 18 | self.exponent << 27)
    }

    /// See [`PackedColor::at`].
    #[inline]
    pub(crate) fn at(self, place: Vec3) -> PackedColor {
        // Numbers of 14 bits and a half: beside whole steps up to 512, f32 adds them exactly.
        self.rounded(((hash_of(place) >> 18) as f32 + 0.5) * (1.0 / 16384.0))
    }
}

/// A hash of the bits of a place. Places are random, so it is a random number that costs no other and that a device, which
/// has the same places, has too.
#[inline]
fn hash_of(place: Vec3) -> u32 {
    let [x, y, z] = place.to_array().map(f32::to_bits);
    let mut v = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77) ^ z.wrapping_mul(0xc2b2_ae3d);
    v ^= v >> 16;
    v = v.wrapping_mul(0x21f0_aaad);
    v ^= v >> 15;
    v = v.wrapping_mul(0x735a_2d97);
    v ^ (v >> 15)
}

/// Particles as columns, offsets from their sampler's origin.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Particles {
    /// Positions relative to [`crate::Sampler::origin`], world units.
    pub position: Vec<Vec3>,
    /// Normals, for shading and for surfaces of angle-independent opacity.
    pub normal: Vec<PackedNormal>,
    /// Colours: surface albedo, or the tint of a medium's scattering.
    pub color: Vec<PackedColor>,
}

impl Particles {
    /// Bytes of one particle.
    pub const BYTES: usize = 20;

    /// Number of particles.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True without particles.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Forgets all particles and keeps the memory.
    pub fn clear(&mut self) {
        self.position.clear();
        self.normal.clear();
        self.color.clear();
    }

    /// Room for `n` more.
    pub fn reserve(&mut self, n: usize) {
        self.position.reserve(n);
        self.normal.reserve(n);
        self.color.reserve(n);
    }

    /// Appends all of another.
    pub fn append(&mut self, other: &Self) {
        self.position.extend_from_slice(&other.position);
        self.normal.extend_from_slice(&other.normal);
        self.color.extend_from_slice(&other.color);
    }

    /// Appends one.
    #[inline]
    pub fn push(&mut self, position: Vec3, normal: PackedNormal, color: PackedColor) {
        self.position.push(position);
        self.normal.push(normal);
        self.color.push(color);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng;

    #[test]
    fn normals_come_back_within_two_ten_thousandths() {
        for i in 0..20_000 {
            let u = |k| rng::unit_f32(1, 1, i, k) * 2.0 - 1.0;
            let n = Vec3::new(u(0), u(1), u(2)).normalize();
            let back = PackedNormal::new(n).get();
            assert!((back - n).length() < 2e-4, "{n} → {back}");
        }
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!(PackedNormal::new(axis).get(), axis);
            assert_eq!(PackedNormal::new(-axis).per_crossing().get(), -axis);
        }
        assert_eq!(PackedNormal::new(Vec3::ZERO).get(), Vec3::ZERO);
        assert_eq!(PackedNormal::new(Vec3::NAN), PackedNormal::default());
    }

    #[test]
    fn colours_come_back_within_a_512th() {
        assert_eq!(PackedColor::WHITE.get(), [1.0; 3]);
        assert_eq!(PackedColor::new([1.0; 3]), PackedColor::WHITE);
        assert_eq!(PackedColor::new([0.0; 3]).get(), [0.0; 3]);
        assert_eq!(PackedColor::new([f32::NAN, -1.0, f32::INFINITY]).get()[2], 65408.0);
        for i in 0..20_000 {
            let c: [f32; 3] = std::array::from_fn(|k| (rng::unit_f32(2, 1, i, k as u64) * 20.0 - 10.0).exp2());
            let back = PackedColor::new(c).get();
            let largest = c[0].max(c[1]).max(c[2]);
            assert!((0..3).all(|k| (back[k] - c[k]).abs() <= largest / 512.0), "{c:?} → {back:?}");
        }
    }
}
