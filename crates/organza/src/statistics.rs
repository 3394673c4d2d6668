//! Statistics of a loaded scene, from which the plan is made.

use crate::form::PlannedObject;
use crate::scene::{EffectKind, SceneLight, SurfaceSampler, SwitchedEffect, Technique, VolumeSampler};
use convert::cost::Prediction;
use splat_core::DAabb;
use splat_core::shade::Census;

/// The planner's facts of a light.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LightStatistics {
    /// Its label in effects.
    pub label: String,
    /// Whether it may cast shadows.
    pub casts_shadows: bool,
    /// Whether it has no intensity.
    pub is_dark: bool,
    /// Whether it has a size.
    pub is_extended: bool,
    /// Number of point lights that stand for it, each with a shadow map.
    pub points: usize,
    /// Whether the scene switches the light on or off.
    pub is_on: Option<bool>,
    /// Whether the scene switches its shadow on or off.
    pub has_shadow: Option<bool>,
    /// The most radiance that anything can send of its light, in the channel that has most, W·m⁻²·sr⁻¹; infinite where none is known.
    pub radiance: f64,
    /// The greatest share of its light that a shadow can take from anything that is seen, 0 to 1.
    pub opacity: f64,
}

/// The planner's facts of a medium that scatters light by a phase function.
#[derive(Debug, Clone, PartialEq)]
pub struct MediumStatistics {
    /// Name of its object.
    pub object: String,
    /// Greatest share of the light that it takes which it scatters, in the channel that has most.
    pub albedo: f64,
    /// An optical depth that no line through it exceeds.
    pub optical_depth: f64,
}

/// Facts of a medium that scatters light, before anything is converted. Lengths are in world units of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct MediumFacts {
    /// Rank of its object in the scene.
    pub object: usize,
    /// Share of the light that it takes which it scatters by a phase function, in the channel that has most, mean over its extinction; 0 to 1, and 0
    /// where nothing lights it.
    pub albedo: f64,
    /// Mean cosine of scattering, −1 to 1.
    pub asymmetry: f64,
    /// Greatest optical depth of the lines along its axes that were looked at.
    pub optical_depth: f64,
    /// Greatest optical depth of the distance between two of its splats.
    pub spacing_optical_depth: f64,
    /// Distance between its splats.
    pub spacing: f64,
    /// Splats that it becomes, about.
    pub splats: f64,
    /// A box around it.
    pub bounds: DAabb,
    /// Length of the camera's rays along which it shows, up to where next to nothing passes it: mean over the picture.
    pub shown_length: f64,
    /// Whether it lies on a lattice, so that slabs reconstruct it.
    pub is_lattice: bool,
    /// Irradiance in its middle without shadows, all lights together, in the channel that has most, W/m².
    pub irradiance: f64,
    /// Share of that from lights whose shadows it may receive and that lie outside of it: light that slabs can carry; 0 to 1.
    pub outside_share: f64,
}

/// Facts of a mesh, before anything is converted.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFacts {
    /// Rank of its object in the scene.
    pub object: usize,
    /// Whether some of it is translucent, by its material or by opacities of its file.
    pub is_translucent: bool,
    /// Whether nothing about it is seen on discs alone: a footprint, a field on its surface.
    pub stays_triangles: bool,
    /// Number of discs after conversion, about.
    pub splats: f64,
    /// The greatest change of the transmittance of one crossing with the logarithm of its optical depth, 0 to 1/e; 0 for what is opaque.
    pub sensitivity: f64,
    /// Sine of the angle between neighbouring triangles, root mean square, 0 to 1; 0 where the sensitivity is.
    pub bend: f64,
}

/// Facts of the objects' data, before anything is converted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SourceFacts {
    /// Facts of media in view, in the order of the scene.
    pub media: Vec<MediumFacts>,
    /// Facts of meshes, in the order of the scene.
    pub meshes: Vec<MeshFacts>,
    /// World-space box around what may be translucent of each object, by its rank in the scene, empty where nothing is; `None` for an invisible object, where
    /// no box is known, and for every object of a scene without a translucent mesh.
    pub boxes: Vec<Option<DAabb>>,
}

impl SourceFacts {
    /// Those of the medium that an object is, by its rank in the scene.
    pub(crate) fn medium(&self, object: usize) -> Option<&MediumFacts> {
        self.media.iter().find(|medium| medium.object == object)
    }

    /// Those of the mesh that an object is, by its rank in the scene.
    pub(crate) fn mesh(&self, object: usize) -> Option<&MeshFacts> {
        self.meshes.iter().find(|mesh| mesh.object == object)
    }
}

