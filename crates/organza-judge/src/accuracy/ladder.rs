//! Settings of one scene from fast to exact, for a slider: the knobs of its techniques, turned together to both sides of the stated settings.

use super::{Facts, Knob, Options, Request, Step, changes, points, sheets, surfels};
use organza::scene::{Reconstruction, Scene, Technique};

/// Positions to each side of the settings that the scene states.
pub const RUNGS_ASIDE: i32 = 3;

/// Knobs that no setting of a report turns together with others, and a ladder does: more splats and more sets are more work for a smaller error.
const ALONE: [&str; 2] = ["share of splats", "repeat level"];

/// The knob of kernels that are splatted, which turned would have a volume splatted that the plan gathers.
const OF_SPLATTED: &str = "kernel sections";

/// A setting of a ladder.
#[derive(Debug, Clone, PartialEq)]
pub struct Rung {
    /// −[`RUNGS_ASIDE`] (fastest) to [`RUNGS_ASIDE`] (most exact); 0 is what the scene states.
    pub step: i32,
    /// The knobs that are turned, each with its position.
    pub words: Vec<String>,
    /// The picture to draw.
    pub request: Request,
}

impl Rung {
    /// The arguments of `--set` on the command line, a text for each setting.
    pub fn sets(&self, stated: &Scene) -> Vec<String> {
        changes(stated, &self.request).iter().filter_map(super::Change::set).collect()
    }
}

/// Knobs of all techniques that draw a settled scene, each once. `slab_width` is as for [`sheets`].
pub fn knobs_of(scene: &Scene, techniques: &[Technique], facts: &Facts, slab_width: Option<f64>) -> Vec<Knob> {
    let options = Options { quick: false, finer: 0, seed: 0 };
    let mut knobs: Vec<(Technique, Knob)> = Vec::new();
    for technique in techniques {
        let found = match technique {
            Technique::Points | Technique::Reference => points(scene, facts, &options).knobs,
            Technique::Sheets => sheets(scene, slab_width, facts, &options).knobs,
            Technique::Surfels => surfels(scene, facts, &options).knobs,
            Technique::Particles => super::particles(scene, facts, &options).map_or_else(|_| Vec::new(), |s| s.knobs),
            Technique::Auto => Vec::new(),
        };
        let is_splatted = scene.render.sheets.reconstruction == Reconstruction::Splat;
        let is_turned =
            |knob: &Knob| (knob.joint || ALONE.contains(&knob.name)) && (is_splatted || knob.name != OF_SPLATTED);
        knobs.extend(found.into_iter().filter(is_turned).map(|knob| (*technique, knob)));
    }
    // Opaque surfaces have points' splats whatever draws the rest: what a scene shares is turned once.
    let is_first = |rank: usize| {
        let (_, knob) = &knobs[rank];
        let acts_alike = |other: &Knob| other.name == knob.name && sets_alike(scene, other, knob);
        !knobs[..rank].iter().any(|(_, other)| acts_alike(other))
    };
    let kept: Vec<usize> = (0..knobs.len()).filter(|rank| is_first(*rank)).collect();
    let mut knobs: Vec<Option<Knob>> = knobs.into_iter().map(|(_, knob)| Some(knob)).collect();
    kept.into_iter().filter_map(|rank| knobs[rank].take()).collect()
}

/// Whether two knobs of one name turn the same setting.
fn sets_alike(scene: &Scene, a: &Knob, b: &Knob) -> bool {
    let turned = |knob: &Knob| knob.steps.first().map(|step| turned(&whole(scene), knob, step));
    turned(a) == turned(b)
}

fn whole(scene: &Scene) -> Request {
    Request { scene: scene.clone(), oversample: 1, packed: false }
}

fn turned(request: &Request, knob: &Knob, step: &Step) -> Request {
    let mut request = request.clone();
    (knob.set)(&mut request, three_digits(step.value));
    request
}

/// The ladder of a settled scene, from the fastest setting to the most exact; settings that nothing changes are left out.
pub fn ladder(scene: &Scene, knobs: &[Knob]) -> Vec<Rung> {
    let base = whole(scene);
    let mut rungs = vec![Rung { step: 0, words: Vec::new(), request: base.clone() }];
    let positions: Vec<(&Knob, Positions<'_>)> =
        knobs.iter().filter_map(|knob| Some((knob, Positions::new(&base, knob)?))).collect();
    for aside in 1..=RUNGS_ASIDE {
        for side in [-1, 1] {
            let mut request = base.clone();
            let mut words = Vec::new();
            for (knob, positions) in &positions {
                let Some(step) = positions.at(side * aside) else { continue };
                request = turned(&request, knob, step);
                words.push(format!("{}: {}", knob.name, step.label));
            }
            if rungs.iter().all(|rung| rung.request != request) {
                rungs.push(Rung { step: side * aside, words, request });
            }
        }
    }
    rungs.sort_by_key(|rung| rung.step);
    rungs
}

/// Positions of a knob that a scene can state, on both sides of its own.
struct Positions<'k> {
    /// The next to the scene's own first.
    coarser: Vec<&'k Step>,
    finer: Vec<&'k Step>,
}

impl<'k> Positions<'k> {
    /// `None` for a knob whose own position is not known.
    fn new(base: &Request, knob: &'k Knob) -> Option<Self> {
        let scene_size = knob.scene_size?;
        let can_be_stated = |step: &&Step| {
            let request = turned(base, knob, step);
            let is_drawn = request.oversample == base.oversample && request.packed == base.packed;
            is_drawn && changes(&base.scene, &request).iter().all(|change| change.value.is_some())
        };
        let mut steps: Vec<&Step> = knob.steps.iter().chain(&knob.ends).filter(can_be_stated).collect();
        steps.sort_by(|a, b| size(b).total_cmp(&size(a)));
        steps.dedup_by(|a, b| a.value == b.value);
        // Sizes that are as good as the scene's own are no step.
        let coarser = steps.iter().rev().copied().filter(|step| size(step) > 1.05 * scene_size).collect();
        let finer = steps.into_iter().filter(|step| size(step) < 0.95 * scene_size).collect();
        Some(Self { coarser, finer })
    }

