//! Chooses a mapping for a light and its casters: kind, frame, and number of cells. Predicts its memory.

use crate::building::caster::Casters;
use crate::frame::{Frame, axes_about, axes_along};
use crate::mapping::{Octahedral, Planar, PolarAzimuth, PolarRange, Table};
use crate::planning::appearance::{Apparent, Appearance, SECTORS};
use crate::planning::cost::{self, Limit, Prediction};
use crate::planning::lit::{LOOK_CELLS, Lit};
use crate::planning::survey::Survey;
use crate::{Error, MappingChoice, Resolution};
use glam::{DVec3, Vec2};
use splat_core::{Light, LightShape, Limits, glam};
use std::f64::consts::PI;

/// Sine of the half angle within which a point light is planar by default.
const CONE: f64 = 0.87;
/// Greatest cosine-wise opening of a planar table: tan 75°.
const MAX_TANGENT: f32 = 3.732;
/// Greatest side of a table that the automatic resolution takes.
const MAX_SIDE: f64 = 8192.0;
/// Splats, and cells that each overlaps along a side beyond the first, from which on finer splats no longer make finer cells.
const REFINED: [f64; 2] = [8192.0, 7.0];

/// Spacings that a cell of the eye's map has at least where media are thick.
const COARSE: f64 = 0.8;
/// Times as many entries that a table may have where media are thick or hide most of their splats: their faces show the cells as a comb, and their
/// footprints take the closed form alone, in a fifth of the time of rays.
const WITHIN: f64 = 3.0;

/// Part of a cell that a table may be too short by.
const ROUNDING: f64 = 1.0 / 64.0;

/// The chosen mapping.
pub(crate) struct Plan {
    pub(crate) frame: Frame,
    pub(crate) table: Table,
    pub(crate) prediction: Prediction,
    pub(crate) lit: Lit,
}

enum Kind {
    Octahedral,
    Polar,
    Perspective { tan_outer: Option<f32> },
    Parallel,
}

/// Cells are numbered with 31 bits, and their columns and rows are found exactly in single precision.
const MOST_CELLS_OF_A_SIDE: u64 = 1 << 22;

/// Frame, kind and size of a mapping, without its table of directions, which takes longer than the rest of a prediction.
struct Choice {
    frame: Frame,
    extent: Extent,
    /// The side of a cell.
    cell: f64,
    prediction: Prediction,
    lit: Lit,
}

/// Predicts the cost of the map that [`plan`] would make.
pub(crate) fn predict(
    casters: &Casters<'_>,
    survey: &Survey,
    light: &Light,
    room: &Limits,
) -> Result<Prediction, Error> {
    choose(casters, survey, light, room).map(|choice| choice.prediction)
}

/// Chooses a mapping whose predicted cost fits `room`, and makes it.
pub(crate) fn plan(casters: &Casters<'_>, survey: &Survey, light: &Light, room: &Limits) -> Result<Plan, Error> {
    let Choice { frame, extent, cell, prediction, lit } = choose(casters, survey, light, room)?;
    Ok(Plan { frame, table: extent.table(cell), prediction, lit })
}

