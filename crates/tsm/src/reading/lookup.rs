//! Looking up the light that arrives: T = e^−A between the four nearest cells (Gunjee 2007, Eqs. 8 and 9).
//!
//! A medium's entry is spread evenly over half a spacing to either side of its distance, as its splat stands for a cell of
//! the lattice that deep: A(d) = Σ_j a_j·clamp((d − d_j)/2r + ½). So a medium shadows itself by half its absorbance, bands
//! do not appear, and light changes continuously with every distance, also if several are equal. A surface is a step at
//! its tangent plane on the cell's ray. A receiving surface is compared at its tangent plane on the same ray, lifted
//! towards the light by half a splat. A plane then lies exactly on itself at any angle, in cells of any size.
//!
//! Cells are weighted so that their rays, weighted alike, meet the receiver. Where the table is smooth those are the
//! bilinear weights of its place; across an edge between octants, where directions are not, the place is looked for.

use crate::ShadowMap;
use crate::building::deposit::plane_distance;
use crate::mapping::{Mapping, Place, floor, with_mapping};
use crate::reading::patch::{Patch, met_at};
use crate::shadow_map::{Absorbances, Matter};
use crate::table::{ENOUGH, List, Lists, WINDOW};
use glam::{Vec2, Vec3, Vec4};
use pulp::{Simd, WithSimd};
use splat_core::raster::lanes::{Broadcast, Lanes, exp_neg};
use splat_core::{ABOUT, Receiver, SplatKind, TOGETHER, Transmittance, glam};

/// Greatest absorbance that is told: the transmittance is the least normal number of f32.
const MOST: f32 = 87.33655;
/// Least lift over the distance: f32 planes agree to about 2⁻²⁰.
const ROUNDING: f32 = 1.0 / 262_144.0;

/// A number for each of the four cells about each of some receivers.
type Four<T, const R: usize> = [[T; 4]; R];

impl Transmittance for ShadowMap {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        let [light] = pulp::Arch::new().dispatch(LookUp::<1, false> { map: self, receivers: &[*receiver] });
        light
    }

    fn absorbance(&self, receiver: &Receiver) -> [f32; 3] {
        let [absorbance] = pulp::Arch::new().dispatch(LookUp::<1, true> { map: self, receivers: &[*receiver] });
        absorbance
    }

    // While one waits for memory, others are worked on.
    fn absorbances_about(&self, receivers: &[Receiver; ABOUT]) -> [[f32; 3]; ABOUT] {
        pulp::Arch::new().dispatch(LookUp::<ABOUT, true> { map: self, receivers })
    }

    fn at_splats(&self, splats: &[usize], receiver: &dyn Fn(usize) -> Receiver) -> [[f32; 3]; TOGETHER] {
        const NONE: Receiver =
            Receiver { position: Vec3::ZERO, normal: Vec3::ZERO, radius: 0.0, kind: SplatKind::Medium };
        let mut receivers = [NONE; TOGETHER];
        receivers.iter_mut().zip(splats).for_each(|(entry, splat)| *entry = receiver(*splat));
        pulp::Arch::new().dispatch(LookUp::<TOGETHER, false> { map: self, receivers: &receivers[..splats.len()] })
    }
}

/// Look-ups of at most `R` receivers, of transmittances or of absorbances, in the form that [`pulp`] compiles once per instruction set.
struct LookUp<'a, const R: usize, const ABSORBANCE: bool> {
    map: &'a ShadowMap,
    receivers: &'a [Receiver],
}

impl<const R: usize, const ABSORBANCE: bool> WithSimd for LookUp<'_, R, ABSORBANCE> {
    type Output = [[f32; 3]; R];

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> [[f32; 3]; R] {
        let Self { map, receivers } = self;
        let mut light = [[0.0; 3]; R];
        with_mapping!(&map.table, m => match &map.absorbances {
            Absorbances::Mono(matter) => {
                let mono = map.look_up::<S, _, 1, R, ABSORBANCE>(simd, m, matter, receivers);
                light.iter_mut().zip(&mono).for_each(|(light, [one])| *light = [*one; 3]);
            }
            Absorbances::Rgb(matter) => {
                let rgb = map.look_up::<S, _, 3, R, ABSORBANCE>(simd, m, matter, receivers);
                light.iter_mut().zip(&rgb).for_each(|(light, rgb)| *light = *rgb);
            }
        });
        light
    }
}

