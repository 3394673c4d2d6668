//! Errors of techniques, estimated from facts; `auto` compares techniques by them. No estimate is a bound.
//!
//! Light that a medium scatters again and again is brighter than what it scatters once by the factor R = H²·(1 + g₊·q⁴), where ω is the albedo, τ the
//! optical depth, g₊ the mean cosine of scattering or 0, and
//!
//! - q = 1 − 1/(1 + 3τ/2) the share of light that meets the medium again where it was scattered, as diffusion has it,
//! - H = 3/(1 + 2·√(1 − ω·q)) Hapke's form of Chandrasekhar's H function along the normal (Bidirectional Reflectance Spectroscopy 1, J. Geophys. Res. 86,
//!   1981, Eq. 8), with ω·q in the place of ω. A half-space that scatters to all sides alike reflects H² times what it scatters once.
//!
//! The last factor is fitted to paths: scattering ahead leaves less of the first order on the side that is seen. R − 1 is within a factor of 2.9 of path
//! tracing for balls and cubes of τ 0.1 to 20, ω 0.5 to 1, g 0 to 0.6; for endless slabs it is up to 2.2 times too small with g = 0, and up to 6.3
//! times with g = 0.6 (`again_and_again_is_near_path_tracing`).

use super::{Row, row};
use crate::cost::extent;
use crate::plan::Estimate;
use crate::scene::{EffectKind, RenderSettings, Scene, SceneObject, Slicing, Source, SwitchedEffect, Technique};
use crate::statistics::{MediumFacts, MeshFacts, SourceFacts};
use convert::PointColors;
use splat_core::Material;
use std::f64::consts::PI;

/// What a technique is asked about.
pub(crate) struct Asked<'a> {
    pub(crate) scene: &'a Scene,
    /// Its rank in the scene.
    pub(crate) rank: usize,
    pub(crate) object: &'a SceneObject,
    /// What is known of all objects before anything is converted.
    pub(crate) facts: &'a SourceFacts,
    /// With which it would be drawn: they may differ from those of the scene.
    pub(crate) settings: &'a RenderSettings,
}

impl<'a> Asked<'a> {
    /// Facts of the medium that the object is; `None` for another object, and for a medium out of view.
    pub(crate) fn medium(&self) -> Option<&'a MediumFacts> {
        self.facts.medium(self.rank)
    }

    /// Facts of the mesh that the object is; `None` for another object.
    pub(crate) fn mesh(&self) -> Option<&'a MeshFacts> {
        self.facts.mesh(self.rank)
    }

    /// Whether the object is a mesh of which nothing is seen on discs alone.
    pub(crate) fn stays_triangles(&self) -> bool {
        self.mesh().is_some_and(|mesh| mesh.stays_triangles)
    }

    /// Whether the object and another, by its rank in the scene, may be seen in one pixel of some frame.
    fn may_share_pixel(&self, other: usize) -> bool {
        let scene = self.scene;
        match (self.facts.boxes[self.rank], self.facts.boxes[other]) {
            (Some(first), Some(second)) => {
                scene.frames.is_some() || extent::may_share_pixel(&first, &second, &scene.camera)
            }
            _ => true,
        }
    }

    /// Whether the object is opaque for certain. Raw points may each have an opacity of their own, and so may what shows a column.
    pub(crate) fn is_opaque(&self) -> bool {
        let object = self.object;
        let is_classified = object.points.color_by.as_ref().is_some_and(|by| match &by.colors {
            PointColors::Transfer(..) => true,
            PointColors::Labels(table) => table.has_opacities(),
            _ => false,
        });
        let may_vary =
            object.field.is_some() || is_classified || !object.materials.is_empty() || object.source.is_of_points();
        let is_translucent = self.mesh().map_or(self.scene.opacity_of(object) < 1.0, |mesh| mesh.is_translucent);
        !object.source.is_medium() && !may_vary && !is_translucent
    }

    /// The material of the object.
    pub(crate) fn material(&self) -> &Material {
        &self.scene.materials[self.object.material].material
    }

    fn estimate(&self, technique: Technique, what: &'static str, displayed_error: f64, words: String) -> Estimate {
        let of_object = self.object.name.clone();
        Estimate { technique, what, of_object, is_left_out: false, displayed_error, words }
    }
}