/// Chooses frame, kind and size of a mapping whose predicted cost fits `room`.
fn choose(casters: &Casters<'_>, survey: &Survey, light: &Light, room: &Limits) -> Result<Choice, Error> {
    let (kind, frame) = frame_of(casters, survey, light)?;
    let apparent = match kind {
        Kind::Octahedral => Apparent::Angle,
        Kind::Polar => Apparent::AngleAndSectors,
        Kind::Perspective { .. } => Apparent::Tangent,
        Kind::Parallel => Apparent::Length,
    };
    let look = Appearance::new(casters, &frame, apparent);
    let extent = Extent::new(&kind, &look);
    let lit = Lit::new(casters, survey, &frame, extent.table(extent.side / LOOK_CELLS));
    let (cell, limit) = match casters.params.resolution {
        Resolution::Auto => automatic_cell(casters, survey, &look, &lit, &extent, room),
        Resolution::Cells(n) => (extent.side / f64::from(n), Limit::Asked),
    };
    let prediction = cost::predict(&look, survey, &lit, cell, extent.size(cell), limit, extent.is_octahedral());
    let most_bytes = room.max_bytes;
    if prediction.bytes > most_bytes {
        return Err(Error::limit("the table", prediction.bytes, most_bytes, "bytes"));
    }
    let cells = extent.size(cell).map(|cells| cells as u64);
    for (needed, limit, unit) in [
        (cells[0].max(cells[1]), MOST_CELLS_OF_A_SIDE, "cells along a side"),
        (cells[0].saturating_mul(cells[1]), i32::MAX as u64, "cells"),
    ] {
        if needed > limit {
            return Err(Error::limit("the table", needed, limit, unit));
        }
    }
    Ok(Choice { frame, extent, cell, prediction, lit })
}

fn frame_of(casters: &Casters<'_>, survey: &Survey, light: &Light) -> Result<(Kind, Frame), Error> {
    let empty = survey.bounds.is_empty();
    let centre = if empty { DVec3::ZERO } else { survey.bounds.center().as_dvec3() };
    let sides = if empty { DVec3::ONE } else { (survey.bounds.max - survey.bounds.min).as_dvec3() };
    let reach = 0.5 * f64::from(survey.bounds.diagonal()) + f64::from(survey.max_radius);
    let choice = casters.params.mapping;
    let position = match light.shape {
        LightShape::Directional { direction } => {
            if matches!(choice, MappingChoice::Octahedral | MappingChoice::PolarAzimuth) {
                let found = format!("{choice:?} for directional light");
                return Err(Error::Parameter { name: "mapping", found, expected: "Auto or Planar" });
            }
            let origin = centre - direction * (reach * 1.001);
            return Ok((Kind::Parallel, Frame::new(origin, axes_along(direction, sides), 2.0 * reach)));
        }
        LightShape::Point { position } | LightShape::Spot { position, .. } | LightShape::Patch { position, .. } => {
            position - casters.cloud.origin
        }
        _ => {
            return Err(Error::Parameter {
                name: "light",
                found: format!("{:?}", light.shape),
                expected: "a point, patch, spot or directional light; `Light::points` makes such of one with an extent",
            });
        }
    };
    let to_centre = centre - position;
    let extent = to_centre.length() + reach;
    let sphere = || (Kind::Octahedral, Frame::new(position, axes_about(sides), extent));
    let planar = |axis: DVec3, tan_outer| {
        (Kind::Perspective { tan_outer }, Frame::new(position, axes_along(axis, sides), extent))
    };
    let narrow = to_centre.length() * CONE > reach;
    let wide = to_centre.length() * 0.96 > reach;
    Ok(match (choice, light.shape) {
        (MappingChoice::Octahedral, _) => sphere(),
        // The paper's axes are the world's.
        (MappingChoice::PolarAzimuth, _) => (Kind::Polar, Frame::new(position, DVec3::AXES, extent)),
        (_, LightShape::Spot { direction, outer, .. }) if outer < 1.2 => {
            planar(direction, Some(libm::tan(outer) as f32))
        }
        (MappingChoice::Planar, _) if wide => planar(to_centre, None),
        (MappingChoice::Planar, _) => {
            return Err(Error::Parameter {
                name: "mapping",
                found: "Planar for a light within or near its casters".into(),
                expected: "Auto, Octahedral or PolarAzimuth",
            });
        }
        (MappingChoice::Auto, _) if narrow && !empty => planar(to_centre, None),
        (MappingChoice::Auto, _) => sphere(),
    })
}

/// What a table covers, before its cells are chosen.
enum Shape {
    Octahedral,
    Polar(PolarRange),
    Planar { window: [Vec2; 2], perspective: bool },
}

impl Shape {
    fn is_octahedral(&self) -> bool {
        matches!(self, Self::Octahedral)
    }
}