/// The planner's facts of the effects of a visible object, once it is loaded.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectFacts {
    /// Its name.
    pub name: String,
    /// The place of its material in [`Loaded::materials`](crate::Loaded::materials), where it has one alone, and no object that has several has it.
    pub material: Option<usize>,
    /// The kinds of effects that it is a cause of, and that its technique shows.
    pub causes: Vec<EffectKind>,
    /// Whether what it bounds absorbs red, green and blue unequally.
    pub absorbs_colors: bool,
    /// The greatest optical depth that a ray has in what it bounds, in the channel that has most.
    pub absorption: f64,
    /// By how much the extinction of a channel differs from the mean of all, at most, as a share of the largest.
    pub color_spread: f64,
    /// The most radiance that it sends of lights and ambient radiance, W·m⁻²·sr⁻¹; infinite where none is known.
    pub radiance: f64,
    /// The most radiance that it shows: of lights, of ambient radiance, and what it has without light, W·m⁻²·sr⁻¹; infinite where none is known.
    pub shown: f64,
    /// Whether some of it may be in view.
    pub is_in_view: bool,
    /// The greatest optical depth that it has along a view ray, in the channel that has most; infinite where none is known.
    pub view_depth: f64,
    /// For each light, the greatest optical depth of the object on the light's way to anything visible; infinite if no bound is known.
    pub light_depths: Vec<f64>,
}

impl ObjectFacts {
    /// Whether it is a cause of this kind of effects, and channels differ by it.
    pub(crate) fn has_colored(&self, kind: EffectKind) -> bool {
        self.causes.contains(&kind) && (kind != EffectKind::Absorption || self.absorbs_colors)
    }
}

/// The kind of an object's data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ObjectData {
    /// Raw points.
    Points,
    /// Points that are 3D Gaussians.
    Gaussians,
    /// Triangles.
    Triangles,
    /// The zero set of a field.
    Surface {
        /// Cells of a lattice that may hold the surface by the field's bound, over its area in cells: 2 to 3 for a tight bound; infinite without a
        /// bound, 0 where a first look finds no surface, and for measured data, whose fields have tight bounds.
        looseness: f64,
        /// Whether it is the isosurface of a volume, and nothing clips it.
        on_lattice: bool,
        /// What the scene asks for.
        by: SurfaceSampler,
    },
    /// Extinction on a lattice.
    Volume,
    /// A field of extinction.
    Density {
        /// Whether it has a bound everywhere.
        bounded: bool,
    },
}

/// The planner's facts of a visible object before anything is converted.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectStatistics {
    /// Its name.
    pub name: String,
    /// The kind of its data.
    pub data: ObjectData,
    /// Whether it is an opaque surface.
    pub opaque: bool,
    /// Whether it is a mesh of which its vertices' opacities leave parts opaque.
    pub is_partly_opaque: bool,
    /// Whether the gradients of its values shade it or fill a layer.
    pub by_gradient: bool,
    /// Whether objects and materials leave its discs the default footprint, and it shows no field.
    pub is_plain: bool,
    /// The sampler that the scene states for media.
    pub volumes_by: VolumeSampler,
    /// Whether it could cast a shadow.
    pub casts: bool,
    /// Whether it could receive a shadow.
    pub receives: bool,
}

/// The conversion of a splat, by the time that it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Conversion {
    /// Of anything else: a piece of a surface, a voxel, a Gaussian.
    Plain,
    /// Of a piece of the zero set of a field, which is found by evaluating it.
    Field,
    /// Of a raw point that becomes a disc, by its neighbours.
    SurfacePoint,
    /// Of a raw point that becomes a medium, by its neighbours.
    MatterPoint,
}

/// Splats of one object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SplatCount {
    /// Name of the object.
    pub object: String,
    /// Splats counted from the input before the conversion.
    pub predicted: u64,
    /// Whether that is exact rather than an estimate.
    pub exact: bool,
    /// Splats made.
    pub made: u64,
    /// The conversion of each splat.
    pub conversion: Conversion,
}

impl SplatCount {
    pub(crate) fn predicted(object: &str, prediction: &Prediction, conversion: Conversion) -> Self {
        Self {
            object: object.to_owned(),
            predicted: prediction.splats,
            exact: prediction.is_exact,
            made: 0,
            conversion,
        }
    }
}