/// Share of the light of all orders that slabs which scatter again and again are off by: clouds have an RMSE of 0.1 to 0.25 of their mean, thick slabs 0.07.
const SCATTERED_ERROR: f64 = 0.15;
/// Optical depth of a spacing up to which splats of a medium are lit right.
const THICKEST_SPLATS: f64 = 16.0;

/// All that a technique is known to err by where it draws an object.
pub(crate) fn estimates(technique: Technique, asked: &Asked<'_>) -> Vec<Estimate> {
    let row = row(technique);
    let mut found = unshown(row, asked);
    found.extend(too_thick(row, asked));
    found.extend((row.estimates)(asked));
    found
}

/// An estimate of an effect that is left out.
fn left_out(estimate: Estimate) -> Estimate {
    Estimate { is_left_out: true, ..estimate }
}

/// What the material has and the technique leaves out; no number is known of it.
fn unshown(row: &Row, asked: &Asked<'_>) -> Vec<Estimate> {
    let material = asked.material();
    let mut found = Vec::new();
    if material.bounds_matter() && (row.bends)(asked.scene).is_err() {
        let words = "it bounds matter that bends light or absorbs, which is left out".to_owned();
        found.push(left_out(asked.estimate(row.technique, "bending", f64::INFINITY, words)));
    }
    if material.bump.height > 0.0 && (row.bumps)(asked.scene).is_err() {
        let words = "its bumps are left out".to_owned();
        found.push(left_out(asked.estimate(row.technique, "bumps", f64::INFINITY, words)));
    }
    found
}

/// A medium that is too thick for the distance of its splats; no number is known of what that does.
fn too_thick(row: &Row, asked: &Asked<'_>) -> Option<Estimate> {
    let medium = asked.medium().filter(|medium| medium.albedo > 0.0)?;
    let is_body = matches!(asked.object.source, Source::Medium(_));
    let most = row.thickest_body.filter(|_| is_body).map_or(THICKEST_SPLATS, f64::from);
    (medium.spacing_optical_depth > most).then(|| {
        let words = format!("an optical depth of {:.1} in a spacing, above {most}", medium.spacing_optical_depth);
        asked.estimate(row.technique, "spacing", f64::INFINITY, words)
    })
}

/// The factor by which light of all orders of scattering is brighter than that of the first.
pub(crate) fn brightening(albedo: f64, optical_depth: f64, asymmetry: f64) -> f64 {
    let again = 1.0 - 1.0 / (1.0 + 1.5 * optical_depth);
    let root = (1.0 - albedo * again).max(0.0).sqrt();
    let ahead = asymmetry.max(0.0) * again.powi(4);
    (3.0 / (1.0 + 2.0 * root)).powi(2) * (1.0 + ahead)
}

/// Radiance of a medium that was scattered once, W·m⁻²·sr⁻¹: to all sides alike, back along the light that there is in its middle.
fn scattered_once(medium: &MediumFacts) -> f64 {
    medium.albedo * medium.irradiance / (4.0 * PI) * (-0.5 * libm::expm1(-2.0 * medium.optical_depth))
}

/// How much the displayed value of a radiance changes with a smaller one: exposure, sRGB. A medium that would be brighter than white counts where it is
/// white: it has darker parts.
fn displayed_change(smaller: f64, whole: f64, exposure: f64) -> f64 {
    let gain = libm::exp2(exposure);
    let white = (gain * whole).max(1.0);
    let displayed = |radiance: f64| {
        let shown = (gain * radiance / white).clamp(0.0, 1.0);
        if shown <= 0.003_130_8 { 12.92 * shown } else { 1.055 * libm::pow(shown, 1.0 / 2.4) - 0.055 }
    };
    displayed(whole) - displayed(smaller)
}

