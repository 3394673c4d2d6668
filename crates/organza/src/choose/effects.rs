//! The effects that a scene calls for, each with its reason and the bound of what it could change: a file for each kind, and this table of them.

mod absorption;
mod bending;
mod candidates;
mod caustics;
mod color;
mod dispersion;
mod gain;
mod gradients;
mod interreflection;
mod layers;
mod light;
mod object;
mod opaque;
mod scatter;
mod shadow;
mod soft;
mod translucency;
mod work;

use super::passes::passes;
use super::row as row_of_technique;
use crate::cost::EffectWork;
use crate::plan::{Bound, Plan};
use crate::scene::{EffectKind, SwitchedEffect};
use crate::shadows::CUT_SHARE;
use crate::statistics::{ObjectFacts, Statistics};
use candidates::{Candidate, Choice, spend};
pub(crate) use work::{CausedMap, CausedObject, CausedWork};

/// A kind of effects.
pub(crate) struct Row {
    pub(crate) kind: EffectKind,
    /// What it is, in a few words.
    pub(crate) what: &'static str,
    /// What a picture without it shows instead.
    pub(crate) without: &'static str,
    /// The effects of this kind: whether a scene calls for each of them, or lets the bound decide. Asked of the plan so far.
    candidates: fn(&Statistics, &Plan) -> Vec<Candidate>,
    /// Takes the decisions into the plan, one for each candidate.
    take: fn(&mut Plan, &[Candidate], &[bool]),
    /// The work that runs for the effect of this label alone; `None` where it is part of passes that run in any case.
    work: Option<fn(&CausedWork<'_>, &str) -> EffectWork>,
}

/// Every kind, in the order in which the tolerance is spent: what costs most goes first, and what hangs on another effect comes after it.
pub(crate) static TABLE: [&Row; 15] = [
    &object::ROW,
    &light::ROW,
    &shadow::ROW,
    &soft::ROW,
    &scatter::ROW,
    &bending::ROW,
    &dispersion::ROW,
    &absorption::ROW,
    &color::ROW,
    &gradients::ROW,
    &interreflection::ROW,
    &caustics::ROW,
    &translucency::ROW,
    &opaque::ROW,
    &layers::ROW,
];

/// Chooses effects and passes.
pub(crate) fn plan(statistics: &Statistics) -> Plan {
    let names: Vec<&str> = statistics.techniques.iter().map(|technique| technique.name()).collect();
    let mut plan =
        Plan { technique: names.join(" and "), techniques: statistics.techniques.clone(), ..Plan::default() };
    // What ends lists of shadow maps takes the rest.
    let mut allowance = statistics.tolerance * (1.0 - CUT_SHARE) - statistics.spent;
    for row in TABLE {
        let candidates = (row.candidates)(statistics, &plan);
        let spent = spend(&candidates, allowance);
        allowance -= spent.bound;
        (row.take)(&mut plan, &candidates, &spent.is_on);
        let told = candidates.iter().zip(&spent.is_on).map(|(candidate, is_on)| candidate.told(row, *is_on));
        plan.effects.extend(told);
    }
    plan.objects = statistics.planned.clone();
    let of_objects = |kind: EffectKind| statistics.objects.iter().any(|object| object.has_colored(kind));
    let by_channel = statistics.counts.colored_extinction
        || of_objects(EffectKind::Dispersion)
        || of_objects(EffectKind::Absorption);
    plan.optical_depth_planes = if by_channel { 3 } else { 1 };
    plan.passes = passes(statistics, &plan.shadow_maps);
    plan
}

/// The most that a displayed pixel changes without an object that shows no more than this radiance, and of which each ray of the view and of lights
/// takes no more than this share; `None` where it is not known.
pub(crate) fn changed_without(opacity: f64, shown: f64, statistics: &Statistics) -> Option<f64> {
    object::change(opacity, opacity, shown, statistics)
}

/// The most that a displayed pixel changes without the colour of such an object, where the optical depth of a channel changes by this along each of those
/// rays; `None` where it is not known.
pub(crate) fn changed_without_color(stretched: f64, shown: f64, statistics: &Statistics) -> Option<f64> {
    color::change(stretched, stretched, shown, statistics)
}

/// Takes effects of objects into a plan: those that are left out by their bound.
fn leave_out(kind: EffectKind, plan: &mut Plan, candidates: &[Candidate], is_on: &[bool]) {
    let decided = candidates.iter().zip(is_on);
    let left_out = decided.filter(|(candidate, is_on)| matches!(candidate.choice, Choice::Open { .. }) && !**is_on);
    plan.left_out.extend(left_out.map(|(candidate, _)| SwitchedEffect {
        kind,
        label: candidate.label.clone(),
        is_on: false,
    }));
}

/// The effects of a kind that hang on objects: one for each object that causes the effect, and one for each object on which the scene switches it off.
/// `of_object` is asked for what the bound decides of an object whose effect is not switched.
fn object_candidates(
    row: &Row,
    statistics: &Statistics,
    absent: &str,
    of_object: impl Fn(&ObjectFacts) -> Open,
) -> Vec<Candidate> {
    let switched_off = statistics.switched.iter().filter(|effect| effect.kind == row.kind && !effect.is_on);
    let off = switched_off.map(|effect| Candidate::switched(&effect.label, false, row.without, Bound::Unknown));
    let causes = statistics.objects.iter().filter(|object| object.causes.contains(&row.kind));
    let caused = causes.map(|object| {
        let Open { bound, on, off } = of_object(object);
        let is_switched = SwitchedEffect::find(&statistics.switched, row.kind, &object.name).is_some();
        // What else has the material would change with it.
        let has_it_beside =
            |other: &ObjectFacts| other.material == object.material && !other.causes.contains(&row.kind);
        let is_tied = object.material.is_none() || statistics.objects.iter().any(has_it_beside);
        let bound =
            if statistics.objects_stay || row.kind != EffectKind::Object && is_tied { Bound::Unknown } else { bound };
        let one = if is_switched {
            Candidate::switched(&object.name, true, row.without, bound)
        } else {
            Candidate::new(&object.name, Choice::Open { bound, on, off })
        };
        // What a material says goes for all objects that have it.
        Candidate { group: object.material.filter(|_| row.kind != EffectKind::Object), ..one }
    });
    let candidates: Vec<Candidate> = caused.chain(off).collect();
    if candidates.is_empty() { vec![Candidate::absent(absent)] } else { candidates }
}

/// What the bound of an effect of an object decides.
struct Open {
    bound: Bound,
    /// Why it is called for, if it is.
    on: String,
    /// Why it is left out, if it is.
    off: String,
}

/// For effects that the plan only reports.
fn take_nothing(_: &mut Plan, _: &[Candidate], _: &[bool]) {}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pass;
    use crate::scene::Technique;
    use crate::statistics::LightStatistics;
    use splat_core::shade::Census;

