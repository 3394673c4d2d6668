//! How to render, checked: the technique and the knobs of each.

use crate::{LayerChoice, SwitchedEffect};
use splat_core::{Accumulation, Direction};

/// How to render.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderSettings {
    /// The technique.
    pub technique: Technique,
    /// The techniques that the plan compared for objects whose technique the scene leaves open; `None` where it leaves none open.
    pub choice: Option<Vec<ComparedTechnique>>,
    /// Samples along each side of a pixel, 1 to 8.
    pub antialias: u32,
    /// The values that the scene states; the plan chooses those that it leaves open.
    pub stated: Stated,
    /// How much any pixel of the displayed picture may change by what is not simulated, in (0, 1].
    pub tolerance: f64,
    /// Exposure of the displayed picture: radiance is multiplied by 2^exposure.
    pub exposure: f64,
    /// Ranges into which the depths are cut that several techniques share.
    pub depth_ranges: u32,
    /// Images to keep.
    pub layers: LayerChoice,
    /// Effects that the scene switches on or off; the plan decides about all others.
    pub effects: Vec<SwitchedEffect>,
    /// Seed of everything random.
    pub seed: u64,
    /// Share of the splats that are drawn, in (0, 1]; see [`splat_core::Cloud::fewer`].
    pub splat_share: f64,
    /// Most splats that the scene may become; more is a resource error.
    pub max_points: Option<u64>,
    /// What the picture is to keep to, where settings may give way for it.
    pub goal: Goal,
    /// Shadow maps, which all techniques take their light from.
    pub shadow: ShadowSettings,
    /// Settings of the `points` technique.
    pub points: PointsSettings,
    /// Settings of the `particles` technique.
    pub particles: ParticlesSettings,
    /// Settings of the `sheets` technique.
    pub sheets: SheetsSettings,
    /// Settings of the `surfels` technique.
    pub surfels: SurfelsSettings,
}

/// A technique that the plan compared with others.
#[derive(Debug, Clone, PartialEq)]
pub struct ComparedTechnique {
    /// Name of the object that it would draw by itself; `None` where it would draw all objects that the scene leaves to the plan.
    pub object: Option<String>,
    /// The technique or techniques in words, such as `sheets`.
    pub drawn_by: String,
    /// The greatest change of a displayed pixel (0 to 1) that it errs by, about; infinite where it is not known.
    pub displayed_error: f64,
    /// Seconds of one core by the built-in figures, counted before anything is converted: objects share passes, so their sum may be more than a picture takes.
    pub seconds: f64,
    /// Whether the plan took it.
    pub is_taken: bool,
    /// Why it was taken, or was not.
    pub reason: String,
}

/// Whether a scene states the values which it may leave to the plan by `"auto"`, the default.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stated {
    /// [`RenderSettings::antialias`].
    pub antialias: bool,
    /// [`PointsSettings::exact`].
    pub exact: bool,
    /// [`PointsSettings::accumulation`].
    pub accumulation_of_points: bool,
    /// [`SheetsSettings::accumulation`].
    pub accumulation_of_sheets: bool,
}

/// A key that is written in the table of a technique.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TechniqueKey {
    /// The technique whose table it is in.
    pub technique: Technique,
    /// The key with its tables, such as `render.sheets.slicing`.
    pub key: String,
}

/// What a picture is to keep to: settings give way as far as they have to, or as far as they may. `organza::render_within` draws so;
/// drawing itself knows nothing of it.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Goal {
    /// Most milliseconds from files read to picture finished, 1 to 86,400,000, a day.
    pub budget_ms: Option<u64>,
    /// Largest root mean square error of the displayed picture against the one with the scene's own settings, in (0, 1].
    pub max_rmse: Option<f64>,
    /// Largest mean FLIP against that picture, in (0, 1].
    pub max_flip: Option<f64>,
}

impl Goal {
    /// Most milliseconds that a budget may have: a day.
    pub const MOST_MS: u64 = 86_400_000;