/// A receiver in the light's frame.
struct Target {
    position: Vec3,
    normal: Vec3,
    distance: f32,
    /// Lift of the tangent plane towards the light, along the normal.
    lift: f32,
    is_surface: bool,
}

impl Target {
    /// Distances along the ray of a cell: for media, and for surfaces. `None` where the cell does not see the plane.
    #[inline(always)]
    fn distances<M: Mapping>(&self, mapping: &M, cell: u32) -> Option<[f32; 2]> {
        if !self.is_surface {
            return Some([self.distance; 2]);
        }
        if self.normal == Vec3::ZERO {
            return Some([self.distance, self.distance - self.lift]);
        }
        let ray = mapping.cell_ray(cell);
        let plane = plane_distance(self.position, self.normal, &ray)?;
        // Far from the receiver its plane no longer stands for the surface that it is part of.
        let near = plane > 0.5 * self.distance && plane < 2.0 * self.distance;
        if !near && !mapping.is_parallel() {
            return None;
        }
        Some([plane, plane - self.lift / ray.direction.dot(self.normal).abs()])
    }
}

impl ShadowMap {
    #[inline(always)]
    fn look_up<S: Simd, M: Mapping, const C: usize, const R: usize, const ABSORBANCE: bool>(
        &self,
        simd: S,
        mapping: &M,
        matter: &Matter<C>,
        receivers: &[Receiver],
    ) -> [[f32; C]; R] {
        let mut cells: Four<_, R> = [[None; 4]; R];
        let mut distances: Four<_, R> = [[[0.0; 2]; 4]; R];
        let mut weights: Four<_, R> = [[0.0; 4]; R];
        for (r, receiver) in receivers.iter().enumerate() {
            let Some((target, place)) = self.target(mapping, receiver) else { continue };
            let is_creased = mapping.is_creased(place.at, Vec2::ONE);
            let at = if is_creased { met_at(mapping, target.position, place.at) } else { place.at };
            let patch = Patch::at(mapping, at);
            (cells[r], weights[r]) = (patch.cells, patch.weights);
            for k in 0..4 {
                distances[r][k] = [place.distance; 2];
                if let Some(cell) = patch.cells[k] {
                    match target.distances(mapping, cell) {
                        Some(of_cell) => distances[r][k] = of_cell,
                        // It sees nothing of the receiver.
                        None => weights[r][k] = 0.0,
                    }
                }
            }
        }
        let absorbed = self.absorbed(simd, matter, &cells, &distances, receivers.len());
        let number = |absorbed: f32| if ABSORBANCE { absorbed.min(MOST) } else { passing(absorbed) };
        // Outside of the table all passes.
        let mut light = [[if ABSORBANCE { 0.0 } else { 1.0 }; C]; R];
        for (r, receiver) in receivers.iter().enumerate() {
            let mut sum = [0.0; C];
            let mut seen = 0.0;
            for k in 0..4 {
                (0..C).for_each(|c| sum[c] += weights[r][k] * number(absorbed[r][k][c]));
                seen += weights[r][k];
            }
            if seen > 0.0 {
                let most = if ABSORBANCE { MOST } else { 1.0 };
                (0..C).for_each(|c| light[r][c] = (sum[c] / seen).min(most));
            } else if let Some((target, place)) = self.target(mapping, receiver) {
                light[r] = self.grazing(mapping, matter, &target, place.at).map(number);
            }
        }
        light
    }

    /// A receiver in the light's frame, and its place in the table; `None` outside of that.
    #[inline(always)]
    fn target<M: Mapping>(&self, mapping: &M, receiver: &Receiver) -> Option<(Target, Place)> {
        let position = self.frame.position(receiver.position);
        let place = mapping.locate(position)?;
        let target = Target {
            position,
            normal: self.frame.turn(receiver.normal),
            distance: place.distance,
            lift: (self.frame.length(receiver.radius) * self.bias).max(place.distance * ROUNDING),
            is_surface: receiver.kind != SplatKind::Medium,
        };
        Some((target, place))
    }

    /// A plane that no near cell sees, being almost parallel to the light: it gets next to none, and no surface can be
    /// told to be before or behind it, so media alone shadow it.
    #[cold]
    fn grazing<M: Mapping, const C: usize>(
        &self,
        mapping: &M,
        matter: &Matter<C>,
        target: &Target,
        at: Vec2,
    ) -> [f32; C] {
        let cell = mapping.wrap(floor(at.x), floor(at.y));
        // Too rare to be vectorised, and the same in every bit.
        let simd = pulp::Scalar::new();
        self.absorbed(simd, matter, &[[cell, None, None, None]], &[[[target.distance, 0.0]; 4]], 1)[0][0]
    }