    fn scene() -> Statistics {
        let light = LightStatistics {
            label: "0".into(),
            casts_shadows: true,
            points: 1,
            radiance: f64::INFINITY,
            opacity: 1.0,
            ..LightStatistics::default()
        };
        Statistics {
            counts: Census {
                translucent: 10,
                opaque: 5,
                receivers: 15,
                casters: 15,
                opaque_casters: 5,
                ..Census::default()
            },
            lights: vec![light],
            tolerance: 1.0 / 255.0,
            techniques: vec![Technique::Points],
            translucent_by: vec![(Technique::Points, [10, 0]), (Technique::Particles, [10, 0])],
            ..Statistics::default()
        }
    }

    fn has(plan: &Plan, name: &str) -> bool {
        plan.passes.iter().any(|p| p.name == name)
    }

    #[test]
    fn x7_no_shadow_map_without_caster_receiver_or_light() {
        assert!(has(&plan(&scene()), pass::SHADOW_MAP));
        for change in [
            |s: &mut Statistics| s.counts.casters = 0,
            |s: &mut Statistics| s.counts.receivers = 0,
            |s: &mut Statistics| s.lights[0].is_dark = true,
            |s: &mut Statistics| s.lights[0].casts_shadows = false,
            |s: &mut Statistics| s.lights.clear(),
        ] {
            let mut statistics = scene();
            change(&mut statistics);
            assert!(!has(&plan(&statistics), pass::SHADOW_MAP));
        }
    }

