//! Arithmetic on neighbouring pixels of a row: [`Lanes`] wraps the widest vectors that the machine has ([`pulp`]).
//!
//! Lanes never mix and a multiplication is fused with an addition where [`Lanes::mul_add`] says so and nowhere else, so
//! every instruction set gives the same bits.
//!
//! ```
//! use splat_core::raster::{lanes::Broadcast, pulp};
//!
//! /// e^−x of one number, on all lanes of the machine.
//! struct Transmittance(f32);
//!
//! impl pulp::WithSimd for Transmittance {
//!     type Output = f32;
//!
//!     fn with_simd<S: pulp::Simd>(self, simd: S) -> f32 {
//!         let mut out = [0.0; splat_core::raster::lanes::MAX_LANES];
//!         simd.lanes(self.0).exp_neg().store(&mut out);
//!         out[0]
//!     }
//! }
//!
//! let half = pulp::Arch::new().dispatch(Transmittance(std::f32::consts::LN_2));
//! assert!((half - 0.5).abs() < 1e-6);
//! ```

use pulp::Simd;
use std::ops::{Add, Div, Mul, Sub};

/// The most lanes that any instruction set has.
pub const MAX_LANES: usize = 16;

/// One f32 per lane.
#[derive(Clone, Copy)]
pub struct Lanes<S: Simd> {
    simd: S,
    value: S::f32s,
}

/// The same number in all lanes. A method of what tells the instruction set: a closure that is called some times may stay a call, and what it calls, too.
pub trait Broadcast: Simd {
    /// `value` in all lanes.
    #[inline(always)]
    fn lanes(self, value: f32) -> Lanes<Self> {
        Lanes { simd: self, value: self.splat_f32s(value) }
    }
}

impl<S: Simd> Broadcast for S {}

macro_rules! operator {
    ($($trait:ident $method:ident $instruction:ident),*) => {$(
        impl<S: Simd> $trait for Lanes<S> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self { simd: self.simd, value: self.simd.$instruction(self.value, other.value) }
            }
        }
    )*};
}
operator!(Add add add_f32s, Sub sub sub_f32s, Mul mul mul_f32s, Div div div_f32s);

impl<S: Simd> Lanes<S> {
    /// Lanes of this instruction set.
    pub const COUNT: usize = S::F32_LANES;

    /// The first lanes of `from`.
    ///
    /// # Panics
    /// If `from` has fewer.
    #[inline(always)]
    pub fn load(simd: S, from: &[f32]) -> Self {
        Self { simd, value: S::as_simd_f32s(from).0[0] }
    }

    /// Writes to the first lanes of `to`.
    ///
    /// # Panics
    /// If `to` has fewer.
    #[inline(always)]
    pub fn store(self, to: &mut [f32]) {
        S::as_mut_simd_f32s(to).0[0] = self.value;
    }

