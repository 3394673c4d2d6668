//! Counted work of a frame, before it is drawn, and the keys of its scene that would change it.

use crate::choose::{CausedMap, CausedObject, CausedWork, row, technique_of};
use crate::cost::extent::Extent;
use crate::cost::{
    Change, Count, CountedPass, ENTRIES_PER_SPLAT, Item, Prediction, Translucent, before_reading, joined, samples,
    shadow_map,
};
use crate::frame::Frame;
use crate::load::own::Own;
use crate::scene::{LightPoint, SceneObject, Technique};
use crate::technique::{EVERYWHERE, Fold, OwnWork, TABLE};
use crate::{RenderOptions, ShadowTable, SplatCount, pass, stage};
use splat_core::SplatKind;
use splat_core::raster::{self, Expected};
use std::ops::Range;

/// Share of the opaque splats in view that are nearest somewhere: closed surfaces show half of theirs, and hide others behind them. Between 0.21 and
/// 0.44 in pictures of `scenes/`.
const NEAREST: f64 = 0.4;

/// Splats and objects in view of a loaded scene, counted once for all predictions.
struct Seen {
    opaque: Opaque,
    /// By each technique of the plan.
    translucent: Vec<BySeen>,
    ranges: f64,
}

/// Opaque splats, by the time that their fragments take.
#[derive(Clone, Copy)]
struct Opaque {
    /// Of the usual footprints.
    plain: Expected,
    /// Of footprints that are images.
    images: Expected,
    /// Discs that rays meet.
    met: Expected,
}

impl Opaque {
    fn splats(&self) -> f64 {
        self.plain.splats + self.images.splats + self.met.splats
    }
}

/// What one technique draws.
#[derive(Clone, Copy)]
struct BySeen {
    technique: Technique,
    splats: Expected,
    own_work: OwnWork,
}

impl Seen {
    /// That of a frame whose techniques have been prepared or checked, in these ranges of depth.
    fn new(frame: &Frame<'_>, folds: &[Box<dyn Fold + '_>], ranges: &[Range<f32>]) -> Self {
        let of_each = frame.plan.techniques.iter().zip(folds);
        let translucent = of_each.map(|(technique, fold)| BySeen {
            technique: *technique,
            splats: translucent(frame, *technique),
            own_work: fold.own_work(ranges),
        });
        let translucent = translucent.collect();
        Self { opaque: opaque(frame), translucent, ranges: ranges.len() as f64 }
    }
}

/// The opaque splats in view, and the fragments of their footprints, about.
fn opaque(frame: &Frame<'_>) -> Opaque {
    let cloud = &frame.loaded.cloud;
    let footprints = &frame.loaded.footprints;
    let is_image = |i: usize| footprints.image(usize::from(cloud.footprint[i])).is_some();
    let is_met = |i: usize| frame.plan.exact[cloud.object[i] as usize];
    let expected = |is_one: &dyn Fn(usize) -> bool| {
        raster::expected(cloud, &frame.camera, |i| cloud.kind[i] == SplatKind::Opaque && is_one(i))
    };
    // Most scenes have none of the two.
    let has_images = (0..footprints.layers().len()).any(|footprint| footprints.image(footprint).is_some());
    let met = if frame.plan.exact.contains(&true) { expected(&is_met) } else { Expected::default() };
    let images = if has_images { expected(&|i| !is_met(i) && is_image(i)) } else { Expected::default() };
    Opaque { plain: expected(&|i| !is_met(i) && !is_image(i)), images, met }
}

/// The translucent splats of a technique in view, and the fragments of their footprints, about.
fn translucent(frame: &Frame<'_>, technique: Technique) -> Expected {
    let cloud = &frame.loaded.cloud;
    raster::expected(cloud, &frame.camera, |i| {
        let object = cloud.object[i] as usize;
        cloud.kind[i] != SplatKind::Opaque && frame.plan.by[object] == technique && !frame.plan.is_own[object]
    })
}

/// Passes that draw a frame, in the order of running.
fn of_frame(frame: &Frame<'_>, seen: &Seen) -> Vec<CountedPass> {
    let mut passes = light(frame);
    passes.extend(surfaces(frame, seen));
    passes
}

