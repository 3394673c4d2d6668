//! Only what a scene calls for: what is known of it → what draws each object, the effects to simulate, the passes to run.
//!
//! All of it is pure: nothing is read, converted or drawn here. `auto` and every other question about a technique is
//! answered by the table of techniques.

mod effects;
mod passes;
mod settings;
pub(crate) mod settle;

pub(crate) use effects::{CausedMap, CausedObject, CausedWork, changed_without, changed_without_color, plan};
pub(crate) use settings::settings;

use crate::escape_controls;
use crate::form::{DRAWN, Form, PlannedObject};
use crate::scene::{Scene, SceneObject, Technique};
use crate::statistics::{LightStatistics, ObjectData, ObjectStatistics};
pub(crate) use crate::technique::row;
use crate::technique::{Row, TABLE};

/// The technique that draws an object: its own, or the scene's. `auto` alone where the scene is not settled.
pub(crate) fn technique_of(object: &SceneObject, scene: &Scene) -> Technique {
    object.technique.unwrap_or(scene.render.technique)
}

/// The techniques that draw a scene, in the order of their table; at least one.
pub(crate) fn techniques(scene: &Scene) -> Vec<Technique> {
    let visible = || scene.objects.iter().filter(|o| o.visible);
    let draws = |row: &&Row| visible().any(|o| technique_of(o, scene) == row.technique);
    let used: Vec<Technique> = TABLE.iter().filter(draws).map(|row| row.technique).collect();
    let named = || TABLE.iter().find(|row| row.technique == scene.render.technique).unwrap_or(&TABLE[0]).technique;
    if used.is_empty() { vec![named()] } else { used }
}

/// What materials of visible objects have and their techniques cannot show: a sentence each.
pub(crate) fn unshown(scene: &Scene) -> impl Iterator<Item = String> + '_ {
    scene.objects.iter().filter(|o| o.visible).flat_map(move |object| {
        let material = &scene.materials[object.material].material;
        let row = row(technique_of(object, scene));
        let all = [
            (material.bounds_matter(), "bounds matter that bends light or absorbs", row.bends),
            (material.bump.height > 0.0, "has bumps", row.bumps),
        ];
        let (name, own) = (escape_controls(&object.name), row.technique.name());
        all.into_iter().filter(|(has, ..)| *has).filter_map(move |(_, what, shows)| {
            let instead = shows(scene).err()?;
            Some(format!("object '{name}' {what}, which `{own}` leaves out: {instead}"))
        })
    })
}

/// Whether two techniques take every object in the same form.
pub(crate) fn same_forms(a: Technique, b: Technique) -> bool {
    a == b || (row(a).form.is_none() && row(b).form.is_none())
}