/// The planner's facts of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Statistics {
    /// The planned form of each visible object.
    pub planned: Vec<PlannedObject>,
    /// Techniques that draw, in the order of their table.
    pub techniques: Vec<Technique>,
    /// By technique: the translucent splats that it draws or samples, and the objects, also opaque ones, that it draws from their native
    /// data.
    pub translucent_by: Vec<(Technique, [u64; 2])>,
    /// The splats, translucent ones as far as they are drawn; and among those that cast and receive shadows whole objects that have no splats.
    pub counts: Census,
    /// Facts of the effects of each visible object.
    pub objects: Vec<ObjectFacts>,
    /// Whether the effects of objects are not left out, whatever their bounds.
    pub objects_stay: bool,
    /// Effects that the scene switches.
    pub switched: Vec<SwitchedEffect>,
    /// The most radiance that anything shows, the background among it, in the channel that has most, W·m⁻²·sr⁻¹; infinite where none is known.
    pub brightest: f64,
    /// The greatest share of the light that comes to a surface which it sends on, in the channel that has most; more than 1 where peaks are bright.
    pub reflectance: f64,
    /// The part of the tolerance that effects have which are left out of these statistics already.
    pub spent: f64,
    /// Whether splats are lit as they are drawn, not before.
    pub lit_as_drawn: bool,
    /// Lights, whole.
    pub lights: Vec<LightStatistics>,
    /// Media that scatter light.
    pub media: Vec<MediumStatistics>,
    /// Whether the scene asks for light that is scattered again and again, of techniques that have it.
    pub scatters_again: bool,
    /// Requested layers beside beauty and alpha.
    pub layers: Vec<String>,
    /// Largest change of a displayed pixel that may be left out.
    pub tolerance: f64,
    /// Exposure of the displayed picture, stops.
    pub exposure: f64,
}

impl Statistics {
    /// Number of objects that are drawn from their native data.
    pub fn own(&self) -> u64 {
        self.planned.iter().filter(|o| o.form.is_own()).count() as u64
    }

    /// Adds the planned forms of the objects, each with its `made` splats. Splats of an object that is drawn from its native
    /// data are not drawn. Such an object may receive shadows even without splats.
    pub fn with_objects(mut self, objects: &[ObjectStatistics], planned: &[PlannedObject], made: &[u64]) -> Self {
        self.planned = planned.to_vec();
        for ((object, planned), made) in objects.iter().zip(planned).zip(made) {
            let is_own = planned.form.is_own();
            if is_own {
                let drawn = if object.opaque { &mut self.counts.opaque } else { &mut self.counts.translucent };
                *drawn = drawn.saturating_sub(*made);
                self.counts.receivers += u64::from(*made == 0 && object.receives);
            }
            if !object.opaque || is_own {
                let counts = if is_own { [0, 1] } else { [*made, 0] };
                self.add(planned.technique, counts);
            }
        }
        self
    }

    /// Takes in an object that casts shadows without splats, of which no ray has more optical depth.
    pub fn add_caster(&mut self, optical_depth: f64) {
        self.counts.casters += 1;
        self.counts.caster_optical_depth += optical_depth;
    }

    fn add(&mut self, technique: Technique, counts: [u64; 2]) {
        match self.translucent_by.iter_mut().find(|(t, _)| *t == technique) {
            Some((_, sum)) => (0..2).for_each(|k| sum[k] += counts[k]),
            None => self.translucent_by.push((technique, counts)),
        }
    }

    /// Whether a technique has translucent splats to draw, or nothing that would be there in their place.
    pub fn may_have_splats(&self, technique: Technique) -> bool {
        let counts = self.translucent_by.iter().find(|(t, _)| *t == technique).map(|t| t.1);
        counts.is_none_or(|[splats, natives]| splats > 0 || natives == 0)
    }

    /// Describes the translucent splats and the native objects that a technique draws, in words; `None` for nothing.
    pub fn translucent_of(&self, technique: Technique) -> Option<String> {
        let [splats, natives] = self.translucent_by.iter().find(|(t, _)| *t == technique)?.1;
        let data = format!("data of {natives} object{}", if natives == 1 { "" } else { "s" });
        match (splats, natives) {
            (0, 0) => None,
            (n, 0) => Some(format!("{n} translucent splats")),
            (0, _) => Some(data),
            (n, _) => Some(format!("{n} translucent splats and {data}")),
        }
    }
}

impl LightStatistics {
    /// Statistics of a light, of whose radiance and shadows nothing is known, and that some effects of a scene may switch.
    pub fn of_light(light: &SceneLight, switched: &[SwitchedEffect]) -> Self {
        let switch = |kind| SwitchedEffect::find(switched, kind, &light.label);
        Self {
            label: light.label.clone(),
            casts_shadows: light.shadow,
            is_dark: light.light.intensity.iter().all(|i| *i == 0.0),
            is_extended: light.light.shape.is_extended(),
            points: light.count(),
            is_on: switch(EffectKind::Light),
            has_shadow: switch(EffectKind::Shadow),
            radiance: f64::INFINITY,
            opacity: 1.0,
        }
    }

    /// Whether it may get shadow maps.
    pub fn may_shadow(&self) -> bool {
        self.casts_shadows && !self.is_dark && self.is_on != Some(false) && self.has_shadow != Some(false)
    }
}