/// A shape with the length of its longer side, in the unit of cells.
struct Extent {
    shape: Shape,
    side: f64,
}

impl std::ops::Deref for Extent {
    type Target = Shape;

    fn deref(&self) -> &Shape {
        &self.shape
    }
}

impl Extent {
    fn new(kind: &Kind, look: &Appearance) -> Self {
        let planar = |perspective, limit: Option<f32>| {
            let limit = Vec2::splat(limit.map_or(MAX_TANGENT, |t| 1.05 * t));
            let [mut low, mut high] = look.window;
            if perspective {
                (low, high) = (low.max(-limit), high.min(limit));
            }
            if !(low.cmplt(high).all() && low.is_finite() && high.is_finite()) {
                (low, high) = (Vec2::NEG_ONE, Vec2::ONE);
            }
            let side = f64::from((high - low).max_element());
            Extent { shape: Shape::Planar { window: [low, high], perspective }, side }
        };
        match kind {
            // An n × n table has n² cells of 4π/n² sr.
            Kind::Octahedral => Extent { shape: Shape::Octahedral, side: (4.0 * PI).sqrt() },
            Kind::Polar => Extent { shape: Shape::Polar(fit(look)), side: PI },
            Kind::Perspective { tan_outer } => planar(true, *tan_outer),
            Kind::Parallel => planar(false, None),
        }
    }
}

impl Extent {
    /// Columns and rows of cells of this side.
    fn size(&self, cell: f64) -> [f64; 2] {
        // A length that is a whole number of cells but for rounding takes no cell more in another unit.
        let count = |length: f64| (length / cell - ROUNDING).ceil().max(1.0);
        match &self.shape {
            // Even, so that no cell lies across the edge between two octants along an axis.
            Shape::Octahedral => [2.0 * (0.5 * count(self.side)).ceil(); 2],
            Shape::Polar(range) => [count(range.azimuth[1]), count(range.polar[1] - range.polar[0])],
            // One more cell on each side, so that light beside the window fades into full light.
            Shape::Planar { window: [low, high], .. } => {
                let span = (*high - *low).as_dvec2();
                [count(span.x) + 2.0, count(span.y) + 2.0]
            }
        }
    }

    /// Cells of this side, without rounding to whole columns and rows: what is chosen by it does not jump.
    fn cells(&self, cell: f64) -> f64 {
        match &self.shape {
            Shape::Octahedral => (self.side / cell).powi(2),
            Shape::Polar(range) => (range.azimuth[1] / cell) * ((range.polar[1] - range.polar[0]) / cell),
            Shape::Planar { window: [low, high], .. } => {
                let count = (*high - *low).as_dvec2() / cell + 2.0;
                count.x * count.y
            }
        }
    }

    fn table(&self, cell: f64) -> Table {
        let [columns, rows] = self.size(cell).map(|n| n as u32);
        match &self.shape {
            Shape::Octahedral => Table::Octahedral(Octahedral::new(columns)),
            Shape::Polar(range) => Table::PolarAzimuth(PolarAzimuth::new(columns, rows, *range)),
            Shape::Planar { window, perspective } => {
                let middle = (window[0] + window[1]) * 0.5;
                let half = Vec2::new(columns as f32, rows as f32) * (0.5 * cell as f32);
                let size = [columns, rows];
                Table::Planar(Planar { min: middle - half, cell: cell as f32, size, perspective: *perspective })
            }
        }
    }
}

