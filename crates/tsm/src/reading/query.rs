//! Queries beside shadow: lists, first hit, collision, isosurface points (Gunjee 2007, Figure 15a).

use crate::ShadowMap;
use crate::mapping::{Mapping, Ray, with_mapping};
use crate::reading::lookup::continuous;
use crate::shadow_map::{Absorbances, Matter};
use crate::table::List;
use glam::Vec3;
use pulp::{Simd, WithSimd};
use rayon::prelude::*;
use splat_core::{Receiver, SplatKind, Transmittance, glam};

/// Most looks at what moves from one whole time to the next.
const MOST_STEPS: f32 = 256.0;
/// Cosine between a plane and light below which it is almost parallel to that.
const GRAZING: f32 = 0.1;
/// How often the time of a collision is halved.
const HALVINGS: usize = 16;

/// A point where the absorbance seen from the light first reaches a threshold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Position relative to the cloud's origin, world units.
    pub position: Vec3,
    /// Unit normal towards the light, from the neighbouring cells.
    pub normal: Vec3,
    /// Area that the cell covers at the surface, world units².
    pub area: f32,
}

impl ShadowMap {
    /// The cell that a position, relative to the cloud's origin, lies in; `None` at the light and outside the table.
    pub fn cell_of(&self, position: Vec3) -> Option<u32> {
        let p = self.frame.position(position);
        with_mapping!(&self.table, m => {
            let at = m.locate(p)?.at.floor();
            m.wrap(at.x as i32, at.y as i32)
        })
    }

    /// Entries of a cell by rising distance: (distance in world units, absorbance up to and with it per channel).
    /// Media and surfaces are merged; an opaque disc is an infinite absorbance at its end. Empty for a cell out of
    /// range.
    pub fn list(&self, cell: u32) -> Vec<(f64, [f32; 3])> {
        let mut entries: Vec<(f32, [f32; 3])> = match &self.absorbances {
            Absorbances::Mono(matter) => own_absorbances(matter, cell, self.cells()),
            Absorbances::Rgb(matter) => own_absorbances(matter, cell, self.cells()),
        };
        entries.sort_by(|a, b| a.0.total_cmp(&b.0));
        if let Some(d) = self.opaque.get(cell as usize).filter(|d| d.is_finite()) {
            entries.push((*d, [f32::INFINITY; 3]));
        }
        let mut sum = [0.0f32; 3];
        let running = entries.into_iter().map(|(distance, absorbance)| {
            (0..3).for_each(|c| sum[c] += absorbance[c]);
            (self.frame.world_length(distance), sum)
        });
        running.collect()
    }

    /// Bytes that building it took, about at most, and asking for [`Self::first_surface`]: predictions may be half of what is needed.
    pub fn peak_bytes(&self) -> u64 {
        let of_cell = size_of::<Option<f32>>() + 2 * size_of::<SurfacePoint>();
        self.prediction().bytes * 3 / 2 + u64::from(self.cells()) * of_cell as u64
    }

    /// Cells of the table.
    pub fn cells(&self) -> u32 {
        let [columns, rows] = with_mapping!(&self.table, m => m.size());
        columns * rows
    }

    /// Distance from the light, world units, at which the absorbance of a cell reaches `absorbance` in every channel. As
    /// in look-ups on the cell's ray, a medium absorbs continuously, a surface at once. For parallel light it is the
    /// distance from the plane where the table starts. `None` if it never does.
    pub fn first_hit(&self, cell: u32, absorbance: f32) -> Option<f64> {
        self.hit_in_frame(cell, absorbance).map(|d| self.frame.world_length(d))
    }

    /// The first hit towards a position relative to the cloud's origin, as an offset from that origin.
    pub fn first_hit_towards(&self, position: Vec3, absorbance: f32) -> Option<Vec3> {
        let cell = self.cell_of(position)?;
        let distance = self.hit_in_frame(cell, absorbance)?;
        let p = self.frame.position(position);
        let hit = with_mapping!(&self.table, m => {
            if m.is_parallel() { p.truncate().extend(distance) } else { p.normalize() * distance }
        });
        Some(self.frame.offset(hit))
    }

