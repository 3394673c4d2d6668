//! Parameters of a shadow map.

use crate::Error;
use splat_core::optics::AbsorbanceModel;
use splat_core::{FootprintStack, Limits};

/// The mapping from directions to cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MappingChoice {
    /// Planar for directional lights, spots, and point lights that see all casters within 60° of their middle;
    /// octahedral otherwise.
    #[default]
    Auto,
    /// The equal-area octahedral table of the whole sphere; for point and spot lights.
    Octahedral,
    /// The paper's table of polar and azimuth angles with its own minimum and maximum, fitted to the casters (Gunjee
    /// 2007, Eqs. 2-3); for point and spot lights.
    PolarAzimuth,
    /// A plane across the direction of a directional light or the axis of a spot or point light.
    Planar,
}

/// The resolution of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Resolution {
    /// Cells of half a splat spacing for up to some ten thousand splats; then cells that stay as they are while a volume's
    /// splats become finer, until splats overlap no more than [`Params::entries_per_splat`] cells each, and finer ones
    /// again from there on. Coarser where [`Params::limits`] would be exceeded. Finer splats never make coarser cells.
    #[default]
    Auto,
    /// Cells along the longer side of the table; ≥ 1. A polar table has this many rows over 180° of polar angle.
    Cells(u32),
}

/// Parameters of [`crate::ShadowMap::build`].
#[derive(Debug, Clone, PartialEq)]
pub struct Params {
    /// The mapping from directions to cells.
    pub mapping: MappingChoice,
    /// The resolution of the table.
    pub resolution: Resolution,
    /// Transmittance below which a list may stop, in (0, 1): A_cut = −ln(tolerance). The error of any receiver is at
    /// most `tolerance` times the unshadowed light.
    pub tolerance: f32,
    /// The model of absorbance; [`AbsorbanceModel::Paper`] reproduces Gunjee 2007, with its limit of 2.0.
    pub absorbance: AbsorbanceModel,
    /// Mean cells that a splat covers, which [`Resolution::Auto`] aims at for clouds of a million splats and more, ≥ 1.
    pub entries_per_splat: f32,
    /// Whether [`Resolution::Auto`] spends on finer cells what splats behind darkness save. Else a table has as many entries as the lit splats alone would
    /// have, and is made sooner.
    pub refines_lit: bool,
    /// Factor ≥ 1 on the radius √(area/π) of an opaque disc, so that neighbouring discs leave no holes.
    pub opaque_dilation: f32,
    /// Distance, in spacings of the receiver's splats, by which a surface is lifted towards the light before it is
    /// compared with other surfaces; ≥ 0.
    pub bias: f32,
    /// Kernels by footprint id.
    pub footprints: FootprintStack,
    /// Bytes that a map may take while it is built, and entries that are deposited.
    pub limits: Limits,
}

impl Default for Params {
    fn default() -> Self {
        Self {
            mapping: MappingChoice::Auto,
            resolution: Resolution::Auto,
            tolerance: 1e-5,
            absorbance: AbsorbanceModel::CrossSection,
            entries_per_splat: 6.0,
            refines_lit: true,
            opaque_dilation: 1.5,
            bias: 0.5,
            footprints: FootprintStack::default(),
            limits: Limits::default(),
        }
    }
}

impl Params {
    /// Absorbance at which lists stop.
    pub fn absorbance_limit(&self) -> f32 {
        match self.absorbance {
            AbsorbanceModel::CrossSection => -libm::logf(self.tolerance),
            AbsorbanceModel::Paper => 2.0,
        }
    }

    /// Checks ranges.
    ///
    /// # Errors
    /// [`Error::Parameter`] for the first that is out of range.
    pub fn validate(&self) -> Result<(), Error> {
        let check = |ok: bool, name, found: String, expected| {
            if ok { Ok(()) } else { Err(Error::Parameter { name, found, expected }) }
        };
        let t = self.tolerance;
        check((f32::MIN_POSITIVE..1.0).contains(&t), "tolerance", t.to_string(), "a number in (0, 1)")?;
        let e = self.entries_per_splat;
        check(e.is_finite() && e >= 1.0, "entries_per_splat", e.to_string(), "a finite number ≥ 1")?;
        let d = self.opaque_dilation;
        check((1.0..=16.0).contains(&d), "opaque_dilation", d.to_string(), "a number in [1, 16]")?;
        let b = self.bias;
        check((0.0..=16.0).contains(&b), "bias", b.to_string(), "a number in [0, 16]")?;
        check(self.resolution != Resolution::Cells(0), "resolution", "0".into(), "at least 1 cell")
    }
}