/// The form in which its technique takes each of these visible objects, and whether it becomes splats: only where splats are
/// drawn, or are what there is, or where a shadow map may need them.
pub(crate) fn choose<'a>(
    objects: impl Iterator<Item = (&'a ObjectStatistics, Technique)> + Clone,
    lights: &[LightStatistics],
) -> Vec<PlannedObject> {
    let shining = lights.iter().any(LightStatistics::may_shadow);
    let shadows = shining && objects.clone().any(|(o, _)| o.receives);
    let one = |(object, technique): (&ObjectStatistics, Technique)| {
        let row = row(technique);
        let stays = object.data == ObjectData::Triangles && row.polygons && object.is_plain;
        let (form, reason) = match row.form {
            _ if stays && object.opaque => (Form::Polygons, "opaque triangles end light and view rays where they are"),
            _ if stays => (Form::Panes, "translucent triangles are seen, and tint light, where they are"),
            _ if object.opaque => (Form::Opaque, "an opaque surface is drawn exactly"),
            Some(form) => form(object),
            None => (Form::Splats, DRAWN),
        };
        let splats = match form {
            Form::Opaque => Some(DRAWN),
            Form::Splats => Some(row.of_splats),
            _ if shadows && object.casts => Some("they may cast a shadow"),
            _ => None,
        };
        PlannedObject { object: object.name.clone(), technique, form, reason, splats }
    };
    objects.map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{SurfaceSampler, VolumeSampler};

    fn chosen(objects: &[ObjectStatistics], lights: &[LightStatistics]) -> Vec<PlannedObject> {
        choose(objects.iter().map(|o| (o, Technique::Particles)), lights)
    }

    fn object(data: ObjectData) -> ObjectStatistics {
        let name = "a".into();
        let volumes_by = VolumeSampler::Auto;
        let [opaque, is_partly_opaque, by_gradient, is_plain, casts, receives] =
            [false, false, false, true, true, true];
        ObjectStatistics { name, data, opaque, is_partly_opaque, by_gradient, is_plain, volumes_by, casts, receives }
    }

    fn sun() -> LightStatistics {
        LightStatistics { casts_shadows: true, points: 1, ..LightStatistics::default() }
    }

    #[test]
    fn every_kind_of_data_has_its_sampler() {
        let form = |o: ObjectStatistics| chosen(&[o], &[])[0].form;
        assert_eq!(form(object(ObjectData::Points)), Form::Splats);
        assert_eq!(form(object(ObjectData::Triangles)), Form::Triangles);
        let surface = |looseness, by| object(ObjectData::Surface { looseness, on_lattice: false, by });
        let auto = |looseness| surface(looseness, SurfaceSampler::Auto);
        assert_eq!(form(auto(2.6)), Form::Lines);
        assert_eq!(form(auto(f64::INFINITY)), Form::Triangles);
        assert_eq!(form(surface(f64::INFINITY, SurfaceSampler::Lines)), Form::Lines);
        assert_eq!(form(surface(2.6, SurfaceSampler::Triangles)), Form::Triangles);
        assert_eq!(form(surface(2.6, SurfaceSampler::Brownian { step: 0.01 })), Form::Brownian);
        let on_lattice = |by| form(object(ObjectData::Surface { looseness: 0.0, on_lattice: true, by }));
        assert_eq!(on_lattice(SurfaceSampler::Auto), Form::Lattice);
        assert_eq!(on_lattice(SurfaceSampler::Lines), Form::Lines);
        assert_eq!(form(object(ObjectData::Volume)), Form::Cells);
        assert_eq!(form(object(ObjectData::Density { bounded: true })), Form::Field);
        assert_eq!(form(object(ObjectData::Density { bounded: false })), Form::Cells);
        let lit = ObjectStatistics { by_gradient: true, ..object(ObjectData::Density { bounded: true }) };
        assert_eq!(form(lit), Form::Cells);
        let by = |volumes_by, data| form(ObjectStatistics { volumes_by, ..object(data) });
        assert_eq!(by(VolumeSampler::Cells, ObjectData::Density { bounded: true }), Form::Cells);
        assert_eq!(by(VolumeSampler::Metropolis { stride: 4 }, ObjectData::Volume), Form::Chains);
        assert_eq!(form(ObjectStatistics { opaque: true, ..auto(2.6) }), Form::Opaque);
    }

    #[test]
    fn x7_only_casters_become_splats_and_only_for_a_light_and_a_receiver() {
        let mesh = object(ObjectData::Triangles);
        let splats = |objects: &[ObjectStatistics], lights: &[LightStatistics]| -> Vec<bool> {
            chosen(objects, lights).iter().map(|s| s.splats.is_some()).collect()
        };
        let shy = ObjectStatistics { casts: false, ..mesh.clone() };
        assert_eq!(splats(&[mesh.clone(), shy.clone()], &[sun()]), [true, false]);
        assert_eq!(splats(&[mesh.clone(), shy.clone()], &[]), [false, false]);
        for light in [
            LightStatistics { is_dark: true, ..sun() },
            LightStatistics { casts_shadows: false, ..sun() },
            LightStatistics { is_on: Some(false), ..sun() },
            LightStatistics { has_shadow: Some(false), ..sun() },
        ] {
            assert_eq!(splats(&[mesh.clone(), shy.clone()], &[light]), [false, false]);
        }
        let deaf = ObjectStatistics { receives: false, ..mesh };
        assert_eq!(splats(&[deaf.clone(), deaf], &[sun()]), [false, false]);
    }
}