/// Shadow maps of lights, where they are not there from another frame, and the eye's.
fn light(frame: &Frame<'_>) -> Vec<CountedPass> {
    let plan = frame.plan;
    let maps = plan.shadow_maps_built();
    let built = if frame.has_maps() { 0 } else { maps };
    let map = |(rank, (table, _)): (usize, (&ShadowTable, &LightPoint))| {
        let stage = shadow_map(rank, maps, table.predicted.entries);
        CountedPass::new(pass::SHADOW_MAP, stage, cast(frame, &table.predicted))
    };
    let mut passes: Vec<CountedPass> = (1..=built).zip(tables(frame)).map(map).collect();
    // The eye's is another in each view, of media alone.
    let eye = |table: &ShadowTable| {
        let number = frame.loaded.cloud.len() as f64;
        let counts = [vec![Count::new(Item::CastSplat, number)], entries(&table.predicted)].concat();
        CountedPass::new(pass::EYE_MAP, stage::EYE_MAP.to_owned(), counts)
    };
    passes.extend(plan.eye_table.iter().map(eye));
    passes
}

/// The tables of all shadow maps of lights, each with its point.
fn tables<'b>(frame: &'b Frame<'_>) -> impl Iterator<Item = (&'b ShadowTable, &'b LightPoint)> {
    let with_points = |tables: &'b [Option<ShadowTable>]| tables.iter().zip(frame.light_points());
    let each = with_points(&frame.plan.shadow_tables).chain(with_points(&frame.plan.other_tables));
    each.filter_map(|(table, point)| Some((table.as_ref()?, point)))
}

/// Work of a shadow map of this table.
fn cast(frame: &Frame<'_>, table: &tsm::Prediction) -> Vec<Count> {
    let cloud = &frame.loaded.cloud;
    let opaque = cloud.kind.iter().filter(|kind| **kind == SplatKind::Opaque).count() as f64;
    let splats = vec![Count::new(Item::CastSplat, cloud.len() as f64 - opaque), Count::new(Item::OpaqueCaster, opaque)];
    [splats, entries(table)].concat()
}

/// Entries of a table, by the way that they are made.
fn entries(table: &tsm::Prediction) -> Vec<Count> {
    vec![Count::new(Item::ShadowEntry, table.entries), Count::new(Item::ShadowRay, table.rays)]
}

/// All passes behind the shadow maps.
fn surfaces(frame: &Frame<'_>, seen: &Seen) -> Vec<CountedPass> {
    let plan = frame.plan;
    let scene = frame.scene;
    let maps = plan.shadow_maps_built() as f64;
    let mut passes = Vec::new();
    let mut last = Vec::new();
    for by in &seen.translucent {
        let row = row(by.technique);
        let ranges = by.own_work.ranges.map_or(seen.ranges, |ranges| ranges as f64);
        let translucent = Translucent {
            splats: by.splats.splats,
            fragments: by.splats.fragments,
            own_work: by.own_work,
            ranges,
            any: plan.passes.iter().any(|p| row.steps.last().is_some_and(|step| step.pass == p.name)),
        };
        let mut repeats = (row.repeats)(scene);
        if ranges > 1.0 && !repeats.is_empty() {
            repeats += &format!(" in {ranges} ranges of depth");
        }
        let counted = |step: &crate::technique::Step| {
            CountedPass::new(step.pass, step.stage.to_owned(), (step.counts)(scene, &translucent))
        };
        let mut steps: Vec<CountedPass> = row.steps.iter().map(counted).collect();
        last.extend(steps.pop().map(|pass| CountedPass { repeats, rounds: seen.ranges as usize, ..pass }));
        passes.extend(steps);
    }
    let mut add = |pass, stage: &str, counts: Vec<Count>| passes.push(CountedPass::new(pass, stage.to_owned(), counts));
    let splats = frame.loaded.cloud.len() as f64;
    let groups = seen.translucent.iter().flat_map(|by| (row(by.technique).counts_groups)(scene, splats));
    add(pass::GROUP, stage::GROUP, groups.collect());
    // A technique whose pixels are lit alone needs neither.
    let is_planned = |pass: &str| plan.passes.iter().any(|planned| planned.name == pass);
    if is_planned(pass::PROJECT) {
        add(
            pass::PROJECT,
            stage::PROJECT,
            vec![Count::new(Item::ProjectedSplat, seen.opaque.splats() + drawn(frame, seen))],
        );
    }
    if is_planned(pass::SHADE) {
        let shaded = shaded(frame, seen);
        // Thick media look up the eye's map too, and share both over each cell.
        let of_eye = if plan.eye_table.is_some() { 2.0 } else { 0.0 };
        let look_ups = Count::new(Item::ShadowLookUp, shaded * (maps + of_eye));
        add(pass::SHADE, stage::SHADE, vec![Count::new(Item::ShadedSplat, shaded), look_ups]);
    }
    add(
        pass::OPAQUE,
        stage::OPAQUE,
        vec![
            Count::new(Item::OpaqueSplat, seen.opaque.splats()),
            Count::new(Item::OpaqueFragment, seen.opaque.plain.fragments),
            Count::new(Item::ImageFragment, seen.opaque.images.fragments),
            Count::new(Item::MetFragment, seen.opaque.met.fragments),
        ],
    );
    passes.extend(last);
    passes.push(CountedPass::new(pass::FINISH, stage::FINISH.to_owned(), finished(frame)));
    passes
}

