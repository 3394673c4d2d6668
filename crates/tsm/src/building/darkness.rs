//! Deposits that end in each cell where it is dark.
//!
//! A list ends at the visible limit. Casters that seem to be lit leave their entries first. Where these reach the limit in a cell, nothing that lies behind
//! the farthest of them would be kept, so the other casters leave nothing there: in a thick medium most leave no entry at all.
//! Lists are the same to the bit, whichever casters came first.

use crate::table::{Parted, Ranges};
use rayon::prelude::*;

/// Room for what sums in single precision lose: a cell counts as dark a hundredth later than its list ends.
const SURE: f32 = 1.01;

/// Absorbance of each cell so far, and behind which distance it takes no more.
pub(crate) struct Darkness<const C: usize> {
    ranges: Ranges,
    limit: f32,
    sums: Vec<Sum<C>>,
    /// Distance behind which a cell takes no entries of media: that of its opaque disc, or where it is dark.
    pub(crate) ends: Vec<f32>,
}

/// The entries of a cell so far.
#[derive(Clone, Copy)]
struct Sum<const C: usize> {
    absorbance: [f32; C],
    farthest: f32,
}

impl<const C: usize> Darkness<C> {
    /// All cells in the light; `opaque` has the distance of the nearest opaque disc of each, or is empty.
    pub(crate) fn new(ranges: Ranges, opaque: &[f32], limit: f32) -> Self {
        let cells = ranges.cells();
        let ends = if opaque.is_empty() { vec![f32::INFINITY; cells] } else { opaque.to_vec() };
        let nothing = Sum { absorbance: [0.0; C], farthest: 0.0 };
        Self { ranges, limit: SURE * limit, sums: vec![nothing; cells], ends }
    }

    /// Adds the entries of a round.
    pub(crate) fn add(&mut self, parts: &[(Parted<C>, Parted<C>)]) {
        let cells = self.ranges.cells_of_a_range();
        let limit = self.limit;
        let ranges = self.sums.par_chunks_mut(cells).zip(self.ends.par_chunks_mut(cells));
        ranges.enumerate().for_each(|(range, (sums, ends))| {
            let first = range * cells;
            for (media, _) in parts {
                let entries = media.range(range);
                let distances = &media.distances()[entries.clone()];
                let absorbances = &media.absorbances()[entries.clone()];
                for ((cell, distance), absorbance) in media.cells()[entries].iter().zip(distances).zip(absorbances) {
                    let at = *cell as usize - first;
                    let sum = &mut sums[at];
                    // Behind its end nothing of it is kept, so that it must not move farther.
                    if *distance > ends[at] {
                        continue;
                    }
                    (0..C).for_each(|channel| sum.absorbance[channel] += absorbance[channel]);
                    sum.farthest = sum.farthest.max(*distance);
                }
            }
            for (sum, end) in sums.iter().zip(ends) {
                if sum.absorbance.iter().all(|absorbance| *absorbance >= limit) {
                    *end = end.min(sum.farthest);
                }
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use crate::building::caster::Casters;
    use crate::building::deposits::deposit_all;
    use crate::mapping::with_mapping;
    use crate::planning::lit::{Lit, Rounds, Slabs};
    use crate::planning::plan::plan;
    use crate::planning::survey::Survey;
    use crate::shadow_map::head;
    use crate::table::{Lists, Ranges};
    use crate::{MappingChoice, Params, Resolution, Scene};
    use splat_core::glam::{DVec3, Vec3};
    use splat_core::{Cloud, Light, LightShape, Material, Progress, Splat, SplatKind, rng};

    /// A thick ball, a thin one before it, a pane and an opaque disc within.
    fn cloud(splats: u64) -> Cloud {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..splats {
            let number = |k| rng::unit_f32(23, 0, i, k);
            let at = Vec3::new(number(0) - 0.5, number(1) - 0.5, number(2) - 0.5);
            let is_thin = i % 5 == 0;
            let position = if is_thin { at + Vec3::Y * 1.5 } else { at };
            // Some are large, and some so small that they cover a part of a cell.
            let radius = if i % 97 == 0 { 0.25 } else { 0.01 + 0.05 * number(3) };
            let cross_section = radius * radius * if is_thin { 0.01 } else { 2.0 };
            let material = (i % 3) as u16;
            cloud.push(&Splat { position, radius, cross_section, material, ..Splat::default() });
        }
        for (kind, height) in [(SplatKind::Surface, 0.8), (SplatKind::Opaque, 0.0)] {
            let position = Vec3::new(0.1, height, 0.0);
            let [radius, cross_section] = [0.3, 0.1];
            cloud.push(&Splat { position, radius, cross_section, kind, normal: Vec3::Y, ..Splat::default() });
        }
        cloud
    }

    /// Entries without and with an end at darkness, of lists that are the same.
    fn entries(cloud: &Cloud, materials: &[Material], light: LightShape, mapping: MappingChoice) -> [u64; 2] {
        let scene = Scene { materials, ..Scene::from(cloud) };
        let params = Params { mapping, resolution: Resolution::Cells(40), ..Params::default() };
        let casters = Casters::new(&scene, &params);
        let survey = Survey::new(&casters);
        let light = Light { shape: light, intensity: [1.0; 3] };
        let mut plan = plan(&casters, &survey, &light, &params.limits).unwrap();
        assert!(plan.lit.rounds.is_none(), "so few splats need no look");
        let (rounds, _) = Rounds::new(&casters, &plan.frame, Slabs::new(&survey, &plan.frame, plan.table.clone()));
        let table = plan.table.clone();
        with_mapping!(&table, m => {
            let opaque = head(&casters, &survey, &plan, m).opaque;
            let ranges = Ranges::new(opaque.len(), 1e5);
            let mut lists = |rounds| {
                plan.lit = Lit { rounds, ..plan.lit };
                let made = deposit_all::<_, 3>(&casters, &plan, m, &opaque, ranges, &Progress::new());
                made.unwrap().map(|parts| Lists::new(&parts, ranges, params.absorbance_limit()))
            };
            let whole = lists(None);
            let ended = lists(Some(rounds));
            for cell in 0..opaque.len() as u32 {
                for (whole, ended) in whole.iter().zip(&ended) {
                    assert_eq!(whole.list(cell).distance(), ended.list(cell).distance(), "cell {cell}");
                    assert_eq!(whole.list(cell).total(), ended.list(cell).total(), "cell {cell}");
                }
            }
            [&whole, &ended].map(|lists| lists[0].entries())
        })
    }

    #[test]
    fn lists_that_end_at_darkness_are_those_of_all_entries() {
        let cloud = cloud(20_000);
        let coloured = Material { extinction_rgb: [1.0, 0.4, 0.7], ..Material::default() };
        let materials = [Material::default(), coloured, Material::default()];
        let above = LightShape::Point { position: DVec3::new(0.3, 6.0, 0.2) };
        let within = LightShape::Point { position: DVec3::new(0.0, 1.2, 0.0) };
        let sun = LightShape::Directional { direction: DVec3::new(0.2, -1.0, 0.1).normalize() };
        let cases = [
            (sun, MappingChoice::Auto),
            (above, MappingChoice::Planar),
            (above, MappingChoice::PolarAzimuth),
            (above, MappingChoice::Octahedral),
            (within, MappingChoice::Octahedral),
        ];
        for (light, mapping) in cases {
            let [whole, ended] = entries(&cloud, &materials, light, mapping);
            assert!(ended < whole, "{light:?}, {mapping:?}: {ended} of {whole}");
            println!("{mapping:?}: {ended} of {whole}");
        }
    }
}