    /// Its keys in `[render]`.
    pub const KEYS: [&'static str; 3] = ["budget_ms", "max_rmse", "max_flip"];

    /// Whether it limits anything.
    pub const fn is_any(&self) -> bool {
        self.budget_ms.is_some() || self.max_rmse.is_some() || self.max_flip.is_some()
    }
}

/// What draws the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Technique {
    /// The planner chooses.
    #[default]
    Auto,
    /// Rendering-oriented points (Gunjee 2007).
    Points,
    /// Opaque particles, averaged over many sets (Tanaka 2012).
    Particles,
    /// Volumes in slabs across the view, classified after reconstruction (Neophytou and Mueller 2005).
    Sheets,
    /// Discs of surfaces, blended before layers are (Zhang and Pajarola 2007).
    Surfels,
    /// Every fragment of every pixel, sorted, in f64: exact and slow.
    Reference,
}

impl Technique {
    /// All that can be asked for.
    pub const ALL: [Self; 6] =
        [Self::Auto, Self::Points, Self::Particles, Self::Sheets, Self::Surfels, Self::Reference];

    /// As scenes and reports name it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Points => "points",
            Self::Particles => "particles",
            Self::Sheets => "sheets",
            Self::Surfels => "surfels",
            Self::Reference => "reference",
        }
    }

    /// Layers that it fills in a picture that it draws alone, beside those that every technique fills. A scene that asks any
    /// other for them is refused where it does.
    pub const fn own_layers(self) -> &'static [&'static str] {
        match self {
            Self::Particles => &["std_error"],
            Self::Auto | Self::Points | Self::Sheets | Self::Surfels | Self::Reference => &[],
        }
    }
}

/// Settings of the `particles` technique.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParticlesSettings {
    /// Most sets of particles that are averaged, ≥ 2 (Tanaka 2012: repeat level L_R).
    pub repeat_level: u32,
    /// Root mean square of the pixels' standard errors of luminance at which enough sets are averaged, > 0.
    pub target_error: Option<f64>,
    /// How implicit surfaces are sampled.
    pub surface_sampler: SurfaceSampler,
    /// How media are sampled.
    pub volume_sampler: VolumeSampler,
}

/// Settings of the `sheets` technique.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SheetsSettings {
    /// What slabs lie across.
    pub slicing: Slicing,
    /// Whether the scene leaves to the plan what slabs lie across; until the plan decides, they lie across the view.
    pub may_slice: bool,
    /// Whether the scene leaves to the plan how often media scatter light; until the plan decides, they scatter it once.
    pub may_scatter: bool,
    /// When values become colours; left to the plan in half-vector slicing, which classifies after reconstruction.
    pub classify: Classify,
    /// What slabs lie along; the view in half-vector slicing. Slabs along a lattice take parallel rays and no width.
    pub aligned: Aligned,
    /// Width of a slab, world units; `None` takes the least step of the volumes across the slabs.
    pub slab_width: Option<f64>,
    /// How slabs get their values.
    pub reconstruction: Reconstruction,
    /// The kernel of gathered slabs.
    pub kernel: SheetKernel,
    /// Radius of a voxel's kernel, steps of its lattice, in [0.5, 8].
    pub kernel_extent: f64,
    /// Standard deviation of the kernel, steps of the lattice, in [extent/8, extent].
    pub kernel_sigma: f64,
    /// Sections of the kernel in a slab's width, the places within a slab where it may begin: a power of two up to 256.
    pub kernel_sections: u32,
    /// Precision of the sums of voxels in a slab and of slabs in a pixel; that of half precision takes at most 2048 slabs.
    pub accumulation: Accumulation,
    /// Where normals come from.
    pub gradients: SheetGradients,
    /// A pixel is finished when its transmittance falls below this, in [0, 1).
    pub transmittance_cutoff: f64,
}

impl SheetsSettings {
    /// These settings with slabs across half vectors, which carry light themselves; `None` where the scene states otherwise.
    #[must_use]
    pub fn carrying_light(&self) -> Option<Self> {
        let mut settings = *self;
        // Half vectors know neither of the other choices.
        let is_free = matches!(self.classify, Classify::Auto | Classify::After) && self.aligned == Aligned::View;
        if self.may_slice && is_free {
            settings.slicing = Slicing::HALF_VECTOR;
        }
        matches!(settings.slicing, Slicing::HalfVector { .. }).then_some(settings)
    }