/// How much too dark a technique shows a medium whose light it scatters once, all of it or the `share` of it.
fn too_dark(technique: Technique, asked: &Asked<'_>, share: f64) -> Option<Estimate> {
    let medium = asked.medium()?;
    // What a scene switches off is no error.
    if SwitchedEffect::find(&asked.settings.effects, EffectKind::Scatter, "") == Some(false) {
        return None;
    }
    let factor = brightening(medium.albedo, medium.optical_depth, medium.asymmetry);
    let once = scattered_once(medium);
    let seen = once * (factor - share * (factor - 1.0));
    let change = displayed_change(seen, once * factor, asked.settings.exposure);
    let of_lights = if share < 1.0 { ", of lights that slabs do not carry" } else { "" };
    let words = format!(
        "light that it scatters again and again is left out{of_lights}: albedo {:.2} and optical depth {:.2} are about {factor:.1} times as bright with it",
        medium.albedo, medium.optical_depth
    );
    (change > 0.0).then(|| left_out(asked.estimate(technique, "scatter", change, words)))
}

/// What discs show of the edges between the triangles of a translucent mesh. Near an edge the discs of both triangles overlap in their planes: of a ray that
/// meets these at angles a and b, a disc of the other plane is as far from the edge as one of its own times cos a/cos b. So a Gaussian profile leaves
/// Φ(d) + Φ(−d·cos a/cos b) ≠ 1 of the optical depth, off by up to max d·φ(d) = 0.242 of cos a/cos b − 1, which is about the angle times tan a, tan 60° for a
/// typical view. On balls of 24x16 and 96x64 triangles, α = 0.3, 5 % of the pixels are off by more than 1.6 and 0.9 times as much.
fn creases(technique: Technique, asked: &Asked<'_>) -> Option<Estimate> {
    let mesh = asked.mesh()?;
    let change = 0.242 * 3.0f64.sqrt() * mesh.bend * mesh.sensitivity;
    let degrees = libm::asin(mesh.bend).to_degrees();
    let words = format!("discs overlap at the edges of its triangles, which bend by {degrees:.1}°");
    (change > 0.0).then(|| asked.estimate(technique, "edges", change, words))
}

/// Whether a mesh is translucent, and drawn as triangles in slabs across the view, which are exact where no pixel has anything else that is translucent.
pub(crate) fn suits_triangles(technique: Technique, asked: &Asked<'_>) -> bool {
    let suits = |(rank, object): (usize, &SceneObject)| {
        let by = object.technique.unwrap_or(asked.scene.render.technique);
        let is_free = by == Technique::Auto || by == technique;
        let other = Asked { rank, object, ..*asked };
        other.stays_triangles() && is_free || other.is_opaque() || !asked.may_share_pixel(rank)
    };
    let mut visible = asked.scene.objects.iter().enumerate().filter(|(_, object)| object.visible);
    let is_across_view = !matches!(asked.settings.sheets.slicing, Slicing::HalfVector { .. });
    is_across_view && asked.mesh().is_some_and(|mesh| mesh.is_translucent) && visible.all(suits)
}

/// For a technique that composites discs, and scatters light once.
pub(crate) fn of_discs(technique: Technique, asked: &Asked<'_>) -> Vec<Estimate> {
    creases(technique, asked).into_iter().chain(of_one_order(technique, asked)).collect()
}

/// For a technique that scatters light once.
pub(crate) fn of_one_order(technique: Technique, asked: &Asked<'_>) -> Vec<Estimate> {
    too_dark(technique, asked, 1.0).into_iter().collect()
}

/// The noise of random sets: the standard error of their mean opacity.
pub(crate) fn of_sets(technique: Technique, asked: &Asked<'_>) -> Vec<Estimate> {
    let opacity = match asked.medium() {
        Some(medium) => -libm::expm1(-medium.optical_depth),
        // Of a medium of which nothing is known: where noise is most.
        None if asked.object.source.is_medium() => 0.5,
        None => asked.scene.opacity_of(asked.object),
    };
    let sets = f64::from(asked.settings.particles.repeat_level);
    let noise = (opacity * (1.0 - opacity) / sets).max(0.0).sqrt();
    let words = format!("noise of {sets} sets at an opacity of {opacity:.2}");
    let noise = (noise > 0.0).then(|| asked.estimate(technique, "noise", noise, words));
    noise.into_iter().chain(of_discs(technique, asked)).collect()
}