    /// `self`·`factor` + `addend`, rounded once, on every machine.
    #[inline(always)]
    pub fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self { simd: self.simd, value: self.simd.mul_add_f32s(self.value, factor.value, addend.value) }
    }

    /// `addend` − `self`·`factor`, rounded once.
    #[inline(always)]
    pub fn negate_mul_add(self, factor: Self, addend: Self) -> Self {
        Self { simd: self.simd, value: self.simd.negate_mul_add_f32s(self.value, factor.value, addend.value) }
    }

    /// The square root.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self { simd: self.simd, value: self.simd.sqrt_f32s(self.value) }
    }

    /// The bits of the numbers. The methods of `pulp` that name this, and others that it makes of them (`abs_f32s`, `and_f32s`, `select_f32s`), may
    /// stay calls through memory within vectorised code.
    #[inline(always)]
    fn bits(self) -> S::u32s {
        pulp::cast(self.value)
    }

    /// The numbers of some bits.
    #[inline(always)]
    fn from_bits(simd: S, bits: S::u32s) -> Self {
        Self { simd, value: pulp::cast(bits) }
    }

    /// The absolute value.
    #[inline(always)]
    pub fn abs(self) -> Self {
        let simd = self.simd;
        let bits = simd.and_u32s(self.bits(), simd.splat_u32s(0x7fff_ffff));
        Self::from_bits(simd, bits)
    }

    /// The lesser of the two; neither may be NaN.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self { simd: self.simd, value: self.simd.min_f32s(self.value, other.value) }
    }

    /// The greater of the two; neither may be NaN.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self { simd: self.simd, value: self.simd.max_f32s(self.value, other.value) }
    }

    /// `self` where `a` < `b`, `other` elsewhere.
    #[inline(always)]
    pub fn where_less_or(self, a: Self, b: Self, other: Self) -> Self {
        let simd = self.simd;
        let bits = simd.select_u32s(simd.less_than_f32s(a.value, b.value), self.bits(), other.bits());
        Self::from_bits(simd, bits)
    }

    /// `self` where `a` < `b`, 0 elsewhere.
    #[inline(always)]
    pub fn where_less(self, a: Self, b: Self) -> Self {
        self.where_less_or(a, b, self.simd.lanes(0.0))
    }

    /// e^−x for x ≥ 0, as [`exp_neg`] in every bit.
    #[inline(always)]
    pub fn exp_neg(self) -> Self {
        let simd = self.simd;
        let t = (self * simd.lanes(-std::f32::consts::LOG2_E)).max(simd.lanes(-127.0));
        let shifted = t + simd.lanes(MAGIC);
        let f = t - (shifted - simd.lanes(MAGIC));
        let g = f * f;
        let high = (simd.lanes(EXP2[4]) + simd.lanes(EXP2[5]) * f) + simd.lanes(EXP2[6]) * g;
        let p = (simd.lanes(EXP2[0]) + simd.lanes(EXP2[1]) * f)
            + g * ((simd.lanes(EXP2[2]) + simd.lanes(EXP2[3]) * f) + g * high);
        let exponent = simd.wrapping_dyn_shl_u32s(shifted.bits(), simd.splat_u32s(23));
        let bits = simd.add_u32s(p.bits(), exponent);
        Self::from_bits(simd, bits).where_less(simd.lanes(-126.0), t)
    }

    /// The natural logarithm of a normal number > 0: an error below 2·10⁻⁷ of it, or of 10⁻⁷ near 1.
    #[inline(always)]
    pub fn logarithm(self) -> Self {
        let simd = self.simd;
        // Bits of 1/√2, so that what is left of the number lies around 1; 127 more make the exponent a natural number.
        let above = simd.add_u32s(self.bits(), simd.splat_u32s((127 << 23) - 0x3f35_04f3));
        let exponent = simd.wrapping_dyn_shr_u32s(above, simd.splat_u32s(23));
        let scale = simd.wrapping_dyn_shl_u32s(simd.sub_u32s(exponent, simd.splat_u32s(127)), simd.splat_u32s(23));
        let rest = simd.sub_u32s(self.bits(), scale);
        // The bits of 2²³ and a natural number below are those of their sum.
        let exponent = Self::from_bits(simd, simd.add_u32s(exponent, simd.splat_u32s(0x4b00_0000)))
            - simd.lanes(8_388_608.0 + 127.0);
        let f = Self::from_bits(simd, rest) - simd.lanes(1.0);
        let mut p = simd.lanes(LN[0]);
        for c in &LN[1..] {
            p = p.mul_add(f, simd.lanes(*c));
        }
        let square = f * f;
        let low = exponent.mul_add(simd.lanes(LN_2[1]), p * f * square) - simd.lanes(0.5) * square;
        exponent.mul_add(simd.lanes(LN_2[0]), f + low)
    }

    /// Whether `self` < `other` in any lane.
    #[inline(always)]
    pub fn any_less(self, other: Self) -> bool {
        self.simd.first_true_m32s(self.simd.less_than_f32s(self.value, other.value)) < Self::COUNT
    }

    /// 1 − e^−x for 0 ≤ x ≤ ½, relative error below 2·10⁻⁷: tiny x keep their digits.
    #[inline(always)]
    pub fn opacity_of_small(self) -> Self {
        let low = self.simd.lanes(OPACITY[1]).mul_add(self, self.simd.lanes(OPACITY[0]));
        let high = self.simd.lanes(OPACITY[3]).mul_add(self, self.simd.lanes(OPACITY[2]));
        let x2 = self * self;
        (high.mul_add(x2, low)).mul_add(x2, self)
    }

    /// 1 − e^−x for any x ≥ 0: [`Lanes::opacity_of_small`] where it holds, the exponential elsewhere.
    #[inline(always)]
    pub fn opacity(self) -> Self {
        let small = self.min(self.simd.lanes(SMALL)).opacity_of_small();
        // The exponential is asked for where any lane takes it.
        if !self.simd.lanes(BELOW_SMALL).any_less(self) {
            return small;
        }
        small.where_less_or(self, self.simd.lanes(SMALL), self.simd.lanes(1.0) - self.exp_neg())
    }

    /// Rounded to half precision (11 bits, least normal number 2⁻¹⁴), at most 65504.
    #[inline(always)]
    pub fn to_half(self) -> Self {
        // Veltkamp's splitting keeps 11 of 24 bits; below 2⁻¹⁴ the unit is 2⁻²⁴, that of a float near 0.75.
        let scaled = self * self.simd.lanes(8193.0);
        let normal = scaled - (scaled - self);
        let tiny = (self + self.simd.lanes(0.75)) - self.simd.lanes(0.75);
        tiny.where_less_or(self.abs(), self.simd.lanes(1.0 / 16384.0), normal)
            .min(self.simd.lanes(65504.0))
            .max(self.simd.lanes(-65504.0))
    }
}

