//! Checks of what objects, their materials and the techniques that draw them say together.

use crate::at::At;
use crate::render::check::own_layers;
use crate::{Error, Reconstruction, RenderSettings, SceneMaterial, SceneObject, Source, Technique, VolumeSampler};
use splat_core::Packing;

/// Refuses what a technique cannot draw, and layers that it cannot fill; adds the effects that only some scenes have. `layers` are as they
/// are written, with their place.
pub(crate) fn check_drawn(
    at: &At<'_>,
    objects: &[SceneObject],
    materials: &[SceneMaterial],
    at_layers: &At<'_>,
    layers: &[String],
    render: &mut RenderSettings,
) -> Result<(), Error> {
    check_one_technique(at, objects, render)?;
    check_lattices(at, objects, render)?;
    check_surfels(at, objects, render)?;
    check_sampled(at, objects, render)?;
    check_bounds(at, objects, materials)?;
    check_scattered(at_layers, layers, objects, render)?;
    check_bent(at_layers, layers, objects, materials, render)
}

/// Refuses what a picture has only if one technique draws all of it.
fn check_one_technique(at: &At<'_>, objects: &[SceneObject], render: &RenderSettings) -> Result<(), Error> {
    let Some((_, layer)) = own_layers(&render.layers).next() else { return Ok(()) };
    let other = objects.iter().position(|o| o.visible && o.technique.is_some_and(|t| t != render.technique));
    other.map_or(Ok(()), |i| {
        let message = format!("a picture by several techniques has no layer `{layer}`");
        Err(at.index(i).key("technique").error(message, "leave the layer or this key out"))
    })
}

/// Refuses body-centred lattices wherever they are not splatted in slabs.
fn check_lattices(at: &At<'_>, objects: &[SceneObject], render: &RenderSettings) -> Result<(), Error> {
    let body_centred = objects.iter().enumerate().filter(|(_, o)| o.visible && o.packing == Packing::BodyCentred);
    for (i, object) in body_centred {
        let technique = object.technique.unwrap_or(render.technique);
        let refuse = |message: &str, hint| Err(at.index(i).key("lattice").error(message, hint));
        if technique != Technique::Sheets {
            let message = format!("`lattice`: the technique `{}` draws no body-centred lattice", technique.name());
            return refuse(&message, "use technique = \"sheets\", or leave it out");
        }
        if render.sheets.reconstruction == Reconstruction::Gather {
            let message = "`lattice`: gathered slabs read no body-centred lattice";
            return refuse(message, "set render.sheets.reconstruction = \"splat\", or leave it out");
        }
    }
    Ok(())
}

/// Refuses media that would be drawn as discs of surfaces.
fn check_surfels(at: &At<'_>, objects: &[SceneObject], render: &RenderSettings) -> Result<(), Error> {
    let by_surfels = |o: &SceneObject| o.technique.unwrap_or(render.technique) == Technique::Surfels;
    let medium = objects.iter().position(|o| o.visible && o.source.is_medium() && by_surfels(o));
    medium.map_or(Ok(()), |i| {
        let name = crate::shown(&objects[i].name);
        let message = format!("`{name}` is a medium, and the technique `surfels` draws surfaces alone");
        let hint = format!("set object.{name}.technique = \"sheets\", or \"points\"");
        Err(at.index(i).error(message, hint))
    })
}

/// Refuses a sampler of media for particles that are of none.
fn check_sampled(at: &At<'_>, objects: &[SceneObject], render: &RenderSettings) -> Result<(), Error> {
    let drawn =
        || objects.iter().filter(|o| o.visible && o.technique.unwrap_or(render.technique) == Technique::Particles);
    let is_volume = |o: &SceneObject| o.source.is_medium() && !matches!(o.source, Source::Matter(_));
    if render.particles.volume_sampler == VolumeSampler::Auto || drawn().next().is_none() || drawn().any(is_volume) {
        return Ok(());
    }
    let message =
        "`volume_sampler`: the technique `particles` draws no volume, density, cloud or homogeneous medium here";
    Err(At::root(at.document).key("render").key("particles").key("volume_sampler").error(message, "leave it out"))
}