/// For slabs, which may scatter light again and again.
pub(crate) fn of_slabs(technique: Technique, asked: &Asked<'_>) -> Vec<Estimate> {
    let Some(medium) = asked.medium() else { return Vec::new() };
    if asked.settings.sheets.scattering().is_none() || !medium.is_lattice {
        return of_one_order(technique, asked);
    }
    let factor = brightening(medium.albedo, medium.optical_depth, medium.asymmetry);
    let whole = scattered_once(medium) * factor;
    // What is scattered once is exact.
    let off = SCATTERED_ERROR * (1.0 - 1.0 / factor) * whole;
    let change = displayed_change(whole - off, whole, asked.settings.exposure);
    let words = "light that it scatters again and again is averaged over cells".to_owned();
    let cells = (change > 0.0).then(|| asked.estimate(technique, "cells of scattered light", change, words));
    cells.into_iter().chain(too_dark(technique, asked, 1.0 - medium.outside_share)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light of all orders over that of the first which leaves a body that parallel light falls on, by 30,000 paths each: a cube, a ball, an endless
    /// slab along the light; mean cosine, optical depth of a side or diameter, and the ratio for the albedos 0.5, 0.9, 0.98, 1.
    const CUBES_AND_BALLS: [(f64, f64, [f64; 4]); 12] = [
        (0.0, 1.0, [1.19, 1.42, 1.47, 1.49]),
        (0.0, 6.0, [1.47, 2.69, 3.36, 3.62]),
        (0.0, 20.0, [1.50, 2.95, 4.21, 5.16]),
        (0.3, 6.0, [1.66, 3.46, 4.44, 4.77]),
        (0.6, 6.0, [1.89, 4.71, 6.31, 6.72]),
        (0.6, 20.0, [2.03, 6.43, 11.43, 14.39]),
        (0.0, 0.1, [1.02, 1.03, 1.04, 1.04]),
        (0.0, 1.0, [1.17, 1.35, 1.39, 1.41]),
        (0.0, 20.0, [1.44, 2.59, 3.64, 4.29]),
        (0.3, 6.0, [1.58, 2.99, 3.68, 3.98]),
        (0.6, 1.0, [1.19, 1.39, 1.43, 1.44]),
        (0.6, 20.0, [1.79, 4.89, 8.08, 9.87]),
    ];
    const SLABS: [(f64, f64, [f64; 4]); 5] = [
        (0.0, 0.1, [1.09, 1.17, 1.19, 1.19]),
        (0.0, 1.0, [1.43, 2.19, 2.47, 2.54]),
        (0.0, 6.0, [1.52, 3.22, 5.24, 6.21]),
        (0.0, 20.0, [1.50, 2.98, 4.58, 6.34]),
        (0.6, 6.0, [2.38, 11.10, 19.53, 24.53]),
    ];

    fn worst(table: &[(f64, f64, [f64; 4])]) -> [f64; 2] {
        let mut range = [f64::INFINITY, 0.0f64];
        for (asymmetry, optical_depth, ratios) in table {
            for (albedo, by_paths) in [0.5, 0.9, 0.98, 1.0].into_iter().zip(ratios) {
                let share = (brightening(albedo, *optical_depth, *asymmetry) - 1.0) / (by_paths - 1.0);
                range = [range[0].min(share), range[1].max(share)];
            }
        }
        range
    }

    #[test]
    fn again_and_again_is_near_path_tracing() {
        let [least, most] = worst(&CUBES_AND_BALLS);
        assert!(least > 0.47 && most < 2.9, "{least} to {most}");
        let [least, most] = worst(&SLABS[..4]);
        assert!(least > 0.45 && most < 1.1, "{least} to {most}");
        let [least, _] = worst(&SLABS[4..]);
        assert!(least > 0.15, "{least}");
        // A half-space by Chandrasekhar: 8.46 times.
        assert!((brightening(1.0, 1e9, 0.0) / 8.46 - 1.0).abs() < 0.07);
    }

    #[test]
    fn nothing_that_is_black_or_thin_is_too_dark() {
        assert!(brightening(0.0, 5.0, 0.9) < 1.91 && brightening(0.0, 5.0, 0.0) == 1.0);
        assert!(brightening(1.0, 1e-6, 0.5) - 1.0 < 2e-6);
        assert_eq!(displayed_change(0.2, 0.2, 3.0), 0.0);
        assert!((displayed_change(0.0, 5.0, 0.0) - 1.0).abs() < 1e-12);
    }
}
