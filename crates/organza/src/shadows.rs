//! What shadow maps are built by: shared by the plan, which tells their size beforehand, and the drawing.

use crate::Error;
use crate::lights::LightPoint;
use crate::load::Loaded;
use crate::scene::{RenderSettings, ShadowMapping};
use splat_core::Limits;
use splat_core::Object;
use tsm::{Deposits, Limit, Params};

/// Share of the tolerance that the ends of lists may take, of all lights together. Absorbance grows with its logarithm only, so
/// a small share costs little.
pub(crate) const CUT_SHARE: f64 = 1.0 / 16.0;
/// Largest slope of a displayed value by radiance, at black: sRGB's.
const DISPLAY_SLOPE: f64 = 12.92;
/// Standard deviation of a splat over its radius, at least.
const LEAST_DEVIATION: f64 = 0.25;

/// The table of one light's shadow map, as it was chosen before any work.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowTable {
    /// Columns and rows.
    pub size: [u64; 2],
    /// What the size of its cells follows from.
    pub limit: Limit,
    /// Entries that splats will deposit.
    pub entries: u64,
    /// Bytes that it takes while it is built.
    pub bytes: u64,
    /// Bytes of the finished map among them.
    pub map_bytes: u64,
    /// Transmittance at which lists stop.
    pub tolerance: f32,
    /// Bytes within which its cells were chosen.
    pub max_bytes: u64,
}

impl ShadowTable {
    /// What it is built by, where it and those after it may take so many bytes.
    pub(crate) fn params(&self, settings: &RenderSettings, loaded: &Loaded, left: u64) -> Params {
        params(settings, loaded, self.tolerance, self.max_bytes.min(left))
    }

    /// Absorbance at which lists stop.
    pub fn absorbance_cut(&self) -> f64 {
        -libm::log(f64::from(self.tolerance))
    }

    /// What the size of the cells follows from, in words.
    pub fn why(&self) -> &'static str {
        match self.limit {
            Limit::Asked => "as asked for",
            Limit::Spacing => "of half a spacing",
            Limit::Cells => "coarser by their number",
            Limit::Entries => "coarser by the number of entries",
            Limit::Memory => "coarser by memory",
        }
    }

    /// In words.
    pub(crate) fn describe(&self, light: &str) -> String {
        let ([columns, rows], entries) = (self.size, self.entries);
        let (why, cut) = (self.why(), self.absorbance_cut());
        format!("{light}: {columns}x{rows} cells, {why}, {entries} entries up to an absorbance of {cut:.1}")
    }
}

/// Parameters of a map with this tolerance, which may take `max_bytes`.
fn params(settings: &RenderSettings, loaded: &Loaded, tolerance: f32, max_bytes: u64) -> Params {
    let shadow = &settings.shadow;
    Params {
        mapping: match shadow.mapping {
            ShadowMapping::Auto => tsm::MappingChoice::Auto,
            ShadowMapping::Octahedral => tsm::MappingChoice::Octahedral,
            ShadowMapping::Polar => tsm::MappingChoice::PolarAzimuth,
        },
        resolution: shadow.cells.map_or(tsm::Resolution::Auto, tsm::Resolution::Cells),
        tolerance,
        footprints: loaded.footprints.clone(),
        limits: Limits::bytes(max_bytes),
        ..Params::default()
    }
}

/// Transmittance e^(−A_cut) below which the light of one lamp is lost in the picture: its brightest light times that changes no
/// displayed value by more than the lamp's part of the tolerance.
fn tolerance(settings: &RenderSettings, loaded: &Loaded, point: &LightPoint, maps: u64) -> f32 {
    let of_lights = || {
        let gain = DISPLAY_SLOPE * libm::exp2(settings.exposure) * brightest(loaded, point).max(f64::MIN_POSITIVE);
        CUT_SHARE * settings.tolerance / (gain * maps as f64)
    };
    let asked = settings.shadow.absorbance_cut.map(|cut| libm::exp(-cut));
    asked.unwrap_or_else(of_lights).clamp(f64::from(f32::MIN_POSITIVE), 0.5) as f32
}