/// Samples that become parts of pixels, before an environment where there is one.
fn finished(frame: &Frame<'_>) -> Vec<Count> {
    let samples = samples(frame.scene);
    let looked_up = if frame.loaded.images.environment.is_some() { samples } else { 0.0 };
    vec![Count::new(Item::FinishedSample, samples), Count::new(Item::EnvironmentSample, looked_up)]
}

/// The prediction of a frame in these ranges of depth, whose techniques have been prepared or checked: reading, conversion and drawing.
pub(crate) fn prediction(
    frame: &Frame<'_>,
    folds: &[Box<dyn Fold + '_>],
    ranges: &[Range<f32>],
    options: &RenderOptions,
) -> Prediction {
    let seen = Seen::new(frame, folds, ranges);
    let mut loading: Vec<CountedPass> =
        before_reading(frame.scene, &[]).into_iter().filter(|pass| pass.pass == pass::READ).collect();
    let count = |object: &SplatCount| Count::new(Item::of_conversion(object.conversion), object.predicted as f64);
    loading.push(conversion(frame.loaded.splats.iter().map(count)));
    // What techniques prepare is over when drawing begins.
    for row in frame.plan.techniques.iter().map(|technique| row(*technique)) {
        let counts = (row.counts_preparing)(frame.scene, frame.loaded);
        loading.extend(row.prepares.map(|pass| CountedPass::new(pass, pass.to_owned(), counts)));
    }
    let whole = || Seen::new(frame, folds, &[EVERYWHERE]);
    let changes = [automatic_cells(frame, &seen), one_range(frame, &seen, whole), preferred(frame, &seen)];
    let drawing = of_frame(frame, &seen);
    Prediction {
        loading,
        effects: caused(frame, &seen, &drawing).of_effects(&frame.plan.effects),
        drawing,
        changes: changes.into_iter().flatten().collect(),
        rates: options.rates.clone(),
    }
}

/// These passes, by the lights and objects that cause them.
fn caused<'b>(frame: &'b Frame<'_>, seen: &Seen, drawing: &[CountedPass]) -> CausedWork<'b> {
    let loaded = frame.loaded;
    let map = |(table, point): (&'b ShadowTable, &LightPoint)| CausedMap {
        light: &loaded.lights[point.light_index].label,
        pass: CountedPass::new(pass::SHADOW_MAP, pass::SHADOW_MAP.to_owned(), cast(frame, &table.predicted)),
        bytes: table.predicted.map_bytes,
    };
    let shining = loaded.lights.iter().zip(&frame.plan.lights).filter(|(_, shines)| **shines);
    let splats: u64 = loaded.splats.iter().map(|count| count.made).sum();
    let data: u64 = loaded.own.iter().filter(|native| !native.form.is_polygons()).map(Own::bytes).sum();
    let visible = frame.scene.objects.iter().enumerate().filter(|(_, object)| object.visible);
    let is_polygons = |rank: usize| loaded.own.iter().any(|native| native.object == rank && native.form.is_polygons());
    let object = |((rank, _), count): ((usize, &SceneObject), &'b SplatCount)| {
        let bytes: u64 = loaded.own.iter().filter(|native| native.object == rank).map(Own::bytes).sum();
        let part = CausedObject {
            converted: Count::new(Item::of_conversion(count.conversion), count.predicted as f64),
            share_of_splats: count.made as f64 / splats.max(1) as f64,
            share_of_data: bytes as f64 / data.max(1) as f64,
            bytes,
        };
        (count.object.as_str(), part)
    };
    CausedWork {
        drawing: joined(drawing.iter()),
        maps: if frame.has_maps() { Vec::new() } else { tables(frame).map(map).collect() },
        lights: shining.map(|(light, _)| light.label.as_str()).collect(),
        shaded: shaded(frame, seen),
        objects: visible.zip(&loaded.splats).filter(|((rank, _), _)| !is_polygons(*rank)).map(object).collect(),
    }
}

/// Splats that get light before they are drawn; 0 where none are.
fn shaded(frame: &Frame<'_>, seen: &Seen) -> f64 {
    let plan = frame.plan;
    if !plan.passes.iter().any(|planned| planned.name == pass::SHADE) {
        return 0.0;
    }
    let nearest = if plan.skips_hidden { NEAREST } else { 1.0 };
    nearest * seen.opaque.splats() + drawn(frame, seen)
}

/// Translucent splats in view that are drawn as splats.
fn drawn(frame: &Frame<'_>, seen: &Seen) -> f64 {
    let plan = frame.plan;
    let is_drawn =
        |by: &&BySeen| plan.by.iter().zip(&plan.draws).any(|(by_object, draws)| *by_object == by.technique && *draws);
    seen.translucent.iter().filter(is_drawn).map(|by| by.splats.splats).sum()
}

/// The conversion of several objects.
fn conversion(counts: impl Iterator<Item = Count>) -> CountedPass {
    let mut pass = CountedPass::new(pass::CONVERT, pass::CONVERT.to_owned(), Vec::new());
    pass.add(&counts.collect::<Vec<Count>>());
    pass
}

/// Shadow tables of the automatic resolution, where the scene asks for cells.
fn automatic_cells(frame: &Frame<'_>, seen: &Seen) -> Option<Change> {
    frame.settings.shadow.cells?;
    let counts = tables(frame).flat_map(|(table, point)| {
        // What a light states stays.
        cast(frame, if point.shadow_cells.is_some() { &table.predicted } else { &table.automatic })
    });
    let mut passes = surfaces(frame, seen);
    passes.push(CountedPass::new(pass::SHADOW_MAP, pass::SHADOW_MAP.to_owned(), counts.collect()));
    Some(Change { key: "render.shadow.cells = \"auto\"".to_owned(), passes })
}

/// One range of depth, where techniques take turns in several.
fn one_range(frame: &Frame<'_>, seen: &Seen, whole: impl FnOnce() -> Seen) -> Option<Change> {
    (seen.ranges > 1.0).then(|| Change { key: "render.depth_ranges = 1".to_owned(), passes: of_frame(frame, &whole()) })
}

/// All translucent objects by the first technique of the table, as splats; `None` where it draws them already, shows less of them, or the plan has chosen.
fn preferred(frame: &Frame<'_>, seen: &Seen) -> Option<Change> {
    let loaded = frame.loaded;
    let scene = frame.scene;
    let plan = frame.plan;
    let first = &TABLE[0];
    let visible = || scene.objects.iter().zip(0..).filter(|(object, _)| object.visible);
    let shows = |object: &SceneObject| !scene.materials[object.material].material.bounds_matter();
    let is_other = |by: &BySeen| by.technique != first.technique;
    let is_named = scene.render.choice.is_none()
        && visible().all(|(object, _)| technique_of(object, scene) == scene.render.technique);
    if !is_named || !seen.translucent.iter().any(is_other) || !visible().all(|(object, _)| shows(object)) {
        return None;
    }
    let sum = |total: Expected, part: Expected| Expected {
        splats: total.splats + part.splats,
        fragments: total.fragments + part.fragments,
    };
    let mut splats = seen.translucent.iter().map(|by| by.splats).fold(Expected::default(), sum);
    // Objects from their own data become splats of that radius.
    let mut converted = Vec::new();
    for native in &loaded.own {
        let rank = visible().position(|(_, object)| object == native.object)?;
        let number = loaded.convertible[rank] as f64;
        converted.push(Count::new(Item::of_conversion(loaded.splats[rank].conversion), number));
        let extent = Extent::new(&native.world_box(), &frame.camera);
        let radius = native.radius * extent.samples_per_unit;
        let footprint = (std::f64::consts::PI * radius * radius).max(4.0).min(samples(scene));
        let fragments = number * extent.share * footprint;
        splats = sum(splats, Expected { splats: number, fragments });
    }
    let by = BySeen { technique: first.technique, splats, own_work: OwnWork::default() };
    let drawn = splats.splats;
    // Light that is carried has a map for each of its points then.
    let more_maps = plan.carried.iter().filter(|carried| **carried).count() as f64;
    let maps = plan.shadow_maps_built() as f64 + more_maps;
    let as_splats = Seen { opaque: seen.opaque, translucent: vec![by], ranges: 1.0 };
    let mut passes = of_frame(frame, &as_splats);
    let shading = vec![
        Count::new(Item::ProjectedSplat, drawn),
        Count::new(Item::ShadedSplat, drawn),
        Count::new(Item::ShadowLookUp, drawn * maps),
    ];
    passes.push(CountedPass::new(pass::SHADE, stage::SHADE.to_owned(), shading));
    let casting = vec![
        Count::new(Item::CastSplat, drawn * more_maps),
        Count::new(Item::ShadowEntry, drawn * more_maps * ENTRIES_PER_SPLAT),
    ];
    passes.push(CountedPass::new(pass::SHADOW_MAP, pass::SHADOW_MAP.to_owned(), casting));
    passes.push(conversion(converted.into_iter()));
    Some(Change { key: format!("render.technique = \"{}\"", first.technique.name()), passes })
}
