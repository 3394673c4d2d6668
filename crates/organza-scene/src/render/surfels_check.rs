//! Checks of the settings of the technique `surfels`.

use crate::at::At;
use crate::limits::SMALLEST;
use crate::render::check::check_cutoff;
use crate::render::raw::Auto;
use crate::render::surfels_raw::{
    RawBehind, RawBending, RawCollisions, RawCoverage, RawGrouping, RawOpaque, RawSurfelLayers, RawSurfelShading,
    RawSurfels,
};
use crate::{
    Bending, Collisions, Coverage, Error, Grouping, OpaqueSurfels, SurfelGroups, SurfelLayers, SurfelsSettings,
};

/// Most steps of depth: neighbours among them are still told apart in f32.
const MOST_STEPS: f64 = 16_777_216.0;

pub(crate) fn check_surfels(at: &At<'_>, raw: &RawSurfels) -> Result<SurfelsSettings, Error> {
    Ok(SurfelsSettings {
        disc_scale: at.number("disc_scale", raw.disc_scale.unwrap_or(0.6), 0.45..=1.0)?,
        gap: at.number("gap", raw.gap.unwrap_or(0.5), 1.0 / 1024.0..=4.0)?,
        transmittance_cutoff: check_cutoff(at, raw.transmittance_cutoff)?,
        bending: match raw.bending {
            RawBending::Traced => Bending::Traced,
            RawBending::Power => Bending::Power,
            RawBending::Nearest => Bending::Nearest,
        },
        bent_behind: matches!(raw.behind, RawBehind::Bent),
        layers: check_layers(at, raw)?,
        lights_pixels: raw.shading == RawSurfelShading::Pixels,
        opaque: check_opaque(at, raw)?,
    })
}

fn check_opaque(at: &At<'_>, raw: &RawSurfels) -> Result<OpaqueSurfels, Error> {
    if raw.opaque == RawOpaque::TwoPass {
        return Ok(OpaqueSurfels::TwoPass);
    }
    // Where nothing is said, as many groups as discs need that do not overlap.
    let any = raw.groups.is_none() && matches!(raw.grouping, None | Some(RawGrouping::Auto));
    let groups = match any {
        true => SurfelGroups { count: 256, grouping: Grouping::Minimum { factor: 1.0 }, ..SurfelGroups::default() },
        false => check_groups(at, raw)?,
    };
    Ok(OpaqueSurfels::OnePass { groups, voronoi: raw.voronoi.unwrap_or(true) })
}

fn check_layers(at: &At<'_>, raw: &RawSurfels) -> Result<SurfelLayers, Error> {
    let algorithms = matches!(raw.layers, RawSurfelLayers::Algorithm1 | RawSurfelLayers::Algorithm2);
    let one_pass = raw.opaque == RawOpaque::OnePass;
    let grouped = algorithms || one_pass;
    let [peeled, minimum] = [raw.layers == RawSurfelLayers::Peeled, raw.grouping == Some(RawGrouping::Mgc)];
    let hash = raw.grouping == Some(RawGrouping::Hash);
    let near = raw.collisions == Some(RawCollisions::Near);
    // Keys that mean nothing beside what else is chosen: given, in place, otherwise.
    let keys = [
        ("peeled_layers", raw.peeled_layers.is_some(), peeled, "layers = \"peeled\""),
        ("voronoi", raw.voronoi.is_some(), one_pass, "opaque = \"one_pass\""),
        (
            "groups",
            raw.groups.is_some(),
            grouped,
            "layers = \"algorithm1\" or \"algorithm2\", or opaque = \"one_pass\"",
        ),
        (
            "grouping",
            raw.grouping.is_some(),
            grouped,
            "layers = \"algorithm1\" or \"algorithm2\", or opaque = \"one_pass\"",
        ),
        ("coverage", raw.coverage.is_some(), algorithms, "layers = \"algorithm1\" or \"algorithm2\""),
        ("depth_steps", raw.depth_steps.is_some(), algorithms, "layers = \"algorithm1\" or \"algorithm2\""),
        ("overlap_factor", raw.overlap_factor.is_some(), minimum, "grouping = \"mgc\""),
        ("collisions", raw.collisions.is_some(), hash, "grouping = \"hash\""),
        ("near_distance", raw.near_distance.is_some(), near, "collisions = \"near\""),
    ];
    if let Some((key, .., with)) = keys.into_iter().find(|(_, is_given, applies, _)| *is_given && !applies) {
        return Err(at.key(key).error(format!("`{key}` belongs to {with}"), format!("set {with}, or leave it out")));
    }
    Ok(match raw.layers {
        RawSurfelLayers::Gaps => SurfelLayers::Gaps,
        RawSurfelLayers::Peeled => {
            SurfelLayers::Peeled(at.whole("peeled_layers", raw.peeled_layers.unwrap_or(8), 1..=1024)?)
        }
        RawSurfelLayers::Algorithm1 => SurfelLayers::Algorithm1(check_groups(at, raw)?),
        RawSurfelLayers::Algorithm2 => SurfelLayers::Algorithm2(check_groups(at, raw)?),
    })
}

fn check_groups(at: &At<'_>, raw: &RawSurfels) -> Result<SurfelGroups, Error> {
    let default = SurfelGroups::default();
    Ok(SurfelGroups {
        count: at.whole("groups", raw.groups.unwrap_or(default.count), 1..=256)?,
        grouping: match raw.grouping {
            None | Some(RawGrouping::Auto) => Grouping::Auto,
            Some(RawGrouping::Mgc) => Grouping::Minimum {
                factor: at.number("overlap_factor", raw.overlap_factor.unwrap_or(1.0), SMALLEST..=1.0)?,
            },
            Some(RawGrouping::Wgc) => Grouping::Weighted,
            Some(RawGrouping::Hash) => Grouping::Hash(check_collisions(at, raw)?),
        },
        coverage: match raw.coverage {
            None | Some(RawCoverage::Auto) => Coverage::Auto,
            Some(RawCoverage::Partial) => Coverage::Partial,
            Some(RawCoverage::Duplicates) => Coverage::Duplicates,
            Some(RawCoverage::Enlarged) => Coverage::Enlarged,
            Some(RawCoverage::Bound) => Coverage::Bound,
        },
        depth_steps: check_steps(at, raw.depth_steps)?,
    })
}

fn check_collisions(at: &At<'_>, raw: &RawSurfels) -> Result<Collisions, Error> {
    Ok(match (raw.collisions, raw.near_distance) {
        (None | Some(RawCollisions::Resolve), _) => Collisions::Resolve,
        (Some(RawCollisions::Keep), _) => Collisions::Keep,
        (Some(RawCollisions::Near), Some(distance)) => Collisions::Near(at.length("near_distance", distance)?),
        (Some(RawCollisions::Near), None) => {
            let message = "`collisions`: \"near\" needs `near_distance`";
            return Err(at.key("collisions").error(message, "such as near_distance = 2.5, in world units"));
        }
    })
}

fn check_steps(at: &At<'_>, raw: Option<Auto>) -> Result<Option<u32>, Error> {
    let Some(Auto::Number(steps)) = raw else { return Ok(None) };
    if steps.fract() != 0.0 || !(1.0..=MOST_STEPS).contains(&steps) {
        let message =
            format!("`depth_steps`: expected \"auto\" or a whole number from 1 to {MOST_STEPS}, found {steps}");
        return Err(at.key("depth_steps").error(message, ""));
    }
    Ok(Some(steps as u32))
}
