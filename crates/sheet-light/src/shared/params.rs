//! What the caller chooses: slab width, kernel, when a pixel is done, memory.

use super::sections::PHASES;
use crate::{Error, Volume};
use splat_core::Limits;
use splat_core::raster::Accumulation;

/// The reconstruction kernel, in spacings of the lattice: a Gaussian less its Taylor polynomial at the rim
/// ([`splat_core::Footprint`]), across the view as a footprint, along it as sections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KernelShape {
    /// Cutoff radius, spacings; the paper's extent of the basis function.
    pub extent: f64,
    /// Standard deviation of the Gaussian, spacings. `extent / sigma` lies in \[1, 8\].
    pub sigma: f64,
}

impl Default for KernelShape {
    /// The paper's extent of 2.0, with the deviation that keeps sums over a lattice even.
    fn default() -> Self {
        Self { extent: 2.0, sigma: 0.7 }
    }
}

/// How sheets get their values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Reconstruction {
    /// Each voxel adds its kernel to the sheets that it touches (the paper).
    #[default]
    Splat,
    /// Each pixel of a sheet reads the lattice. Of Cartesian lattices, classified afterwards.
    Gather(GatherKernel),
}

/// What a pixel reads of the lattice around its place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GatherKernel {
    /// Eight voxels, linearly, as most ray casters have it.
    Linear,
    /// The paper's kernel, [`KernelShape::default`], as a cubic B-spline over a filtered lattice: 64 voxels, and 4 bytes a voxel beside the file's own values.
    Gaussian,
}

/// When values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Classify {
    /// When they are reconstructed, so that zooms show no blur (Mueller, Möller, Crawfis 1999; the paper).
    #[default]
    After,
    /// When they are reconstructed, all values that a ray meets in a slab: optical depth and colour are integrals of the transfer function between the values at the ends and in the
    /// middle (Engel, Kraus, Ertl 2001), so that nothing thinner than a slab is missed. Values at the faces of slabs are those of a cubic through four sheets.
    Preintegrated,
    /// At the voxels, before they are splatted (Westover 1990): four more sums, and a transfer function that is blurred by the kernel.
    Before,
}

/// What slabs lie along.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Aligned {
    /// The image (Mueller, Crawfis 1998; the paper).
    #[default]
    View,
    /// The planes of the lattice that lie most nearly across the view, a slab for each, into which its kernels go whole (Westover 1990):
    /// pictures pop where other planes do. Parallel rays and one volume alone.
    Axis,
}

/// Where the normals of volumes that have them come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Gradients {
    /// Differences of neighbouring pixels and sheets (the paper, section 4.2): of the values that are seen, blurred by kernels.
    #[default]
    Sheets,
    /// A gradient volume: central differences at the voxels, interpolated trilinearly; 12 bytes a voxel that is needed. So ray casters have it, and
    /// normals know nothing of kernels, slabs and pixels.
    Volume,
    /// The field that gathered sheets read: by the derivative of its kernel; of a linear one, whose derivative jumps from cell to cell, by differences from one step
    /// before to one behind. What is splatted has none.
    Kernel,
}

/// Where the part of a ray in a slab takes the light that comes through shadows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Lighting {
    /// All along it, with what is left on the way to the eye: the joint integral of [`splat_core::shade::joint`], where a spacing is optically
    /// thick.
    #[default]
    Joint,
    /// In its middle (the paper): thick media are too dark.
    Middle,
}

/// Parameters of image-aligned sheets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Slab width Δs, world units, > 0; `None` for the least spacing of the volumes along the view.
    pub slab_width: Option<f64>,
    /// How sheets get their values.
    pub reconstruction: Reconstruction,
    /// The kernel of what is splatted.
    pub kernel: KernelShape,
    /// Sections that are known of a kernel in each slab's width: the places within a slab at which kernels may begin, which theirs are rounded to.
    /// A power of two up to [`PHASES`](crate::shared::sections::PHASES), the default; 64 in the paper.
    pub sections: u32,
    /// Precision of what is summed over voxels in a sheet, and over slabs in the eye's image and the light's: single, or the 11 bits of half precision, as
    /// in buffers of 16 bits whose exponents suit what they hold. Those stall where a slab adds less than half of the last bit, so that they take at
    /// most [`Params::MOST_F16_SLABS`] slabs.
    pub accumulation: Accumulation,
    /// Where normals come from.
    pub gradients: Gradients,
    /// Where light is taken; of slabs across the view alone.
    pub lighting: Lighting,
    /// When values become colours; of slabs across the view alone.
    pub classify: Classify,
    /// What slabs lie along; of slabs across the view alone.
    pub aligned: Aligned,
    /// A pixel is done when its transmittance is below this, in \[0, 1): what is hidden errs by at most that times the radiance
    /// behind it. So tolerance/L_max; [`Params::PAPERS_CUTOFF`] is the paper's.
    pub transmittance_cutoff: f32,
    /// Bytes of lists, records and sheets, estimated before any is taken.
    pub limits: Limits,
}