    fn hit_in_frame(&self, cell: u32, absorbance: f32) -> Option<f32> {
        if cell >= self.cells() {
            return None;
        }
        let solid = match &self.absorbances {
            Absorbances::Mono(matter) => {
                pulp::Arch::new().dispatch(First { matter, cell, absorbance, ramp: self.ramp })
            }
            Absorbances::Rgb(matter) => pulp::Arch::new().dispatch(First { matter, cell, absorbance, ramp: self.ramp }),
        };
        let opaque = self.opaque.get(cell as usize).copied().filter(|d| d.is_finite());
        match (solid, opaque) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    /// Whether any entry lies in a sphere, as seen from the light: on the ray of some cell, between the distances at
    /// which that ray enters and leaves the sphere. `center` is relative to the cloud's origin. Matter behind the
    /// visible limit of its cell is not seen. Looks at every cell.
    pub fn collides(&self, center: Vec3, radius: f32) -> bool {
        let c = self.frame.position(center);
        let r = self.frame.length(radius);
        (0..self.cells()).into_par_iter().with_min_len(4096).any(|cell| {
            let ray = with_mapping!(&self.table, m => m.cell_ray(cell));
            let p = c - ray.base;
            let along = p.dot(ray.direction);
            let chord_sq = r * r - (p - ray.direction * along).length_squared();
            if chord_sq < 0.0 {
                return false;
            }
            let half = chord_sq.sqrt();
            self.is_met(cell, along - half, along + half)
        })
    }

    /// Whether a cell has an entry between two distances in the frame.
    fn is_met(&self, cell: u32, from: f32, to: f32) -> bool {
        let inside = match &self.absorbances {
            Absorbances::Mono(matter) => any_between(matter, cell, from, to),
            Absorbances::Rgb(matter) => any_between(matter, cell, from, to),
        };
        inside || self.opaque.get(cell as usize).is_some_and(|d| (from..=to).contains(d))
    }

    /// The last time from 0 to `end` before any of the moving places passes an entry of its cell. A place may then lie behind the entry by at most
    /// two widths of the cell. 0 where one has from the beginning, and `end` where none ever does. `places` are those at time 0, relative to the
    /// cloud's origin, and `moved` is how far they have gone. Between whole times the places move straight, and each cell's width of the way is
    /// tested, but at most 256 places of it. If these steps are longer than a cell is wide, the result is late by at most two steps.
    pub fn free_until(&self, places: &[Vec3], moved: &dyn Fn(f64) -> Vec3, end: u32) -> f64 {
        let mut free = 0.0;
        for begin in (0..=end).map(f64::from) {
            let from = moved(begin);
            let way =
                if begin < f64::from(end) { self.frame.length((moved(begin + 1.0) - from).length()) } else { 0.0 };
            let widths = places.par_iter().filter_map(|place| Some(self.place_of(*place + from)?.2));
            let steps = (way / widths.reduce_with(f32::min).unwrap_or(f32::MIN_POSITIVE)).ceil().clamp(1.0, MOST_STEPS);
            let has_met = |time: f64| {
                let by = moved(time);
                places.par_iter().any(|place| self.is_past(*place + by, way / steps))
            };
            for k in 0..if way > 0.0 { steps as u32 } else { 1 } {
                let mut met = begin + f64::from(k) / f64::from(steps);
                if has_met(met) {
                    for _ in 0..HALVINGS {
                        let middle = 0.5 * (free + met);
                        *if has_met(middle) { &mut met } else { &mut free } = middle;
                    }
                    return free;
                }
                free = met;
            }
        }
        free
    }

    /// Whether a place lies behind an entry of its cell by no more than two widths of that, or two steps of that length in the frame.
    fn is_past(&self, place: Vec3, step: f32) -> bool {
        self.place_of(place)
            .is_some_and(|(cell, distance, width)| self.is_met(cell, distance - 2.0 * width.max(step), distance))
    }

    /// The cell of a place, its distance from the light and the width of the cell there, both in the frame.
    pub(crate) fn place_of(&self, place: Vec3) -> Option<(u32, f32, f32)> {
        let cell = self.cell_of(place)?;
        let p = self.frame.position(place);
        with_mapping!(&self.table, m => {
            let (distance, spread) = if m.is_parallel() { (p.z, 1.0) } else { (p.length(), p.length()) };
            Some((cell, distance, spread * m.measure(cell).sqrt() as f32))
        })
    }

    /// Width of the cell at a position, relative to the cloud's origin, world units; 0 at the light and outside the table.
    pub fn cell_width(&self, position: Vec3) -> f64 {
        self.place_of(position).map_or(0.0, |(_, _, width)| self.frame.world_length(width))
    }

    /// Estimates the error of the transmittance at a receiver against much smaller cells, in \[0, 1\]; 0 outside the table.
    ///
    /// The estimate is the error of linear interpolation: the greatest third of a second difference of places half a cell apart, along the receiving
    /// plane, up to a cell away on either side. For smooth light and cells of width h the estimate is h²/12 times the curvature, the mean over a
    /// cell. In the middle of an opaque shadow's edge it is a sixth.
    pub fn interpolation_error(&self, receiver: &Receiver) -> f32 {
        let Some((_, _, width)) = self.place_of(receiver.position) else { return 0.0 };
        let p = self.frame.position(receiver.position);
        let parallel = with_mapping!(&self.table, m => m.is_parallel());
        let towards = if parallel { Vec3::Z } else { p.normalize() };
        let normal = self.frame.turn(receiver.normal);
        let slope = normal.dot(towards);
        let first = towards.any_orthonormal_vector();
        let step = |across: Vec3| {
            // Along the ray back into the plane, unless that is almost parallel to it.
            let is_plane = receiver.kind != SplatKind::Medium && slope.abs() > GRAZING;
            let along = if is_plane { across - towards * (normal.dot(across) / slope) } else { across };
            self.frame.world_direction(along) * (0.5 * self.frame.world_length(width)) as f32
        };
        let through = |offset: Vec3| {
            let [.., green, _] = self.transmittance(&Receiver { position: receiver.position + offset, ..*receiver });
            green
        };
        let here = through(Vec3::ZERO);
        let across = [first, -first, towards.cross(first), first.cross(towards)].map(step);
        let bends = across.map(|step| (here - 2.0 * through(step) + through(2.0 * step)).abs() / 3.0);
        bends.into_iter().fold(0.0, f32::max)
    }

    /// The greatest absorbance that a cell has in every channel, up to which [`Self::first_surface`] has points: infinite with opaque discs, 0
    /// without anything.
    pub fn most_absorbance(&self) -> f32 {
        let of_cell = |cell| match &self.absorbances {
            Absorbances::Mono(matter) => whole_absorbance(matter, cell),
            Absorbances::Rgb(matter) => whole_absorbance(matter, cell),
        };
        let opaque = self.opaque.iter().any(|d| d.is_finite());
        let most = (0..self.cells()).into_par_iter().with_min_len(4096).map(of_cell).reduce(|| 0.0, f32::max);
        if opaque { f32::INFINITY } else { most }
    }

    /// The surface that the light sees: for each cell whose absorbance reaches `absorbance`, the point where it first
    /// does (Gunjee 2007, Figure 15a). Normals come from the points of neighbouring cells; a point whose neighbours
    /// all miss faces the light.
    pub fn first_surface(&self, absorbance: f32) -> Vec<SurfacePoint> {
        let cells = (0..self.cells()).into_par_iter().with_min_len(4096);
        let hits: Vec<Option<f32>> = cells.clone().map(|cell| self.hit_in_frame(cell, absorbance)).collect();
        with_mapping!(&self.table, m => {
            let hit = |cell: u32| -> Option<Vec3> {
                let Ray { base, direction } = m.cell_ray(cell);
                Some(base + direction * hits[cell as usize]?)
            };
            let point = |cell: u32| -> Option<SurfacePoint> {
                let p = hit(cell)?;
                let [columns, _] = m.size();
                let i = (cell % columns) as i32;
                let j = (cell / columns) as i32;
                let at = |i, j| m.wrap(i, j).and_then(&hit);
                let along = |a: Option<Vec3>, b: Option<Vec3>| b.unwrap_or(p) - a.unwrap_or(p);
                let du = along(at(i - 1, j), at(i + 1, j));
                let dv = along(at(i, j - 1), at(i, j + 1));
                let light = -m.cell_ray(cell).direction;
                let normal = du.cross(dv).try_normalize().unwrap_or(light);
                let normal = if normal.dot(light) < 0.0 { -normal } else { normal };
                let spread = if m.is_parallel() { 1.0 } else { p.length_squared() };
                let facing = normal.dot(light).max(1e-3);
                let area = self.frame.world_length(1.0).powi(2) * m.measure(cell) * f64::from(spread / facing);
                Some(SurfacePoint {
                    position: self.frame.offset(p),
                    normal: self.frame.world_direction(normal),
                    area: area as f32,
                })
            };
            cells.filter_map(point).collect()
        })
    }
}

/// Absorbance of all that a cell lists, in the channel that has least.
fn whole_absorbance<const C: usize>(matter: &Matter<C>, cell: u32) -> f32 {
    let [media, surfaces] = [&matter.media, &matter.surfaces].map(|lists| {
        let list = lists.as_ref().map_or(List::NONE, |lists| lists.list(cell));
        list.total_of(list.len())
    });
    (0..C).map(|c| media[c] + surfaces[c]).fold(f32::INFINITY, f32::min)
}

fn own_absorbances<const C: usize>(matter: &Matter<C>, cell: u32, cells: u32) -> Vec<(f32, [f32; 3])> {
    let mut absorbances = Vec::new();
    if cell >= cells {
        return absorbances;
    }
    for lists in [&matter.media, &matter.surfaces].into_iter().flatten() {
        let mut before = [0.0; C];
        let list = lists.list(cell);
        for (distance, total) in list.distance().iter().zip(list.total()) {
            absorbances.push((*distance, std::array::from_fn(|c| total[c.min(C - 1)] - before[c.min(C - 1)])));
            before = *total;
        }
    }
    absorbances
}

/// Where the absorbance of a cell first reaches `absorbance` in every channel: the entries of media, each spread evenly over
/// `ramp` to either side of its distance, and those of surfaces, which are steps.
struct First<'a, const C: usize> {
    matter: &'a Matter<C>,
    cell: u32,
    absorbance: f32,
    ramp: f32,
}