/// The paper's pol_min, pol_max, az_min, az_max: the azimuth leaves out the widest gap between casters.
fn fit(look: &Appearance) -> PolarRange {
    let acos = |c: f32| libm::acos(f64::from(c.clamp(-1.0, 1.0)));
    let mut polar = [acos(look.cosine[1]), acos(look.cosine[0])];
    if polar[0] >= polar[1] {
        return PolarRange::SPHERE;
    }
    let margin = 0.02 * (polar[1] - polar[0]);
    polar = [(polar[0] - margin).max(0.0), (polar[1] + margin).min(PI)];
    let sector = 2.0 * PI / SECTORS as f64;
    // (length, end) of the widest run of empty sectors, round the circle twice so that it may cross the seam.
    let mut run = 0;
    let mut widest = (0, 0);
    for s in 0..2 * SECTORS {
        run = if look.sectors[s % SECTORS] { 0 } else { run + 1 };
        if run > widest.0 && run <= SECTORS {
            widest = (run, s + 1);
        }
    }
    // A narrow gap saves nothing, and a pole needs the whole circle.
    let touches_pole = polar[0] <= 0.0 || polar[1] >= PI;
    if touches_pole || widest.0 < SECTORS / 8 || widest.0 >= SECTORS {
        return PolarRange { polar, azimuth: PolarRange::SPHERE.azimuth };
    }
    let start = (widest.1 % SECTORS) as f64 * sector;
    PolarRange { polar, azimuth: [start, (SECTORS - widest.0) as f64 * sector] }
}

/// Cells of half a median spacing, made coarser until cells, entries and bytes fit.
fn automatic_cell(
    casters: &Casters<'_>,
    survey: &Survey,
    look: &Appearance,
    lit: &Lit,
    extent: &Extent,
    room: &Limits,
) -> (f64, Limit) {
    let Some(spacing) = look.median_spacing() else { return (extent.side / 16.0, Limit::Spacing) };
    let refines = casters.params.refines_lit;
    let finest = if lit.is_steep && !refines { COARSE } else { 0.5 } * spacing;
    let finest = finest.min(extent.side);
    let most_cells = (4.0 * survey.casters as f64).clamp(65_536.0, 16_777_216.0);
    let splats = look.casters() as f64;
    let times = if lit.is_steep && refines { WITHIN } else { 1.0 };
    let most_entries = times * budget(casters, if refines { splats } else { lit.share * splats });
    let Limits { max_bytes, max_elements } = *room;
    let has_cells = |cell: f64| cell >= extent.side / MAX_SIDE && extent.cells(cell) <= most_cells;
    let has_entries = |cell: f64| lit.share * look.covered(cell, extent.cells(cell)) <= most_entries;
    let has_bytes = |cell: f64| {
        let size = extent.size(cell);
        cost::predict(look, survey, lit, cell, size, Limit::Memory, extent.is_octahedral()).bytes <= max_bytes
    };
    // What is predicted may be half of what is deposited.
    let has_elements = |cell: f64| lit.share * look.covered(cell, extent.cells(cell)) <= 0.5 * max_elements as f64;
    [
        (least(finest, extent.side, has_cells), Limit::Cells),
        (least(finest, extent.side, has_entries), Limit::Entries),
        (least(finest, extent.side, has_bytes), Limit::Memory),
        (least(finest, extent.side, has_elements), Limit::Memory),
    ]
    .into_iter()
    .fold((finest, Limit::Spacing), |found, next| if next.0 > found.0 { next } else { found })
}

/// Entries that a table for `n` casters may have. Splats of a volume that are n^(-1/3) apart and overlap (1 + s·spacing/cell)²
/// cells each make so many in cells that stay as they are while splats become finer; where that is fewer than
/// [`crate::Params::entries_per_splat`], cells become finer with the splats again.
fn budget(casters: &Casters<'_>, n: f64) -> f64 {
    let [splats, cells] = REFINED;
    let same = n * (1.0 + cells * libm::cbrt(splats / n.max(1.0))).powi(2);
    same.max(f64::from(casters.params.entries_per_splat) * n)
}

/// The least cell between two that fits, where larger ones do; the largest where none does.
fn least(finest: f64, coarsest: f64, fits: impl Fn(f64) -> bool) -> f64 {
    if fits(finest) {
        return finest;
    }
    let mut low = finest;
    let mut high = coarsest;
    for _ in 0..52 {
        let middle = 0.5 * (low + high);
        (low, high) = if fits(middle) { (low, middle) } else { (middle, high) };
    }
    high
}