/// Coefficients of 2^f on [−½, ½]: Taylor series of e^(f ln 2) to degree 6, relative error below 2·10⁻⁸.
const EXP2: [f32; 7] =
    [1.0, std::f32::consts::LN_2, 0.240_226_5, 0.055_504_11, 0.009_618_129, 0.001_333_355_8, 0.000_154_035_3];

/// ln(1 + f) = f − f²/2 + f³·P(f) on [1/√2 − 1, √2 − 1]: the polynomial of Cephes' `logf`, highest power first.
const LN: [f32; 9] = [
    0.070_376_836,
    -0.115_146_1,
    0.116_769_99,
    -0.124_201_41,
    0.142_493_23,
    -0.166_680_58,
    0.200_007_15,
    -0.249_999_94,
    0.333_333_3,
];

/// ln 2 in two parts, the first of few digits.
const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];

/// Optical depth up to which a polynomial gives the opacity.
pub(crate) const SMALL: f32 = 0.5;

/// The number before it.
const BELOW_SMALL: f32 = f32::from_bits(SMALL.to_bits() - 1);

/// ((1 − e^−x)/x − 1)/x on [0, ½], the cubic of least error.
const OPACITY: [f32; 4] = [-0.499_994_3, 0.166_561_98, -0.041_039_184, 0.006_804_911];

/// 1.5·2²³: adding it rounds to an integer that sits in the low bits of the sum.
const MAGIC: f32 = 12_582_912.0;