    /// Absorbance of the cells about the first `n` receivers, each up to its distances for media and for surfaces: 0 outside of the table, infinite
    /// behind what is opaque.
    #[inline(always)]
    fn absorbed<S: Simd, const C: usize, const R: usize>(
        &self,
        simd: S,
        matter: &Matter<C>,
        cells: &Four<Option<u32>, R>,
        distances: &Four<[f32; 2], R>,
        n: usize,
    ) -> Four<[f32; C], R> {
        let mut absorbance: Four<_, R> = [[[0.0; C]; 4]; R];
        let mut nearest: Four<_, R> = [[0.0; 4]; R];
        let mut surfaces: Four<_, R> = [[0.0; 4]; R];
        let mut is_dark: Four<_, R> = [[false; 4]; R];
        for r in 0..n {
            for k in 0..4 {
                let [medium, surface] = distances[r][k];
                (nearest[r][k], surfaces[r][k]) = (medium - self.ramp, surface);
                let opaque = cells[r][k].and_then(|cell| self.opaque.get(cell as usize));
                is_dark[r][k] = opaque.is_some_and(|d| *d < surface);
            }
        }
        if let Some(lists) = &matter.media {
            let spans = spans(lists, cells, &is_dark, n);
            let begin = lists.places(&spans, &nearest, n, |d, nearest| d <= nearest);
            for r in 0..n {
                for k in 0..4 {
                    let list = lists.list_at(spans[r][k]);
                    absorbance[r][k] = continuous(simd, list, begin[r][k], distances[r][k][0], self.ramp);
                }
            }
        }
        if let Some(lists) = &matter.surfaces {
            let spans = spans(lists, cells, &is_dark, n);
            let begin = lists.places(&spans, &surfaces, n, |d, surface| d < surface);
            for r in 0..n {
                for k in 0..4 {
                    let step = steps(lists.list_at(spans[r][k]), begin[r][k], surfaces[r][k]);
                    (0..C).for_each(|c| absorbance[r][k][c] += step[c]);
                }
            }
        }
        for r in 0..n {
            for k in 0..4 {
                for a in &mut absorbance[r][k] {
                    if is_dark[r][k] || self.dark_from.is_some_and(|limit| *a > limit) {
                        *a = f32::INFINITY;
                    }
                }
            }
        }
        absorbance
    }
}

/// Transmittance of an absorbance.
#[inline(always)]
fn passing(absorbance: f32) -> f32 {
    if absorbance == f32::INFINITY { 0.0 } else { exp_neg(absorbance) }
}

/// The lists of the cells about the first `n` receivers: nothing counts behind what is opaque.
#[inline(always)]
fn spans<const C: usize, const R: usize>(
    lists: &Lists<C>,
    cells: &Four<Option<u32>, R>,
    is_dark: &Four<bool, R>,
    n: usize,
) -> Four<[u32; 2], R> {
    let mut spans = [[[0; 2]; 4]; R];
    for r in 0..n {
        for k in 0..4 {
            if let Some(cell) = cells[r][k].filter(|_| !is_dark[r][k]) {
                spans[r][k] = lists.span(cell);
            }
        }
    }
    spans
}

/// Places in a window.
const INDEX: [f32; WINDOW + 1] = {
    let mut index = [0.0; WINDOW + 1];
    let mut n = 0;
    while n <= WINDOW {
        index[n] = n as f32;
        n += 1;
    }
    index
};