    /// These settings with light that is scattered again and again, forward and back; `None` where the scene states otherwise.
    #[must_use]
    pub fn scattering_again(&self) -> Option<Self> {
        let mut settings = self.carrying_light()?;
        let Slicing::HalfVector { scattering, .. } = &mut settings.slicing else { return None };
        if scattering.is_none() && self.may_scatter {
            *scattering = Some(Scattering::FORWARD_AND_BACK);
        }
        scattering.is_some().then_some(settings)
    }

    /// Has light scattered once only.
    pub(crate) const fn scatter_once(&mut self) {
        if let Slicing::HalfVector { scattering, .. } = &mut self.slicing {
            *scattering = None;
        }
    }

    /// How light is scattered more than once, where it is.
    pub const fn scattering(&self) -> Option<&Scattering> {
        match &self.slicing {
            Slicing::HalfVector { scattering: Some(scattering), .. } => Some(scattering),
            _ => None,
        }
    }
}

/// Settings of the `surfels` technique.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfelsSettings {
    /// Radius within which a disc is blended, over its cut-off radius, in [0.45, 1].
    pub disc_scale: f64,
    /// ε: planes of discs that lie nearer to one another than this share of their radius are one layer; in [2⁻¹⁰, 4].
    pub gap: f64,
    /// A pixel is finished when its transmittance falls below this, in [0, 1).
    pub transmittance_cutoff: f64,
    /// Where surfaces bend rays.
    pub bending: Bending,
    /// Whether opaque surfaces are seen along bent rays; else straight on.
    pub bent_behind: bool,
    /// How the discs of a pixel become layers.
    pub layers: SurfelLayers,
    /// Whether light falls on what was averaged, once a layer; else on each disc, before.
    pub lights_pixels: bool,
    /// How opaque discs are drawn.
    pub opaque: OpaqueSurfels,
}

/// How often opaque discs are walked over (Zhang and Pajarola 2007, sections 3.1 and 5.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum OpaqueSurfels {
    /// For what they hide, and for what is seen.
    TwoPass,
    /// Once, into an image of each group.
    OnePass {
        /// The groups; neither coverage nor steps of depth play a part.
        groups: SurfelGroups,
        /// Whether of two discs in one step of depth the one is kept whose centre is nearer (Eq. 14).
        voronoi: bool,
    },
}

impl OpaqueSurfels {
    /// The groups, where there are some.
    pub const fn groups(&self) -> Option<&SurfelGroups> {
        match self {
            Self::TwoPass => None,
            Self::OnePass { groups, .. } => Some(groups),
        }
    }
}

/// How the discs of a pixel become layers (Zhang and Pajarola 2007, section 5.2).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SurfelLayers {
    /// Told apart by gaps in depth, all of them.
    Gaps,
    /// The same for so many nearest layers, 1 to 1024: depth peeling.
    Peeled(u32),
    /// Algorithm 1: in each group discs are composited, one a step of depth; the images of all groups are averaged.
    Algorithm1(SurfelGroups),
    /// Algorithm 2: the nearest layer is averaged by weight, before the rest as Algorithm 1 has it.
    Algorithm2(SurfelGroups),
}

impl SurfelLayers {
    /// The groups of the discs, where the mode has some.
    pub const fn groups(&self) -> Option<&SurfelGroups> {
        match self {
            Self::Gaps | Self::Peeled(_) => None,
            Self::Algorithm1(groups) | Self::Algorithm2(groups) => Some(groups),
        }
    }

    /// The same.
    pub const fn groups_mut(&mut self) -> Option<&mut SurfelGroups> {
        match self {
            Self::Gaps | Self::Peeled(_) => None,
            Self::Algorithm1(groups) | Self::Algorithm2(groups) => Some(groups),
        }
    }
}

