//! The counted work of one effect: passes and shares of passes that run for it alone, and would not run without it.

use crate::cost::{Count, CountedPass, EffectWork, Item};
use crate::pass;
use crate::plan::Effect;
use std::collections::HashMap;

/// Counted work of a frame, by what causes it.
pub(crate) struct CausedWork<'a> {
    /// The passes that draw it, each name once.
    pub(crate) drawing: Vec<CountedPass>,
    /// Shadow maps of lights.
    pub(crate) maps: Vec<CausedMap<'a>>,
    /// Labels of the lights that shine.
    pub(crate) lights: Vec<&'a str>,
    /// Splats that get light.
    pub(crate) shaded: f64,
    /// Visible objects by their names, but for those that stay polygons, whose work goes by samples.
    pub(crate) objects: HashMap<&'a str, CausedObject>,
}

/// A shadow map.
pub(crate) struct CausedMap<'a> {
    /// Label of its light.
    pub(crate) light: &'a str,
    pub(crate) pass: CountedPass,
    /// Bytes of the finished map.
    pub(crate) bytes: u64,
}

/// An object's part of the work.
pub(crate) struct CausedObject {
    /// Splats that it is converted to.
    pub(crate) converted: Count,
    /// Its share of all splats, 0 to 1.
    pub(crate) share_of_splats: f64,
    /// Its share of all data that is drawn as it is, 0 to 1.
    pub(crate) share_of_data: f64,
    /// Bytes of its data that is drawn as it is.
    pub(crate) bytes: u64,
}

/// Passes that go by splats.
const BY_SPLATS: [&str; 9] = [
    pass::SHADOW_MAP,
    pass::EYE_MAP,
    pass::SORT,
    pass::GROUP,
    pass::PROJECT,
    pass::SHADE,
    pass::OPAQUE,
    pass::SPLAT,
    pass::REFERENCE,
];
/// Passes that go by data that is drawn as it is, where there is any.
const BY_DATA: [&str; 3] = [pass::SHEETS, pass::PARTICLES, pass::SURFELS];

impl CausedWork<'_> {
    /// The work of each of these effects that is simulated and has work of its own.
    pub(crate) fn of_effects(&self, effects: &[Effect]) -> Vec<EffectWork> {
        let simulated = effects.iter().filter(|effect| effect.called_for && !effect.is_lacking);
        let of_effect = |effect: &Effect| {
            let row = super::TABLE.iter().find(|row| Some(row.kind) == effect.kind)?;
            let work = (row.work?)(self, &effect.label);
            let is_counted = work.bytes > 0 || work.passes.iter().any(CountedPass::has_work);
            is_counted.then(|| EffectWork { effect: effect.name.clone(), ..work })
        };
        simulated.filter_map(of_effect).collect()
    }

    /// The shadow of a light: its maps, and the look-ups of all that is lit.
    pub(super) fn shadow(&self, light: &str) -> EffectWork {
        let maps = || self.maps.iter().filter(|map| map.light == light);
        let mut passes: Vec<CountedPass> = maps().map(|map| map.pass.clone()).collect();
        let look_ups = Count::new(Item::ShadowLookUp, self.shaded * maps().count() as f64);
        passes.push(CountedPass::new(pass::SHADE, pass::SHADE.to_owned(), vec![look_ups]));
        EffectWork { passes, bytes: maps().map(|map| map.bytes).sum(), ..EffectWork::default() }
    }

    /// A light: its shadow, and the shading of all, which it shares with the other lights.
    pub(super) fn light(&self, light: &str) -> EffectWork {
        let mut work = self.shadow(light);
        let shaded = Count::new(Item::ShadedSplat, self.shaded / self.lights.len().max(1) as f64);
        work.passes.push(CountedPass::new(pass::SHADE, pass::SHADE.to_owned(), vec![shaded]));
        work
    }

    /// An object: its conversion, and its share of all that is drawn.
    pub(super) fn object(&self, name: &str) -> EffectWork {
        let Some(object) = self.objects.get(name) else { return EffectWork::default() };
        let has_data = self.objects.values().any(|object| object.share_of_data > 0.0);
        let share = |pass: &str| match pass {
            pass if BY_SPLATS.contains(&pass) => object.share_of_splats,
            pass if BY_DATA.contains(&pass) && has_data => object.share_of_data,
            pass if BY_DATA.contains(&pass) => object.share_of_splats,
            _ => 0.0,
        };
        let drawn = self.drawing.iter().map(|pass| pass.scaled(share(pass.pass)));
        let conversion = CountedPass::new(pass::CONVERT, pass::CONVERT.to_owned(), vec![object.converted]);
        EffectWork {
            passes: std::iter::once(conversion).chain(drawn).filter(CountedPass::has_work).collect(),
            bytes: object.bytes,
            ..EffectWork::default()
        }
    }

    /// Rays that surfaces mirror and bend.
    pub(super) fn bending(&self) -> EffectWork {
        self.items(&[Item::BentSample, Item::BoxedDisc])
    }

    /// Images of a light that are moved for each of its points.
    pub(super) fn soft(&self, light: &str) -> EffectWork {
        let maps = self.maps.iter().filter(|map| map.light == light).skip(1);
        let mut work = self.items(&[Item::SoftSample]);
        for map in maps {
            work.passes.push(map.pass.clone());
            work.bytes += map.bytes;
        }
        work
    }

    /// Items of these kinds, in all passes.
    fn items(&self, items: &[Item]) -> EffectWork {
        let of_pass = |pass: &CountedPass| {
            let counts = pass.counts.iter().filter(|count| items.contains(&count.item)).copied().collect();
            CountedPass { counts, ..pass.clone() }
        };
        let passes = self.drawing.iter().map(of_pass).filter(CountedPass::has_work).collect();
        EffectWork { passes, ..EffectWork::default() }
    }
}