/// Absorbance at `distance`, every entry spread evenly over `ramp` to either side of its own distance; those before `begin`
/// lie wholly before it. With s_n the share of entry n before the distance, and A_n the absorbance up to and with it, that is
/// Σ A_n·(s_n − s_{n+1}).
#[inline(always)]
pub(crate) fn continuous<S: Simd, const C: usize>(
    simd: S,
    list: List<'_, C>,
    begin: usize,
    distance: f32,
    ramp: f32,
) -> [f32; C] {
    let place = simd.lanes(distance);
    let half = simd.lanes(0.5);
    let inverse = simd.lanes(0.5 / ramp);
    let none = simd.lanes(0.0);
    let whole = simd.lanes(1.0);
    let mut sums = [[0.0; WINDOW]; C];
    // The last that lies wholly before stands for all before it.
    let mut n = begin.saturating_sub(1);
    while n < list.len() {
        let (at, total) = list.window(n);
        let left = simd.lanes((list.len() - n).min(2 * WINDOW) as f32);
        for l in (0..WINDOW).step_by(Lanes::<S>::COUNT) {
            let [this, next] = [Lanes::load(simd, &at[l..]), Lanes::load(simd, &at[l + 1..])];
            // Nothing of what follows the list.
            let most = whole.min(left - Lanes::load(simd, &INDEX[l..]));
            let most_next = whole.min(left - Lanes::load(simd, &INDEX[l + 1..]));
            let share = ((place - this) * inverse + half).min(most).max(none);
            let share_next = ((place - next) * inverse + half).min(most_next).max(none);
            let part = share - share_next;
            for c in 0..C {
                let total = column(simd, total, l, c);
                (Lanes::load(simd, &sums[c][l..]) + total * part).store(&mut sums[c][l..]);
            }
        }
        n += WINDOW;
        if at[WINDOW] >= distance + ramp {
            break;
        }
    }
    let mut sum = [0.0; C];
    (0..C).for_each(|c| sum[c] = added(&sums[c]));
    sum
}

/// A channel of some absorbances.
#[inline(always)]
fn column<S: Simd, const C: usize>(simd: S, absorbances: &[[f32; C]; WINDOW], from: usize, c: usize) -> Lanes<S> {
    if C == 1 {
        return Lanes::load(simd, &absorbances.as_flattened()[from..]);
    }
    let mut column = [0.0; WINDOW];
    (0..Lanes::<S>::COUNT).for_each(|l| column[l] = absorbances[from + l][c]);
    Lanes::load(simd, &column)
}

/// Sum of all, in the same order on every machine.
#[inline(always)]
fn added(absorbances: &[f32; WINDOW]) -> f32 {
    let mut four = Vec4::ZERO;
    // A loop, not a closure: this would be a call for each list.
    for part in absorbances.as_chunks::<4>().0 {
        four += Vec4::from_array(*part);
    }
    (four.x + four.z) + (four.y + four.w)
}