/// Whether an object bends light: `surfels` draw it, and `auto` gives it to them.
fn is_bent(object: &SceneObject, materials: &[SceneMaterial], technique: Technique) -> bool {
    let by_surfels = matches!(object.technique.unwrap_or(technique), Technique::Auto | Technique::Surfels);
    object.visible && by_surfels && materials[object.material].material.index.is_some()
}

/// `reflection` and `refraction` are two of the effects where rays are bent, and else they are refused.
fn check_bent(
    at: &At<'_>,
    layers: &[String],
    objects: &[SceneObject],
    materials: &[SceneMaterial],
    render: &mut RenderSettings,
) -> Result<(), Error> {
    const LAYERS: [&str; 2] = ["reflection", "refraction"];
    let bends = objects.iter().any(|o| is_bent(o, materials, render.technique));
    if bends && layers.iter().any(|layer| layer == "effects") {
        render.layers.add_effects(LAYERS);
    }
    match render.layers.names().find(|name| LAYERS.contains(name)) {
        Some(name) if !bends => {
            let message = format!("the layer `{name}` is of light that surfaces mirror and bend, and none does");
            let hint = "give an object a material with an `ior` and technique = \"surfels\", or leave it out";
            Err(at.error(message, hint))
        }
        _ => Ok(()),
    }
}

/// Refuses materials that bound matter where there is no surface, or one that nothing passes.
fn check_bounds(at: &At<'_>, objects: &[SceneObject], materials: &[SceneMaterial]) -> Result<(), Error> {
    for (i, object) in objects.iter().enumerate() {
        let material = &materials[object.material];
        if !material.material.bounds_matter() {
            continue;
        }
        let subject = format!("material `{}` has an index or `absorption_inside`", crate::shown(&material.name));
        let at = at.index(i);
        if object.source.is_medium() {
            let message = format!("{subject}, which surfaces bound, and this is a medium");
            return Err(at.error(message, "use another material, or a surface"));
        }
        if object.opacity.unwrap_or(material.opacity) >= 1.0 {
            let message = format!("{subject}, and nothing passes a surface whose opacity is 1");
            return Err(at.error(message, "set an `opacity` below 1; 0 is clear glass"));
        }
    }
    Ok(())
}

/// `scatterN` is one of the effects where light is scattered more than once, and else it is refused.
fn check_scattered(
    at: &At<'_>,
    layers: &[String],
    objects: &[SceneObject],
    render: &mut RenderSettings,
) -> Result<(), Error> {
    let by_sheets = |o: &SceneObject| o.visible && o.technique.unwrap_or(render.technique) == Technique::Sheets;
    let scatters_again = render.sheets.scattering().is_some() && objects.iter().any(by_sheets);
    if scatters_again && layers.iter().any(|layer| layer == "effects") {
        render.layers.add_effects(["scatterN"]);
    }
    // The plan then gives the objects to a technique that fills it.
    let may_be_sheets = |o: &SceneObject| {
        let technique = o.technique.unwrap_or(render.technique);
        o.visible && matches!(technique, Technique::Auto | Technique::Sheets)
    };
    let may_scatter = render.sheets.scattering_again().is_some()
        && objects.iter().any(|o| o.visible && o.technique.unwrap_or(render.technique) == Technique::Auto)
        && objects.iter().all(|o| !o.visible || may_be_sheets(o));
    if !scatters_again && !may_scatter && render.layers.names().any(|layer| layer == "scatterN") {
        let message = "the layer `scatterN` is of light that the technique `sheets` scatters more than once";
        let hint = "use technique = \"sheets\" with render.sheets.slicing = \"half_vector\" and \
                    render.sheets.scattering = \"forward_and_back\", or leave it out";
        return Err(at.error(message, hint));
    }
    Ok(())
}
