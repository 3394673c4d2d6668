//! Parameters of shadow maps, shared by the plan, which predicts their size, and the drawing.

mod casters;
mod hiding;
mod probe;

use crate::Error;
use crate::load::Loaded;
use crate::load::by_object::by_object;
use crate::scene::{LightPoint, RenderSettings, ShadowMapping};
use splat_core::shade::joint::{HIDDEN, MediumSpacing};
use splat_core::{Camera, Light, LightShape, Limits, LitBounds, Object};
use tsm::{Deposits, Params};

pub(crate) use casters::{Shadowing, casting};
pub(crate) use hiding::{Hiding, View, casters_by_light, hiding};
pub(crate) use probe::Probe;

/// Share of the tolerance that the ends of lists may take, of all lights together. Absorbance grows with its logarithm only, so
/// a small share costs little.
pub(crate) const CUT_SHARE: f64 = 1.0 / 16.0;
/// Largest slope of a displayed value by radiance, at black: sRGB's.
pub(crate) const DISPLAY_SLOPE: f64 = 12.92;

/// Optical depth of a spacing that a scene needs the eye's map for: up to it light and view at 60° send 1.5 % too little by the middles of splats,
/// and at right angles a fifth of a per cent.
pub(crate) const SEEN: f32 = 0.125;
/// The eye's map, in messages.
pub(crate) const EYE: &str = "the eye";
/// Entries of a shadow map up to which a preview has the cells that are asked for: tens of milliseconds.
const QUICK: f64 = 2e6;
/// Times the entries of the automatic resolution from which on cells that are asked for count as costly.
pub(crate) const TIMES: f64 = 4.0;
/// Straight optical depths of a thick cell that lists go on for: as many as it has along the most slanted light.
const CELLS_BEHIND: f64 = 5.0;

/// The part of a picture for which the cells of its shadow maps are too coarse.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Coarse {
    /// Share of what splats show in the picture whose displayed light is off by more than the tolerance, estimated.
    pub(crate) share: f64,
    /// Cells along the longer side of the table of the light that is off most.
    pub(crate) cells: u32,
    /// Cells along that side by which few splats would be off.
    pub(crate) better_cells: f64,
    /// How that light is called.
    pub(crate) light: String,
    /// Bytes that its table took at its peak.
    pub(crate) bytes: u64,
}

/// The table of one light's shadow map, as it was chosen before any work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowTable {
    /// Its size and work.
    pub predicted: tsm::Prediction,
    /// Cells along a side that its light or `render.shadow` asks for.
    pub cells: Option<u32>,
    /// Whether its light asks for them.
    pub light_states_cells: bool,
    /// Transmittance at which lists stop.
    pub tolerance: f32,
    /// Bytes within which its cells were chosen.
    pub max_bytes: u64,
    /// Size and work by the automatic resolution, where a scene asks for cells; else those of `predicted`.
    pub automatic: tsm::Prediction,
}

impl ShadowTable {
    /// What it is built by, where it and those after it may take so many bytes.
    pub(crate) fn params(&self, settings: &RenderSettings, loaded: &Loaded, left: u64) -> Params {
        shadow_params(settings, loaded, self.cells, self.tolerance, self.max_bytes.min(left))
    }

    /// Takes the automatic resolution where the cells that are asked for would keep a preview waiting. So many lie along a side of what casts shadows,
    /// however short that is: where the ground is hidden, they are many times as fine.
    pub(crate) fn hurry(&mut self) {
        let Self { predicted, automatic, .. } = *self;
        if predicted.entries > QUICK && predicted.entries > TIMES * automatic.entries {
            *self = Self { predicted: automatic, cells: None, light_states_cells: false, ..*self };
        }
    }

    /// Absorbance at which lists stop.
    pub fn absorbance_cut(&self) -> f64 {
        -libm::log(f64::from(self.tolerance))
    }

    /// In words.
    pub(crate) fn describe(&self, light: &str) -> String {
        let tsm::Prediction { size: [columns, rows], limit, entries, .. } = self.predicted;
        let entries = entries as u64;
        let cut = self.absorbance_cut();
        format!("{light}: {columns}x{rows} cells, {limit}, {entries} entries up to an absorbance of {cut:.1}")
    }
}

/// Parameters of a map with so many cells along a side, or as many as it calls for, and with this tolerance, the transmittance at which its lists stop,
/// which may take `max_bytes`.
pub fn shadow_params(
    settings: &RenderSettings,
    loaded: &Loaded,
    cells: Option<u32>,
    tolerance: f32,
    max_bytes: u64,
) -> Params {
    let shadow = &settings.shadow;
    Params {
        mapping: match shadow.mapping {
            ShadowMapping::Auto => tsm::MappingChoice::Auto,
            ShadowMapping::Octahedral => tsm::MappingChoice::Octahedral,
            ShadowMapping::Polar => tsm::MappingChoice::PolarAzimuth,
        },
        resolution: cells.map_or(tsm::Resolution::Auto, tsm::Resolution::Cells),
        tolerance,
        footprints: loaded.footprints.clone(),
        limits: Limits::bytes(max_bytes),
        ..Params::default()
    }
}