    /// The position of a rung; `None` for the scene's own.
    fn at(&self, step: i32) -> Option<&'k Step> {
        let rungs = RUNGS_ASIDE as usize;
        let side = if step < 0 { &self.coarser } else { &self.finer };
        // Far from the scene's own little time is left to gain; the most exact rung is the end. A knob with fewer positions than rungs keeps the
        // scene's own for longer.
        let length = if step < 0 { side.len().min(rungs) } else { side.len() };
        let count = step.unsigned_abs() as usize * length / rungs;
        count.checked_sub(1).map(|rank| side[rank])
    }
}

/// The size of a position among sizes: what has none is exact.
fn size(step: &Step) -> f64 {
    step.size.unwrap_or(0.0)
}

/// A number as a person writes it.
fn three_digits(number: f64) -> f64 {
    if number == 0.0 || !number.is_finite() || number.fract() == 0.0 {
        return number;
    }
    let unit = libm::pow(10.0, libm::floor(libm::log10(number.abs())) - 2.0);
    let rounded = libm::round(number / unit) * unit;
    // The product has digits that nobody wrote.
    format!("{rounded:.12e}").parse().unwrap_or(rounded)
}

#[cfg(test)]
mod tests {
    use super::*;
    use organza::scene::{LoadOptions, Override, parse};

    const TEXT: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\n[[object]]\nname = 'fog'\n\
                        medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.1 }\n\
                        [render]\ntechnique = 'points'\nantialias = 2\n";

    fn scene(sets: &[String]) -> Scene {
        let overrides = sets.iter().map(|set| Override::parse(set).unwrap()).collect();
        parse("s.toml".as_ref(), TEXT.as_bytes(), &LoadOptions { overrides, ..LoadOptions::default() }).unwrap()
    }

    const FACTS: Facts =
        Facts { slice_thickness: Some(0.012_345), has_maps: true, cells: Some(512), bytes_per_splat: None };

    fn rungs(scene: &Scene, techniques: &[Technique]) -> Vec<Rung> {
        ladder(scene, &knobs_of(scene, techniques, &FACTS, Some(0.05)))
    }

    #[test]
    fn each_rung_is_as_fine_as_the_one_before_or_finer() {
        let scene = scene(&[]);
        for technique in [Technique::Points, Technique::Sheets, Technique::Particles, Technique::Surfels] {
            let knobs = knobs_of(&scene, &[technique], &FACTS, Some(0.05));
            for knob in &knobs {
                let base = whole(&scene);
                let Some(positions) = Positions::new(&base, knob) else { continue };
                let scene_size = knob.scene_size.unwrap();
                let of_rung = |step| positions.at(step).map_or(scene_size, size);
                let sizes: Vec<f64> = (-RUNGS_ASIDE..=RUNGS_ASIDE).map(of_rung).collect();
                assert!(sizes.windows(2).all(|pair| pair[1] <= pair[0]), "{}: {sizes:?}", knob.name);
                assert_eq!(sizes[3], scene_size);
            }
            let steps: Vec<i32> = rungs(&scene, &[technique]).iter().map(|rung| rung.step).collect();
            assert!(steps.contains(&0) && steps.contains(&-3) && steps.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }

    #[test]
    fn a_rung_is_the_scene_with_what_it_says() {
        let scene = scene(&[]);
        let rungs = rungs(&scene, &[Technique::Points]);
        // Two positions of samples are finer: the first of three would be the scene's own.
        assert_eq!(rungs.iter().map(|rung| rung.step).collect::<Vec<_>>(), [-3, -2, -1, 0, 2, 3]);
        for rung in &rungs {
            let sets = rung.sets(&scene);
            let mut said = self::scene(&sets).render;
            // What is set is stated; a knob only turns it.
            said.stated = rung.request.scene.render.stated;
            assert_eq!(said, rung.request.scene.render, "{sets:?}");
            assert_eq!(sets.is_empty(), rung.step == 0);
        }
        let [fastest, .., exact] = &rungs[..] else { panic!("several rungs") };
        assert_eq!((fastest.request.scene.render.antialias, exact.request.scene.render.antialias), (1, 8));
        assert_eq!((fastest.request.scene.render.splat_share, exact.request.scene.render.splat_share), (0.125, 1.0));
        assert!(exact.request.scene.render.points.exact && !fastest.request.scene.render.points.exact);
        // The scene orders splats exactly; its thickness would be that of the fact, and twice that, with three digits.
        assert_eq!(fastest.request.scene.render.points.slice_thickness, Some(0.0247));
    }

    #[test]
    fn what_two_techniques_share_is_turned_once() {
        let scene = scene(&[]);
        let knobs = knobs_of(&scene, &[Technique::Points, Technique::Sheets], &FACTS, Some(0.05));
        let count = |name: &str| knobs.iter().filter(|knob| knob.name == name).count();
        // Pixels have one number of samples; either technique has a cut of its own.
        assert_eq!([count("samples"), count("transmittance cut"), count("slab width")], [1, 2, 1]);
        // What the plan gathers stays gathered.
        assert_eq!(count(OF_SPLATTED), 0);
    }

    #[test]
    fn numbers_have_three_digits() {
        assert_eq!([0.790_080, 1.0, 0.0, 512.0, 0.015_625].map(three_digits), [0.79, 1.0, 0.0, 512.0, 0.0156]);
    }
}