/// The most light that any splat could receive unshadowed, W/m²: at the place of the splats' bounds nearest to the lamp, by their
/// least radius.
fn brightest(loaded: &Loaded, point: &LightPoint) -> f64 {
    let (light, slide) = (&point.light, &loaded.slides[point.of]);
    let passing = slide.as_ref().map_or(1.0, |slide| f64::from(slide.brightest()));
    let intensity = passing * light.intensity.into_iter().map(f64::from).fold(0.0, f64::max);
    let Some(position) = light.shape.place() else { return intensity };
    let bounds = loaded.cloud.bounds();
    if bounds.is_empty() {
        return intensity;
    }
    // Relative to the cloud's origin, so that a moved scene has the same bits.
    let position = position - loaded.cloud.origin;
    let [low, high] = [bounds.min, bounds.max].map(|p| p.as_dvec3());
    let least = loaded.cloud.radius.iter().copied().fold(f32::INFINITY, f32::min);
    let spread = LEAST_DEVIATION * f64::from(least);
    let square = position.distance_squared(position.clamp(low, high)) + spread * spread;
    if square > 0.0 { intensity / square } else { f64::INFINITY }
}

/// Bytes of shadow maps, which live at once: all finished, and what building one takes beside it. With a half more, for casters that
/// are not spread evenly make more entries than are predicted.
pub(crate) fn bytes<'a>(tables: impl Iterator<Item = &'a ShadowTable>) -> u64 {
    let (mut finished, mut building) = (0u64, 0);
    for table in tables {
        finished = finished.saturating_add(table.map_bytes);
        building = building.max(table.bytes - table.map_bytes);
    }
    let predicted = finished.saturating_add(building);
    predicted.saturating_add(predicted / 2)
}

/// A point of a light, and the objects whose splats cast shadows of it.
pub(crate) type Wanted<'a> = (&'a LightPoint, &'a [Object]);

/// The table of each map that is wanted, where all together may take so many bytes: as fine as each would be alone,
/// or, where that is too much, within an equal share of it.
///
/// # Errors
/// That of the first point whose table cannot be chosen, with its name.
pub(crate) fn tables(
    settings: &RenderSettings,
    loaded: &Loaded,
    wanted: &[Option<Wanted<'_>>],
    max_bytes: u64,
) -> Result<Vec<Option<ShadowTable>>, Error> {
    let alone = tables_within(settings, loaded, wanted, max_bytes)?;
    if bytes(alone.iter().flatten()) <= max_bytes {
        return Ok(alone);
    }
    let maps = alone.iter().flatten().count().max(1) as u64;
    tables_within(settings, loaded, wanted, max_bytes / maps * 2 / 3)
}

fn tables_within(
    settings: &RenderSettings,
    loaded: &Loaded,
    wanted: &[Option<Wanted<'_>>],
    max_bytes: u64,
) -> Result<Vec<Option<ShadowTable>>, Error> {
    let maps = wanted.iter().flatten().count().max(1) as u64;
    let table = |wanted: &Option<Wanted<'_>>| {
        let Some((point, objects)) = wanted else { return Ok(None) };
        let light = &point.light;
        let tolerance = tolerance(settings, loaded, point, maps);
        let params = params(settings, loaded, tolerance, max_bytes);
        let scene = tsm::Scene { cloud: &loaded.cloud, materials: &loaded.materials, objects };
        let predicted = Deposits::predict(&scene, light, &params);
        let predicted = predicted.map_err(|e| shadow_error(point, &e))?;
        Ok(Some(ShadowTable {
            size: predicted.size,
            limit: predicted.limit,
            entries: predicted.entries as u64,
            bytes: predicted.bytes,
            map_bytes: predicted.map_bytes,
            tolerance,
            max_bytes,
        }))
    };
    wanted.iter().map(table).collect()
}

/// What went wrong with the map of a point of a light.
pub(crate) fn shadow_error(point: &LightPoint, error: &tsm::Error) -> Error {
    let what = format!("the shadow map of {}", point.name());
    match error {
        tsm::Error::Limit(exceeded) => {
            let hint = "use fewer lights or samples of lights, fewer cells in render.shadow, or a larger --max-memory";
            Error::Limit(exceeded.clone().of(&what, hint))
        }
        tsm::Error::Core(splat_core::Error::Cancelled) => Error::Cancelled,
        other => Error::input(what, other.to_string(), ""),
    }
}