/// Parameters of the eye's map. `render.shadow` is about lights: its cells would cost the eye, which is near what it sees, many times more.
pub(crate) fn eye_params(loaded: &Loaded, tolerance: f32, max_bytes: u64) -> Params {
    let footprints = loaded.footprints.clone();
    // It shows which splats are seen, and how steeply depths grow about them: its cells may be coarser than a light's.
    Params { tolerance, footprints, refines_lit: false, limits: Limits::bytes(max_bytes), ..Params::default() }
}

/// Returns the greatest optical depth per spacing in the media of each object.
fn thickest_by_object(loaded: &Loaded) -> Vec<f32> {
    let meet = |thickest: &mut f32, i: usize| *thickest = thickest.max(thickness_of(loaded, i));
    by_object(&loaded.cloud, loaded.objects.len(), &0.0, meet, |thickest, other| *thickest = thickest.max(*other))
}

/// Returns the greatest optical depth per spacing in the scene; 0 if all media are thin.
fn thickest(by_object: &[f32]) -> f64 {
    let thickest = by_object.iter().copied().fold(0.0, f32::max);
    if thickest > SEEN { f64::from(thickest) } else { 0.0 }
}

/// Optical depth of a spacing about a splat, in the channel that has most; 0 of what is no medium.
pub(crate) fn thickness_of(loaded: &Loaded, i: usize) -> f32 {
    let material = &loaded.materials[loaded.cloud.material[i] as usize];
    let spacing = MediumSpacing::of_splat(&loaded.cloud, &loaded.footprints, i);
    spacing.map_or(0.0, |spacing| spacing.optical_depth * material.greatest_extinction())
}

/// The eye as a light: what a map of it has is the transmittance to the viewer.
pub(crate) fn eye(camera: &Camera) -> Light {
    let shape = if camera.is_orthographic() {
        LightShape::Directional { direction: camera.axes[2] }
    } else {
        LightShape::Point { position: camera.position }
    };
    Light { shape, intensity: [1.0; 3] }
}

/// The objects that the eye's map is of: those that are `shown` with media whose spacing is optically thick. What else there is hides a thick cell as
/// a whole.
pub(crate) fn thick_objects(loaded: &Loaded, shown: &[bool]) -> Vec<Object> {
    thicker_than_seen(loaded, &thickest_by_object(loaded), shown)
}

/// Returns all objects. Those cast a shadow which are `shown` and whose `thickness` exceeds [`SEEN`].
fn thicker_than_seen(loaded: &Loaded, thickness: &[f32], shown: &[bool]) -> Vec<Object> {
    let objects = loaded.objects.iter().zip(thickness).zip(shown);
    objects
        .map(|((object, thickness), shown)| Object { casts_shadow: *shown && *thickness > SEEN, ..object.clone() })
        .collect()
}

/// The table of the eye's map, within so many bytes; `None` where all media that receive shadows, are `shown` and are drawn as splats, which `draws`
/// says of each object, are thin.
///
/// # Errors
/// Where the table cannot be chosen.
pub(crate) fn eye_table(
    loaded: &Loaded,
    shown: &[bool],
    draws: &[bool],
    max_bytes: u64,
) -> Result<Option<ShadowTable>, Error> {
    let cloud = &loaded.cloud;
    let thickness = thickest_by_object(loaded);
    let is_lit_within = |object: usize| {
        draws[object] && shown[object] && loaded.objects[object].shadow_coefficient > 0.0 && thickness[object] > SEEN
    };
    if !(0..loaded.objects.len()).any(is_lit_within) {
        return Ok(None);
    }
    let tolerance =
        libm::exp(-f64::from(HIDDEN) - CELLS_BEHIND * thickest(&thickness)).max(f64::from(f32::MIN_POSITIVE)) as f32;
    let params = eye_params(loaded, tolerance, max_bytes);
    let objects = thicker_than_seen(loaded, &thickness, shown);
    let scene = tsm::Scene { cloud, materials: &loaded.materials, objects: &objects };
    let predicted = Deposits::predict(&scene, &eye(&loaded.camera), &params).map_err(|e| shadow_error(EYE, &e))?;
    Ok(Some(ShadowTable {
        predicted,
        cells: None,
        light_states_cells: false,
        tolerance,
        max_bytes,
        automatic: predicted,
    }))
}