/// Groups of discs that hardly overlap (Zhang and Pajarola 2007, section 4).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfelGroups {
    /// Number of groups K, 1 to 256; the most of them by [`Grouping::Minimum`].
    pub count: u32,
    /// How they are found.
    pub grouping: Grouping,
    /// How each comes to cover the surface.
    pub coverage: Coverage,
    /// n of Eq. 10, ≥ 1; `None` for steps as long as ε.
    pub depth_steps: Option<u32>,
}

impl SurfelGroups {
    /// Number and method in words; whether the animation changes the shape of an object.
    pub fn describe(&self, deforms: bool) -> String {
        let (most, how) = match self.grouping {
            Grouping::Auto if deforms => ("", "weighted colouring, where the animation changes a shape by hashing"),
            Grouping::Auto | Grouping::Weighted => ("", "weighted colouring"),
            Grouping::Minimum { .. } => ("at most ", "minimum colouring"),
            Grouping::Hash(_) => ("", "hashing"),
        };
        format!("{most}{} groups by {how}", self.count)
    }
}

impl Default for SurfelGroups {
    /// Four groups, which the paper finds enough (section 6.3).
    fn default() -> Self {
        Self { count: 4, grouping: Grouping::Auto, coverage: Coverage::Auto, depth_steps: None }
    }
}

/// How groups of discs are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Grouping {
    /// Weighted colouring; a hash table for an object whose shape the animation changes.
    Auto,
    /// As few groups as are found (MGC).
    Minimum {
        /// c: radii are so much shorter when overlaps are found, in (0, 1].
        factor: f64,
    },
    /// Weighted colouring (WGC).
    Weighted,
    /// By a hash table.
    Hash(Collisions),
}

/// What is done with discs that a hash table puts into one cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Collisions {
    /// Nothing.
    Keep,
    /// Each takes the group whose discs overlap it least.
    Resolve,
    /// The same for discs within a distance of the eye, world units.
    Near(f64),
}

/// How each group of discs comes to cover the surface (Zhang and Pajarola 2007, section 4.4.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Coverage {
    /// By discs of other groups; by a bound on radii where a hash table makes groups.
    Auto,
    /// It does not.
    Partial,
    /// Discs of other groups are added.
    Duplicates,
    /// Radii are enlarged (Eqs. 11-13).
    Enlarged,
    /// Radii are enlarged by the bound of the hash table (Figure 10).
    Bound,
}

/// Where surfaces bend rays (Zhang and Pajarola 2007, section 5.2.3).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bending {
    /// At every surface that the bent ray meets.
    Traced,
    /// At the nearest, by the power of the index that layers are counted for (Eqs. 15 and 16).
    Power,
    /// At the nearest, once.
    Nearest,
}

/// When values become colours.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Classify {
    /// As the plan chooses.
    Auto,
    /// When they are reconstructed, the value in the middle of a slab.
    After,
    /// When they are reconstructed, all values that a ray meets in a slab.
    Preintegrated,
    /// At the voxels, before they are splatted.
    Before,
}

/// How slabs get their values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reconstruction {
    /// As the plan chooses.
    Auto,
    /// Each pixel reads the lattice.
    Gather,
    /// Each voxel writes into slabs.
    Splat,
}

/// Where the normals of volumes come from that reflect about their gradients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SheetGradients {
    /// As slabs get their values: of the kernel where they are gathered, of sheets where they are splatted.
    Auto,
    /// Differences of neighbouring pixels and slabs.
    Sheets,
    /// Central differences at voxels, interpolated.
    Volume,
    /// The derivative of the field that gathered slabs read.
    Kernel,
}

/// The kernel of gathered slabs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SheetKernel {
    /// The kernel that is splatted by default.
    Gaussian,
    /// Eight voxels, linearly.
    Linear,
}

/// What slabs across the view lie along.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Aligned {
    /// The image.
    View,
    /// The planes of the lattice that lie most nearly across the view (Westover 1990).
    Axis,
}

