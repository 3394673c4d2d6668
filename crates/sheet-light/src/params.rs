//! What the caller chooses: slab width, kernel, when a pixel is done, memory.

use crate::Error;
use splat_core::Limits;

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

/// When values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Classify {
    /// When they are reconstructed, so that zooms show no blur (Mueller, Möller, Crawfis 1999; the paper).
    #[default]
    After,
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

/// Parameters of image-aligned sheets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Params {
    /// Slab width Δs, world units, > 0; `None` for the least spacing of the volumes along the view.
    pub slab_width: Option<f64>,
    /// The kernel.
    pub kernel: KernelShape,
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

    pub(crate) fn check_any_mode(&self) -> Result<(), Error> {
        let KernelShape { extent, sigma } = self.kernel;
        if !(0.5..=8.0).contains(&extent) {
            return Err(Error::parameter("kernel.extent", extent, "0.5 to 8 spacings"));
        }
        if !(1.0..=8.0).contains(&(extent / sigma)) {
            return Err(Error::parameter("kernel.sigma", sigma, "an eighth of the extent to the whole"));
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

impl Default for Params {
    fn default() -> Self {
        Self {
            slab_width: None,
            kernel: KernelShape::default(),
            classify: Classify::default(),
            aligned: Aligned::default(),
            transmittance_cutoff: 1e-3,
            limits: Limits::default(),
        }
    }
}