/// Transmittance e^(−A_cut) below which the light of one lamp is lost in the picture: its brightest light times that changes no
/// displayed value by more than the lamp's part of the tolerance. Thick cells are lit by what is left behind them, too.
fn tolerance(
    settings: &RenderSettings,
    loaded: &Loaded,
    lit: &LitBounds,
    point: &LightPoint,
    maps: u64,
    thickest: f64,
) -> f32 {
    let of_lights = || {
        let passing =
            loaded.images.slides[point.light_index].as_ref().map_or(1.0, |slide| f64::from(slide.brightest()));
        let brightest = passing * lit.brightest_of(&point.light);
        let gain = DISPLAY_SLOPE * libm::exp2(settings.exposure) * brightest.max(f64::MIN_POSITIVE);
        CUT_SHARE * settings.tolerance / (gain * maps as f64)
    };
    let asked = settings.shadow.absorbance_cut.map(|cut| libm::exp(-cut));
    let behind = libm::exp(-CELLS_BEHIND * thickest);
    (asked.unwrap_or_else(of_lights) * behind).clamp(f64::from(f32::MIN_POSITIVE), 0.5) as f32
}

/// Bytes of shadow maps, which live at once: all finished, and what building one takes beside it. With a half more, for casters that
/// are not spread evenly make more entries than are predicted.
pub(crate) fn bytes<'a>(tables: impl Iterator<Item = &'a ShadowTable>) -> u64 {
    let mut finished = 0u64;
    let mut building = 0;
    for table in tables {
        let tsm::Prediction { bytes, map_bytes, .. } = table.predicted;
        finished = finished.saturating_add(map_bytes);
        building = building.max(bytes - map_bytes);
    }
    let predicted = finished.saturating_add(building);
    predicted.saturating_add(predicted / 2)
}

/// Whether these tables would be chosen again where all may take so many bytes: memory has made none of them coarser, nor would it.
pub(crate) fn fit<'a>(tables: impl Iterator<Item = &'a ShadowTable> + Clone, max_bytes: u64) -> bool {
    tables.clone().all(|table| table.predicted.limit != tsm::Limit::Memory) && bytes(tables) <= max_bytes
}

/// A point of a light, and the objects whose splats cast shadows of it.
pub(crate) type MapRequest<'a> = (&'a LightPoint, &'a [Object]);

/// The table of each map that is wanted, where all together may take so many bytes: as fine as each would be alone,
/// or, where that is too much, within an equal share of it.
///
/// # Errors
/// That of the first point whose table cannot be chosen, with its name.
pub(crate) fn tables(
    settings: &RenderSettings,
    loaded: &Loaded,
    requests: &[Option<MapRequest<'_>>],
    max_bytes: u64,
) -> Result<Vec<Option<ShadowTable>>, Error> {
    let alone = tables_within(settings, loaded, requests, max_bytes)?;
    if bytes(alone.iter().flatten()) <= max_bytes {
        return Ok(alone);
    }
    let maps = alone.iter().flatten().count().max(1) as u64;
    tables_within(settings, loaded, requests, max_bytes / maps * 2 / 3)
}

fn tables_within(
    settings: &RenderSettings,
    loaded: &Loaded,
    requests: &[Option<MapRequest<'_>>],
    max_bytes: u64,
) -> Result<Vec<Option<ShadowTable>>, Error> {
    let maps = requests.iter().flatten().count().max(1) as u64;
    let thickest = thickest(&thickest_by_object(loaded));
    let lit = LitBounds::new(&loaded.cloud);
    let table = |request: &Option<MapRequest<'_>>| {
        let Some((point, objects)) = request else { return Ok(None) };
        let light = &point.light;
        let tolerance = tolerance(settings, loaded, &lit, point, maps, thickest);
        let cells = point.shadow_cells.or(settings.shadow.cells);
        let params = shadow_params(settings, loaded, cells, tolerance, max_bytes);
        let scene = tsm::Scene { cloud: &loaded.cloud, materials: &loaded.materials, objects };
        let predict =
            |params: &Params| Deposits::predict(&scene, light, params).map_err(|e| shadow_error(&point.name(), &e));
        let predicted = predict(&params)?;
        let automatic = match params.resolution {
            tsm::Resolution::Auto => predicted,
            tsm::Resolution::Cells(_) => predict(&Params { resolution: tsm::Resolution::Auto, ..params.clone() })?,
        };
        let light_states_cells = point.shadow_cells.is_some();
        Ok(Some(ShadowTable { predicted, cells, light_states_cells, tolerance, max_bytes, automatic }))
    };
    requests.iter().map(table).collect()
}

/// What went wrong with the map of a light, or a point of one, of this name.
pub(crate) fn shadow_error(light: &str, error: &tsm::Error) -> Error {
    let what = format!("the shadow map of {light}");
    match error {
        tsm::Error::Limit(exceeded) => {
            let hint = "use fewer lights or samples of lights, fewer cells in render.shadow, or a larger --max-memory";
            Error::Limit(exceeded.clone().owned_by(&what, hint))
        }
        tsm::Error::Core(splat_core::Error::Cancelled) => Error::Cancelled,
        other => Error::input(what, other.to_string(), ""),
    }
}
