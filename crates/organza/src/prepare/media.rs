//! The media of a scene, as far as light is scattered in them: facts before anything is lit.

use crate::load::Loaded;
use crate::load::own::{Body, Own};
use crate::scene::{Scene, SceneObject};
use crate::statistics::{MediumStatistics, ObjectData, ObjectStatistics};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use splat_core::shade::joint::MediumSpacing;
use splat_core::{DAabb, Material, Shading, SplatKind};

/// Splats that one thread looks at.
const CHUNK: usize = 1 << 14;

/// The medium of one object.
#[derive(Clone, Copy)]
struct Medium {
    bounds: DAabb,
    /// Greatest extinction of any place, 1/world unit.
    extinction: f64,
    albedo: f64,
}

impl Medium {
    const NOTHING: Self = Self { bounds: DAabb::EMPTY, extinction: 0.0, albedo: 0.0 };

    fn join(&mut self, other: &Self) {
        self.bounds = self.bounds.union(other.bounds);
        self.extinction = self.extinction.max(other.extinction);
        self.albedo = self.albedo.max(other.albedo);
    }
}

/// The media of visible objects that scatter light by a phase function.
pub(crate) fn of_scene(scene: &Scene, loaded: &Loaded) -> Vec<MediumStatistics> {
    let mut media = splats(loaded);
    for native in &loaded.own {
        // Of splats that stand for it more is known.
        if media[native.object].extinction == 0.0 {
            media[native.object] = as_it_is(loaded, native);
        }
    }
    let visible = scene.objects.iter().enumerate().filter(|(_, object)| object.visible);
    let scattering = |((rank, object), statistics): ((usize, &SceneObject), &ObjectStatistics)| {
        let medium = &media[rank];
        // Splats of points may lie anywhere, those of fields and volumes lie on lattices that sum to the extinction.
        let is_lattice = matches!(statistics.data, ObjectData::Volume | ObjectData::Density { .. });
        let known = is_lattice && medium.extinction.is_finite();
        let optical_depth = if known { medium.extinction * medium.bounds.size().length() } else { f64::INFINITY };
        (medium.albedo > 0.0 && medium.extinction > 0.0).then(|| MediumStatistics {
            object: object.name.clone(),
            albedo: medium.albedo,
            optical_depth,
        })
    };
    visible.zip(&loaded.statistics).filter_map(scattering).collect()
}

fn scatters(material: &Material, has_normal: bool) -> bool {
    match material.shading {
        Shading::Phase => true,
        Shading::Unlit => false,
        _ => !has_normal,
    }
}

/// An object that is drawn from its own data.
fn as_it_is(loaded: &Loaded, native: &Own) -> Medium {
    let material = &loaded.materials[native.material];
    let has_normal = match &native.body {
        Body::Cells { normals, .. } => *normals,
        Body::Field(_) => false,
        _ => return Medium::NOTHING,
    };
    if !scatters(material, has_normal) {
        return Medium::NOTHING;
    }
    let bounds = native.world_box();
    let extinction = match &native.body {
        Body::Cells { .. } => native.optical_depth() / bounds.size().length().max(f64::MIN_POSITIVE),
        // Its bound depends on the place.
        _ => f64::INFINITY,
    };
    let albedo = f64::from(material.single_scattering_albedo) * f64::from(native.brightest_color());
    Medium { bounds, extinction, albedo }
}

/// The splats of media, by object.
fn splats(loaded: &Loaded) -> Vec<Medium> {
    let cloud = &loaded.cloud;
    let nothing = || vec![Medium::NOTHING; loaded.objects.len()];
    let chunk = |chunk: usize| {
        let mut media = nothing();
        for i in chunk * CHUNK..cloud.len().min((chunk + 1) * CHUNK) {
            let material = &loaded.materials[cloud.material[i] as usize];
            let has_normal = cloud.shading_normal_of(i) != Vec3::ZERO;
            if cloud.kind[i] != SplatKind::Medium || !scatters(material, has_normal) {
                continue;
            }
            let Some(spacing) = MediumSpacing::of_splat(cloud, &loaded.footprints, i) else { continue };
            let width = f64::from(spacing.width);
            let color = cloud.color[i].into_iter().fold(0.0, f32::max);
            media[cloud.object[i] as usize].join(&Medium {
                bounds: DAabb::around(cloud.origin + cloud.position[i].as_dvec3(), DVec3::splat(0.5 * width)),
                extinction: f64::from(spacing.optical_depth) * f64::from(material.greatest_extinction()) / width,
                albedo: f64::from(material.single_scattering_albedo) * f64::from(color),
            });
        }
        media
    };
    (0..cloud.len().div_ceil(CHUNK)).into_par_iter().map(chunk).reduce(nothing, |mut joined, media| {
        joined.iter_mut().zip(&media).for_each(|(a, b)| a.join(b));
        joined
    })
}