impl Params {
    /// "Usually 0.98" opacity (section 4.4).
    pub const PAPERS_CUTOFF: f32 = 0.02;

    /// Most slabs that sums of 11 bits take: what a slab adds to as many equal ones is half of their sum's last bit or more.
    pub const MOST_F16_SLABS: u32 = 2048;

    /// What [`Params::check_any_mode`] does, and that no mode but the paper's is asked for.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.check_any_mode()?;
        if self.classify != Classify::After {
            return Err(Error::parameter("classify", self.classify, "After in half-vector sheets"));
        }
        if self.aligned != Aligned::View {
            return Err(Error::parameter("aligned", self.aligned, "View in half-vector sheets"));
        }
        Ok(())
    }

    /// Whether the gradients of a volume are those of the field that its sheets read.
    pub(crate) fn differentiates(&self, volume: &Volume<'_>) -> bool {
        volume.normals && self.gradients == Gradients::Kernel
    }

    /// Whether the gradients of a volume are told from neighbouring sheets.
    pub(crate) fn compares_sheets(&self, volume: &Volume<'_>) -> bool {
        volume.normals && self.gradients == Gradients::Sheets
    }

    /// Whether sums are rounded to half precision.
    pub(crate) fn is_half(&self) -> bool {
        self.accumulation == Accumulation::F16
    }

    /// How much farther kernels reach by the rounding of their places than they do at the default, slabs.
    pub(crate) fn rounding(&self) -> f64 {
        0.5 / f64::from(self.sections) - 0.5 / f64::from(PHASES)
    }

    /// That sums do not stall in so many slabs.
    pub(crate) fn check_slabs(&self, count: u32) -> Result<(), Error> {
        if !self.is_half() || count <= Self::MOST_F16_SLABS {
            return Ok(());
        }
        let hint = "choose wider slabs or sums of single precision".to_owned();
        Err(Error::limit("accumulation in half precision", count.into(), Self::MOST_F16_SLABS.into(), "slabs", hint))
    }

    pub(crate) fn check_any_mode(&self) -> Result<(), Error> {
        let KernelShape { extent, sigma } = self.kernel;
        if !(0.5..=8.0).contains(&extent) {
            return Err(Error::parameter("kernel.extent", extent, "0.5 to 8 spacings"));
        }
        if !(1.0..=8.0).contains(&(extent / sigma)) {
            return Err(Error::parameter("kernel.sigma", sigma, "an eighth of the extent to the whole"));
        }
        if !(self.sections.is_power_of_two() && self.sections <= PHASES) {
            return Err(Error::parameter("sections", self.sections, "a power of two up to 256"));
        }
        if self.reconstruction != Reconstruction::Splat {
            self.check_gathered()?;
        } else if self.gradients == Gradients::Kernel {
            return Err(Error::parameter("gradients", self.gradients, "Sheets or Volume where voxels are splatted"));
        }
        if !(0.0..1.0).contains(&self.transmittance_cutoff) {
            return Err(Error::parameter("transmittance_cutoff", self.transmittance_cutoff, "0 to below 1"));
        }
        if let (Aligned::Axis, Some(width)) = (self.aligned, self.slab_width) {
            return Err(Error::parameter(
                "slab_width",
                width,
                "none for slabs along a lattice, which has a plane for each",
            ));
        }
        match self.slab_width {
            Some(width) if !(width.is_finite() && width > 0.0) => {
                Err(Error::parameter("slab_width", width, "a finite number > 0, world units"))
            }
            _ => Ok(()),
        }
    }
}

impl Params {
    /// That nothing is asked of gathered sheets which splats alone have.
    fn check_gathered(&self) -> Result<(), Error> {
        if self.kernel != KernelShape::default() {
            return Err(Error::parameter("kernel", self.kernel, "that of the paper, or splatted sheets"));
        }
        if self.sections != PHASES {
            return Err(Error::parameter("sections", self.sections, "256, or splatted sheets"));
        }
        if self.classify == Classify::Before {
            return Err(Error::parameter("classify", self.classify, "After or Preintegrated, or splatted sheets"));
        }
        if self.aligned != Aligned::View {
            return Err(Error::parameter("aligned", self.aligned, "View, or splatted sheets"));
        }
        if self.accumulation == Accumulation::F16 {
            return Err(Error::parameter("accumulation", self.accumulation, "F32, or splatted sheets"));
        }
        Ok(())
    }
}

impl Default for Params {
    fn default() -> Self {
        Self {
            slab_width: None,
            reconstruction: Reconstruction::default(),
            kernel: KernelShape::default(),
            sections: PHASES,
            accumulation: Accumulation::F32,
            gradients: Gradients::default(),
            lighting: Lighting::default(),
            classify: Classify::default(),
            aligned: Aligned::default(),
            transmittance_cutoff: 1e-3,
            limits: Limits::default(),
        }
    }
}