/// e^−x for x ≥ 0, relative error below 3·10⁻⁷ up to x = 8; 0 below 2⁻¹²⁶.
#[inline(always)]
pub fn exp_neg(x: f32) -> f32 {
    let t = (x * -std::f32::consts::LOG2_E).max(-127.0);
    let shifted = t + MAGIC;
    let f = t - (shifted - MAGIC);
    // Pairs first: half the latency of Horner's scheme.
    let g = f * f;
    let high = (EXP2[4] + EXP2[5] * f) + EXP2[6] * g;
    let p = (EXP2[0] + EXP2[1] * f) + g * ((EXP2[2] + EXP2[3] * f) + g * high);
    let scaled = f32::from_bits(p.to_bits().wrapping_add(shifted.to_bits() << 23));
    if t > -126.0 { scaled } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_neg_matches_f64() {
        for i in 0..200_000 {
            let x = i as f32 * 1e-4;
            let exact = (-f64::from(x)).exp();
            let error = (f64::from(exp_neg(x)) / exact - 1.0).abs();
            assert!(error < 3e-7 * (1.0 + f64::from(x) / 4.0), "x {x}: {error:e}");
        }
        assert_eq!(exp_neg(0.0), 1.0);
        assert_eq!(exp_neg(1e9), 0.0);
    }

    /// A function of lanes.
    #[derive(Clone, Copy, PartialEq)]
    enum Function {
        ExpNeg,
        Opacity,
        ToHalf,
        Ln,
    }

    /// Runs a function on every lane of an instruction set.
    struct Apply(f32, Function);

    impl pulp::WithSimd for Apply {
        type Output = Vec<f32>;

        fn with_simd<S: Simd>(self, simd: S) -> Vec<f32> {
            let lanes = simd.lanes(self.0);
            let mut out = [0.0; MAX_LANES];
            match self.1 {
                Function::ExpNeg => lanes.exp_neg(),
                Function::Opacity => lanes.opacity(),
                Function::ToHalf => lanes.to_half(),
                Function::Ln => lanes.logarithm(),
            }
            .store(&mut out);
            out[..Lanes::<S>::COUNT].to_vec()
        }
    }

    #[test]
    fn every_instruction_set_gives_the_bits_of_the_scalar_form() {
        for i in 0..20_000 {
            let x = i as f32 * 7.3e-3;
            for lane in pulp::Arch::new().dispatch(Apply(x, Function::ExpNeg)) {
                assert_eq!(lane.to_bits(), exp_neg(x).to_bits(), "x {x}");
            }
            let scalar = pulp::Arch::Scalar.dispatch(Apply(x * 0.01, Function::Opacity))[0];
            for lane in pulp::Arch::new().dispatch(Apply(x * 0.01, Function::Opacity)) {
                assert_eq!(lane.to_bits(), scalar.to_bits(), "x {x}");
            }
        }
    }

    #[test]
    fn ln_matches_f64() {
        let ln = |x: f32, arch: pulp::Arch| arch.dispatch(Apply(x, Function::Ln));
        for x in (0..40_000).map(|i| 1.2e-38 * 1.0043f32.powi(i)).filter(|x| x.is_finite()) {
            let exact = f64::from(x).ln();
            let found = ln(x, pulp::Arch::new());
            assert!(found.iter().all(|lane| lane.to_bits() == ln(x, pulp::Arch::Scalar)[0].to_bits()), "x {x:e}");
            let error = (f64::from(found[0]) - exact).abs();
            assert!(error < 2e-7 * exact.abs() && (error < 1e-8 || (x - 1.0).abs() > 0.01), "x {x:e}: {error:e}");
        }
        assert_eq!(ln(1.0, pulp::Arch::new())[0], 0.0);
    }

    /// Whether only the last lane is less.
    struct AnyLess([f32; MAX_LANES], f32);

    impl pulp::WithSimd for AnyLess {
        type Output = bool;

        fn with_simd<S: Simd>(mut self, simd: S) -> bool {
            self.0[Lanes::<S>::COUNT - 1] = -1.0;
            Lanes::load(simd, &self.0).any_less(simd.lanes(self.1))
        }
    }

    #[test]
    fn any_lane_counts() {
        for arch in [pulp::Arch::new(), pulp::Arch::Scalar] {
            assert!(arch.dispatch(AnyLess([1.0; MAX_LANES], 0.0)) && arch.dispatch(AnyLess([-2.0; MAX_LANES], 0.0)));
            assert!(!arch.dispatch(AnyLess([1.0; MAX_LANES], -1.0)));
        }
    }

    #[test]
    fn halves_have_eleven_bits() {
        let half = |x: f32| pulp::Arch::new().dispatch(Apply(x, Function::ToHalf))[0];
        let ulp = 1.0 / 1024.0;
        for (x, rounded) in [
            (0.1, 0.099_975_586),
            (1.0 + 0.5 * ulp, 1.0),
            (1.0 + 1.5 * ulp, 1.0 + 2.0 * ulp),
            (-2.001, -2.001_953_1),
            (6.0e-8, 5.960_464_5e-8),
            (2e-8, 0.0),
            (1e6, 65504.0),
        ] {
            assert_eq!(half(x), rounded, "{x}");
        }
    }

    #[test]
    fn cv06_opacity_keeps_the_digits_of_tiny_optical_depths() {
        let opacity = |x: f32| pulp::Arch::new().dispatch(Apply(x, Function::Opacity))[0];
        for x in (0..4000).map(|i| 1e-30 * 1.02f32.powi(i)).filter(|x| *x < 40.0) {
            let exact = -(-f64::from(x)).exp_m1();
            assert!((f64::from(opacity(x)) / exact - 1.0).abs() < 3e-7, "x {x:e}: {:e}", opacity(x));
        }
        assert_eq!((opacity(0.0), opacity(1e9)), (0.0, 1.0));
    }
}