/// Absorbance of all entries before `distance`, of which those before `begin` are.
#[inline(always)]
fn steps<const C: usize>(list: List<'_, C>, begin: usize, distance: f32) -> [f32; C] {
    if begin == list.len() {
        return list.total_of(begin);
    }
    let (at, _) = list.window(begin);
    let before = |l: &usize| (*l < list.len() - begin) & (at[*l] < distance);
    list.total_of(begin + (0..ENOUGH).filter(before).count())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::entries::Entries;
    use crate::table::{Parted, Ranges};

    /// Lists of cells from entries of a cell, a distance and an absorbance each.
    fn lists(cells: usize, entries: &[(u32, f32, f32)]) -> Lists<1> {
        let mut built = Entries::<1>::default();
        entries.iter().for_each(|&(cell, distance, a)| built.push(cell, distance, a, &[1.0; 3]));
        let ranges = Ranges::new(cells, entries.len() as f64);
        Lists::new(&[Parted::new(&built, ranges)], ranges, 1e6)
    }

    /// [`continuous`] by whatever the machine has.
    struct Continuous<'a>(List<'a, 1>, usize, [f32; 2]);

    impl WithSimd for Continuous<'_> {
        type Output = f32;

        fn with_simd<S: Simd>(self, simd: S) -> f32 {
            let Self(list, begin, [distance, ramp]) = self;
            continuous(simd, list, begin, distance, ramp)[0]
        }
    }

    /// The same bits by the widest vectors and by none.
    fn absorbance(lists: &Lists<1>, cell: u32, distance: f32, ramp: f32) -> f32 {
        let spans = [lists.span(cell); 4];
        let [begin, ..] = lists.places(&[spans], &[[distance - ramp; 4]], 1, |d, nearest| d <= nearest)[0];
        let continuous = || Continuous(lists.list_at(spans[0]), begin, [distance, ramp]);
        let [widest, none] = [pulp::Arch::new().dispatch(continuous()), continuous().with_simd(pulp::Scalar::new())];
        assert_eq!(widest.to_bits(), none.to_bits());
        widest
    }

    #[test]
    fn media_absorb_continuously_and_by_half_at_their_own_distance() {
        let lists = lists(1, &[(0, 1.0, 0.4), (0, 2.0, 0.2), (0, 9.0, 1.0)]);
        let at = |d: f32| absorbance(&lists, 0, d, 1.0);
        for (d, a) in [(0.0, 0.0), (1.0, 0.2), (1.5, 0.35), (2.0, 0.5), (3.0, 0.6), (5.0, 0.6), (9.0, 1.1), (10.0, 1.6)]
        {
            assert!((at(d) - a).abs() < 1e-6, "A({d}) = {}, not {a}", at(d));
        }
        let mut last = 0.0;
        for i in 0..1200 {
            let a = at(i as f32 * 0.01);
            assert!(a >= last && a - last < 0.011, "monotone and without jumps at {i}");
            last = a;
        }
    }

    #[test]
    fn equal_distances_that_rounding_parts_absorb_as_one() {
        let part = f32::EPSILON;
        let one = lists(1, &[(0, 1.0, 0.9)]);
        let many = lists(1, &[(0, 1.0, 0.3), (0, 1.0 + part, 0.3), (0, 1.0 + 2.0 * part, 0.3)]);
        for i in 0..400 {
            let d = i as f32 * 0.005;
            let a = absorbance(&one, 0, d, 0.5);
            let b = absorbance(&many, 0, d, 0.5);
            assert!((a - b).abs() < 1e-6, "A({d}) = {a} or {b}");
        }
    }

    #[test]
    fn windows_of_entries_absorb_as_each_of_them_does() {
        // Lists of all lengths, so that windows end anywhere in them, and one of thousands, in many ranges of cells.
        let unit = |i: u64, sample: u64| splat_core::rng::unit_f32(9, 1, i, sample);
        let lengths: Vec<u64> = (0..400).map(|cell| if cell == 77 { 10_000 } else { cell % 45 }).collect();
        let entries: Vec<(u32, f32, f32)> = lengths
            .iter()
            .zip(0..)
            .flat_map(|(n, cell)| (0..*n).map(move |i| (cell, 1.0 + unit(i, u64::from(cell)), 1.0 / *n as f32)))
            .collect();
        let lists = lists(lengths.len(), &entries);
        let mut of_cell = vec![Vec::new(); lengths.len()];
        entries.iter().for_each(|(cell, d, a)| of_cell[*cell as usize].push((f64::from(*d), f64::from(*a))));
        for (cell, of_cell) in (0..).zip(&of_cell) {
            for i in 0..40 {
                let d = 0.8 + i as f32 * 0.04;
                let ramp = [0.02, 0.1, 0.7][i % 3];
                let share = |at: f64| ((f64::from(d) - at) / f64::from(2.0 * ramp) + 0.5).clamp(0.0, 1.0);
                let exact: f64 = of_cell.iter().map(|(at, a)| a * share(*at)).sum();
                let a = f64::from(absorbance(&lists, cell, d, ramp));
                assert!((a - exact).abs() < 2e-6, "cell {cell}: A({d}) = {a}, not {exact}");
            }
        }
    }

    #[test]
    fn surfaces_are_steps_behind_their_distance() {
        let lists = lists(1, &[(0, 1.0, 0.4), (0, 2.0, 0.2)]);
        for (d, a) in [(0.5, 0.0), (1.0, 0.0), (1.001, 0.4), (2.0, 0.4), (7.0, 0.6)] {
            let [begin, ..] = lists.places(&[[lists.span(0); 4]], &[[d; 4]], 1, |entry, d| entry < d)[0];
            assert!((steps(lists.list(0), begin, d)[0] - a).abs() < 1e-6);
        }
    }

    #[test]
    fn four_searches_at_once_find_what_each_finds() {
        let lengths = [0, 1, 2, 3, 7, 64, 0, 200, 199, 5, 128, 1];
        let entries: Vec<(u32, f32, f32)> =
            (0..).zip(lengths).flat_map(|(cell, n)| (0..n).map(move |i| (cell, 1.0 + i as f32, 0.1))).collect();
        let lists = lists(lengths.len(), &entries);
        for cells in [[0, 1, 2, 3], [4, 5, 6, 7], [8, 9, 10, 11], [6, 11, 0, 10]] {
            for step in 0..420 {
                let bounds = [0, 1, 2, 3].map(|k: u32| 0.5 * (step + k) as f32);
                let spans = cells.map(|cell| lists.span(cell));
                let [found] = lists.places(&[spans], &[bounds], 1, |d, bound| d < bound);
                for (found, k) in found.into_iter().zip(0..) {
                    let list = lists.list(cells[k]);
                    let before = list.distance().partition_point(|d| *d < bounds[k]);
                    assert!((found..=found + ENOUGH).contains(&before), "{found} for {before}");
                    assert_eq!(steps(list, found, bounds[k]), list.total_of(before));
                }
            }
        }
    }
}