/// What the slabs of sheets lie across.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Slicing {
    /// The view's axis; light comes through shadow maps (Neophytou and Mueller 2005).
    View,
    /// The bisector of light and view: each light comes through the same slabs (Zhang and Crawfis, section 4).
    HalfVector {
        /// Pixels of a light's buffer per least step of a lattice, in [0.1, 16].
        light_pixels: f64,
        /// Most pixels of a light's buffer along a side, 16 to 8192.
        most_light_pixels: u32,
        /// How often light is scattered; `None` for once.
        scattering: Option<Scattering>,
        /// How a light with an extent is carried.
        soft_shadows: SoftShadows,
    },
}

impl Slicing {
    /// Slabs across half vectors as they are where a scene states no more of them.
    pub const HALF_VECTOR: Self = Self::HalfVector {
        light_pixels: 1.5,
        most_light_pixels: 2048,
        scattering: None,
        soft_shadows: SoftShadows::Points,
    };
}

/// How half-vector sheets carry the light of a sphere, a disk or a rectangle.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub enum SoftShadows {
    /// A sweep for each of its points.
    #[default]
    Points,
    /// One sweep, in which each slab is seen from all of its points (Zhang and Crawfis, section 5).
    OneSweep,
}

/// Light that media scatter more than once (Zhang and Crawfis, section 3).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scattering {
    /// Whether light that is scattered back is followed too.
    pub back: bool,
    /// Half angle of the cone that light spreads into where it is scattered ahead, radians, in [0, π/2); `None` for that of the media.
    pub cone: Option<f64>,
    /// Voxels for each cell of scattered light, 1 to 2²⁰.
    pub voxels_per_cell: u32,
}

impl Scattering {
    /// Light that goes on forward and back, as it does where a scene states no more of it.
    pub const FORWARD_AND_BACK: Self = Self { back: true, cone: None, voxels_per_cell: 32 };
}

/// How the particles of implicit surfaces are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SurfaceSampler {
    /// By lines, or on triangles where the field's bounds are too loose for lines to be fast.
    Auto,
    /// Where random lines meet the surface.
    Lines,
    /// On the triangles of a mesh, as fine as the object's splats.
    Triangles,
    /// Places of a Brownian motion on the surface (Tanaka 2012, section 4).
    Brownian {
        /// √(2Δt), over the longest side of the surface's box, > 0.
        step: f64,
    },
}

/// How the particles of media are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VolumeSampler {
    /// By a field of extinction that has a bound, and else by the cells of a lattice.
    Auto,
    /// Cell by cell of a lattice.
    Cells,
    /// Chains of places on a lattice, by the Metropolis method.
    Metropolis {
        /// Steps from one particle to the next, ≥ 1.
        stride: u32,
    },
}

/// Settings of the `points` technique.
#[derive(Debug, Clone, PartialEq)]
pub struct PointsSettings {
    /// Thickness ε of a slice, world units; `None` takes the radius of the smallest splats.
    pub slice_thickness: Option<f64>,
    /// Whether splats are in exact order inside slices too.
    pub exact: bool,
    /// Which end of the view is composited first.
    pub direction: Direction,
    /// Composite only so many non-empty slices.
    pub first_slices: Option<u64>,
    /// A pixel is finished when its transmittance falls below this, in [0, 1).
    pub transmittance_cutoff: f64,
    /// Whether footprints are widened to a pixel so that small splats do not flicker.
    pub resampling_filter: bool,
    /// Precision of the running sums of a pixel.
    pub accumulation: Accumulation,
}

/// Settings of the translucent shadow maps.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowSettings {
    /// How directions become cells.
    pub mapping: ShadowMapping,
    /// Cells along one side of the table, a power of two or not; `None` is chosen from splat sizes.
    pub cells: Option<u32>,
    /// Absorbance behind which light counts as gone; `None` follows from the tolerance.
    pub absorbance_cut: Option<f64>,
}

/// How directions from a light become cells of its table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ShadowMapping {
    /// Octahedral for points, planar for directional and spot lights.
    #[default]
    Auto,
    /// Equal-area octahedral.
    Octahedral,
    /// Polar angle and azimuth, as in the paper.
    Polar,
}
