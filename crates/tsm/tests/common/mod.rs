//! Clouds and lights that the tests share.
#![allow(dead_code, clippy::unwrap_used, reason = "each test file takes a part; a test fails by panicking")]

use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Footprint, Light, LightShape, Material, Receiver, Splat, SplatKind, Transmittance};
use tsm::{Params, Scene, ShadowMap};

pub(crate) fn point_light(position: DVec3) -> Light {
    Light { shape: LightShape::Point { position }, intensity: [1.0; 3] }
}

pub(crate) fn directional(direction: DVec3) -> Light {
    Light { shape: LightShape::Directional { direction: direction.normalize() }, intensity: [1.0; 3] }
}

pub(crate) fn build(cloud: &Cloud, light: &Light, params: &Params) -> ShadowMap {
    ShadowMap::build(&Scene { cloud, materials: &[Material::default()], objects: &[] }, light, params, None).unwrap()
}

/// A bare point that is no part of any medium.
pub(crate) fn probe(position: Vec3) -> Receiver {
    Receiver { position, normal: Vec3::ZERO, radius: 0.0, kind: SplatKind::Medium }
}

pub(crate) fn light_at(map: &ShadowMap, position: Vec3) -> f32 {
    map.transmittance(&probe(position))[0]
}

/// Media splats on a lattice of spacing `h` wherever `inside` holds, of extinction `sigma_t`.
pub(crate) fn medium(size: [i32; 3], h: f32, sigma_t: f32, inside: impl Fn(Vec3) -> bool) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let radius = Footprint::default().radius_for_spacing(h);
    for z in -size[2]..=size[2] {
        for y in -size[1]..=size[1] {
            for x in -size[0]..=size[0] {
                let position = Vec3::new(x as f32, y as f32, z as f32) * h;
                if inside(position) {
                    cloud.push(&Splat { position, radius, cross_section: sigma_t * h * h * h, ..Splat::default() });
                }
            }
        }
    }
    cloud
}

/// A ball of radius `r` about the origin, its splats weighted by the part of their voxel that lies in it: without that it
/// would be rough.
pub(crate) fn smooth_ball(h: f32, sigma_t: f32, r: f32) -> Cloud {
    let n = (r / h) as i32 + 2;
    let mut cloud = medium([n; 3], h, sigma_t, |p| p.length() < r + h);
    for i in 0..cloud.len() {
        if (cloud.position[i].length() - r).abs() > h {
            continue;
        }
        let part = |k: i32| (k as f32 - 3.5) * h / 8.0;
        let inside = |k: &i32| {
            let d = Vec3::new(part(k % 8), part(k / 8 % 8), part(k / 64));
            (cloud.position[i] + d).length() < r
        };
        cloud.cross_section[i] *= (0..512).filter(inside).count() as f32 / 512.0;
    }
    cloud
}

/// Length of a segment within that ball.
pub(crate) fn chord(from: Vec3, to: Vec3, r: f32) -> f64 {
    let (from, way) = (from.as_dvec3(), (to - from).as_dvec3());
    let b = from.dot(way.normalize());
    let square = b * b - from.length_squared() + f64::from(r * r);
    if square <= 0.0 {
        return 0.0;
    }
    let [enter, leave] = [-b - square.sqrt(), -b + square.sqrt()].map(|t| t.clamp(0.0, way.length()));
    leave - enter
}

/// A square lattice of discs in the plane through `centre` across `normal`, `n` a side.
pub(crate) fn plane(centre: Vec3, normal: Vec3, n: i32, h: f32, kind: SplatKind, depth: f32) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let normal = normal.normalize();
    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let radius = Footprint::default().radius_for_spacing(h);
    for j in -n..=n {
        for i in -n..=n {
            let position = centre + (u * i as f32 + v * j as f32) * h;
            let cross_section = depth * h * h;
            cloud.push(&Splat { position, radius, cross_section, kind, normal, ..Splat::default() });
        }
    }
    cloud
}

pub(crate) fn receiver(cloud: &Cloud, i: usize) -> Receiver {
    Receiver::of_splat(cloud, i)
}

/// Random unit vector.
pub(crate) fn direction(seed: u64, item: u64) -> Vec3 {
    let z = 2.0 * splat_core::rng::unit(seed, 0, item, 0) - 1.0;
    let phi = std::f64::consts::TAU * splat_core::rng::unit(seed, 0, item, 1);
    let s = (1.0 - z * z).sqrt();
    Vec3::new((s * phi.cos()) as f32, (s * phi.sin()) as f32, z as f32)
}

/// A cloud of media, surfaces and opaque discs at random places around `origin`.
pub(crate) fn mixed(n: u64, origin: DVec3) -> Cloud {
    let mut cloud = Cloud::new(origin);
    let unit = |i, k| splat_core::rng::unit_f32(17, 3, i, k);
    for i in 0..n {
        // Multiples of 1/1024: exact at any origin up to 1e10 and at any power of two.
        let grid = |k| (unit(i, k) * 2048.0).round() / 1024.0 - 1.0;
        cloud.push(&Splat {
            position: Vec3::new(grid(0), grid(1), grid(2)),
            radius: 0.02 + 0.06 * unit(i, 3),
            cross_section: 1e-3 * unit(i, 4),
            kind: [SplatKind::Medium, SplatKind::Surface, SplatKind::Medium, SplatKind::Opaque][(i % 4) as usize],
            normal: if i % 2 == 1 { direction(5, i) } else { Vec3::ZERO },
            ..Splat::default()
        });
    }
    cloud
}