impl<const C: usize> WithSimd for First<'_, C> {
    type Output = Option<f32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<f32> {
        let Self { matter, cell, absorbance, ramp } = self;
        let [media, surfaces] =
            [&matter.media, &matter.surfaces].map(|lists| lists.as_ref().map_or(List::NONE, |lists| lists.list(cell)));
        let ends = [media.distance().last().map(|d| d + ramp), surfaces.distance().last().copied()];
        let end = ends.into_iter().flatten().reduce(f32::max)?;
        // Distances are positive, and their bits in their order. The end is looked at first.
        let mut before = 0;
        let mut reached = end.to_bits() + 1;
        let mut looked_at = end.to_bits();
        while reached - before > 1 {
            let distance = f32::from_bits(looked_at);
            let steps = surfaces.total_of(surfaces.distance().partition_point(|d| *d <= distance));
            let begin = media.distance().partition_point(|d| *d <= distance - ramp);
            let within = continuous(simd, media, begin, distance, ramp);
            let is_reached = (0..C).all(|c| steps[c] + within[c] >= absorbance);
            *if is_reached { &mut reached } else { &mut before } = looked_at;
            looked_at = before + (reached - before) / 2;
        }
        (reached <= end.to_bits()).then_some(f32::from_bits(reached))
    }
}

fn any_between<const C: usize>(matter: &Matter<C>, cell: u32, from: f32, to: f32) -> bool {
    [&matter.media, &matter.surfaces].into_iter().flatten().any(|lists| {
        let list = lists.list(cell).distance();
        list.get(list.partition_point(|d| *d < from)).is_some_and(|d| *d <= to)
    })
}