    #[test]
    fn every_point_of_a_light_gets_a_map() {
        let mut s = scene();
        let light = LightStatistics { points: 3, ..s.lights[0].clone() };
        let dull = LightStatistics { label: "1".into(), casts_shadows: false, ..light.clone() };
        s.lights = vec![light, dull];
        let plan = plan(&s);
        assert_eq!(plan.shadow_maps, [true, false]);
        assert_eq!(plan.passes.iter().filter(|p| p.name == pass::SHADOW_MAP).count(), 3);
        let shadow = plan.effects.iter().find(|effect| effect.name == "shadow.0").unwrap();
        assert!(shadow.reason.contains("receive it, from 3 points"), "{}", shadow.reason);
    }

    #[test]
    fn x7_faint_casters_are_skipped_while_their_bounds_fit_the_tolerance() {
        let mut s = scene();
        s.counts.opaque_casters = 0;
        s.counts.caster_optical_depth = 0.006;
        let maps = |radiances: [f64; 2]| {
            let mut s = s.clone();
            s.lights = radiances.map(|radiance| LightStatistics { radiance, ..s.lights[0].clone() }).to_vec();
            let plan = plan(&s);
            let skipped: f64 = plan.effects.iter().filter(|e| !e.called_for).filter_map(|e| e.bound.number()).sum();
            assert!(skipped <= s.tolerance);
            plan.shadow_maps
        };
        // White falls by 0.0026 with each, and by more than 1/255 with both. Of two that are alike none goes: the order of a file would choose.
        assert_eq!(maps([1.0, 1.0]), [true, true]);
        assert_eq!(maps([0.02, 1.0]), [false, true]);
        assert_eq!(maps([1.0, 0.02]), [true, false]);
        assert_eq!(maps([0.02, 0.02]), [true, true]);
    }

    #[test]
    fn light_between_surfaces_lacks_where_these_are_bright() {
        let told = |reflectance: f64, brightest: f64| {
            let mut s = scene();
            s.lights[0].radiance = 1.0;
            s.reflectance = reflectance;
            s.brightest = brightest;
            plan(&s).effects.into_iter().find(|effect| effect.kind == Some(EffectKind::Interreflection)).unwrap()
        };
        let white = told(1.0, 1.0);
        assert!(white.is_lacking && white.bound == Bound::Unknown);
        let grey = told(0.2, 0.01);
        assert!(grey.is_lacking && grey.bound.number().is_some_and(|bound| (bound - 12.92 * 0.0025).abs() < 1e-12));
        let dark = told(1e-4, 1.0);
        assert!(!dark.is_lacking && !dark.called_for && dark.bound.number().is_some_and(|bound| bound < 0.0013));
        assert!(told(0.0, 1.0).is_absent);
        assert!(plan(&scene()).effects.iter().any(|effect| effect.name == "caustics" && effect.is_absent));
    }

    #[test]
    fn x7_only_the_passes_for_what_is_there() {
        let mut s = scene();
        s.translucent_by.clear();
        assert!(!has(&plan(&s), pass::SORT) && !has(&plan(&s), pass::SPLAT) && has(&plan(&s), pass::OPAQUE));
        s = scene();
        s.counts.opaque = 0;
        assert!(has(&plan(&s), pass::SORT) && !has(&plan(&s), pass::OPAQUE));
        assert_eq!(plan(&s).optical_depth_planes, 1);
        s.counts.colored_extinction = true;
        assert_eq!(plan(&s).optical_depth_planes, 3);
        s.techniques = vec![Technique::Particles];
        let only = plan(&s);
        assert!(has(&only, pass::PARTICLES) && ![pass::SORT, pass::PROJECT, pass::SPLAT].iter().any(|p| has(&only, p)));
    }

    /// The text of a file of the repository.
    fn text_of(path: &str) -> String {
        std::fs::read_to_string(std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)).unwrap()
    }

    #[test]
    fn every_kind_of_effects_has_words_a_page_and_a_proof() {
        let page = text_of("docs/scene.md");
        let proofs = text_of("tests/tests/light_effects.rs") + &text_of("tests/tests/effects.rs");
        assert!(EffectKind::ALL.iter().all(|kind| TABLE.iter().filter(|row| row.kind == *kind).count() == 1));
        for row in TABLE {
            let word = row.kind.word();
            assert!(!row.what.is_empty() && !row.without.is_empty(), "{word} has no words");
            let name = row.kind.name("NAME");
            assert!(page.contains(&format!("| `{name}` |")), "docs/scene.md does not list `{name}`");
            let is_switched = row.kind.fixed_because().is_none();
            assert!(!is_switched || proofs.contains(&format!("fn x7_effect_{word}_")), "{word} has no proof");
        }
    }
}
