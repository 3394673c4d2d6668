//! Means of particles that a device makes: the CPU's of other seeds, to a stated level.

use crate::generated::{ROOM, World, by_device, by_processor, pixels, splats};
use gpu_conformance::open;
use pbsr::{Ensemble, MeshSampler, SurfaceParams};

/// Sets of the test of means, as runs of the device.
const RUNS: u32 = 12;

/// How far the means of two ensembles of other seeds are apart, in standard deviations that are 3.09 at p = 0.001: of the sum
/// of the squares of all pixels' deviations (χ², by Wilson and Hilferty), and of hits and of luminance in all.
fn deviations(a: &Ensemble, b: &Ensemble) -> [f64; 3] {
    let levels = f64::from(a.levels());
    assert_eq!(a.levels(), b.levels());
    let mut chi2 = 0.0;
    let mut bins = 0.0;
    let mut sum = 0.0;
    let mut variance = 0.0;
    for (x, y) in pixels() {
        let [ha, hb] = [a, b].map(|e| f64::from(e.hits(x, y)));
        let p = (ha + hb) / (2.0 * levels);
        let of_difference = 2.0 * levels * p * (1.0 - p);
        sum += ha - hb;
        variance += of_difference;
        // Where hits and sets without one are many, the difference is normal.
        if of_difference > 8.0 {
            chi2 += (ha - hb).powi(2) / of_difference;
            bins += 1.0;
        }
    }
    assert!(bins > 2000.0, "{bins}");
    let h: f64 = 2.0 / (9.0 * bins);
    let of_chi2 = ((chi2 / bins).cbrt() - (1.0 - h)) / h.sqrt();
    let [a, b] = [a, b].map(|e| e.read(&|_, _| [0.0; 3], None));
    let light = |p: &[f32; 3]| f64::from(p[0]) * 0.2126 + f64::from(p[1]) * 0.7152 + f64::from(p[2]) * 0.0722;
    let lights = a.rgb("beauty").unwrap().iter().zip(b.rgb("beauty").unwrap());
    let apart: f64 = lights.map(|(a, b)| light(a) - light(b)).sum();
    let squares =
        |e: &splat_core::Layers| -> f64 { e.scalar("std_error").unwrap().iter().map(|s| f64::from(*s).powi(2)).sum() };
    [of_chi2, sum / variance.sqrt(), apart / (squares(&a) + squares(&b)).sqrt()]
}

/// Whether every access of a kernel is looked at: then means take minutes, and those of one seed show the same recordings.
fn assisted() -> bool {
    std::env::var("ORGANZA_VALIDATION").is_ok_and(|v| v == "gpu-assisted")
}

#[test]
fn means_of_other_seeds_are_the_cpu_s_and_a_bias_is_found() {
    if assisted() {
        return;
    }
    let world = World::new();
    let ensemble = |seed, bias, device| {
        // Nothing is widened, so that pixels are independent.
        let (wall, sheet, volume) = world.samplers(seed, 1.0, bias);
        world.with([&wall, &sheet, &volume], |scene| {
            if device { by_device(&mut open().unwrap(), scene, RUNS) } else { by_processor(scene, RUNS * ROOM.levels) }
        })
    };
    let cpu = ensemble(101, 1.0, false);
    let [chi2, hits, light] = deviations(&ensemble(202, 1.0, true), &cpu);
    assert!(chi2 < 3.09 && hits.abs() < 3.29 && light.abs() < 3.29, "{chi2} {hits} {light}");
    // Optical depths of 4 % more.
    let [_, hits, light] = deviations(&ensemble(202, 1.04, true), &cpu);
    assert!(hits > 6.0 && light.abs() > 6.0, "{hits} {light}");
    // The same number of particles in other places.
    let mut moved = World::new();
    moved.camera.position.x += 0.03;
    let (wall, sheet, volume) = moved.samplers(202, 1.0, 1.0);
    let [chi2, ..] =
        deviations(&moved.with([&wall, &sheet, &volume], |scene| by_device(&mut open().unwrap(), scene, RUNS)), &cpu);
    assert!(chi2 > 6.0, "{chi2}");
}

#[test]
fn means_of_crossings_are_the_cpu_s_and_a_bias_is_found() {
    if assisted() {
        return;
    }
    let world = World::new();
    let ensemble = |seed, bias, device| {
        let (wall, ..) = world.samplers(seed, 1.0, bias);
        let clear = SurfaceParams { opacity: 0.0, ..SurfaceParams::default() };
        let nothing = MeshSampler::new(&world.wall, &clear, None).unwrap();
        world.with([&wall, &world.crossings(seed, 1.0, bias), &nothing], |scene| {
            if device { by_device(&mut open().unwrap(), scene, RUNS) } else { by_processor(scene, RUNS * ROOM.levels) }
        })
    };
    let cpu = ensemble(303, 1.0, false);
    let [chi2, hits, light] = deviations(&ensemble(404, 1.0, true), &cpu);
    assert!(chi2 < 3.09 && hits.abs() < 3.29 && light.abs() < 3.29, "{chi2} {hits} {light}");
    let [_, hits, light] = deviations(&ensemble(404, 1.1, true), &cpu);
    assert!(hits > 6.0 && light.abs() > 6.0, "{hits} {light}");
}

#[test]
fn means_of_splats_are_the_cpu_s_and_a_bias_is_found() {
    if assisted() {
        return;
    }
    let world = World::new();
    let clear = SurfaceParams { opacity: 0.0, ..SurfaceParams::default() };
    let nothing = MeshSampler::new(&world.wall, &clear, None).unwrap();
    let ensemble = |world: &World, seed, device| {
        world.with([&world.splats(seed, 1.0), &nothing, &nothing], |scene| {
            if device { by_device(&mut open().unwrap(), scene, RUNS) } else { by_processor(scene, RUNS * ROOM.levels) }
        })
    };
    let cpu = ensemble(&world, 505, false);
    let [chi2, hits, light] = deviations(&ensemble(&world, 606, true), &cpu);
    assert!(chi2 < 3.09 && hits.abs() < 3.29 && light.abs() < 3.29, "{chi2} {hits} {light}");
    // Kernels of 30 % more radius: the same number of particles, in other places.
    let mut wide = World::new();
    wide.cloud.radius.iter_mut().for_each(|radius| *radius *= 1.3);
    let [chi2, ..] = deviations(&ensemble(&wide, 606, true), &cpu);
    assert!(chi2 > 6.0, "{chi2}");
    // Optical depths of 4 % more.
    wide.cloud = splats();
    wide.cloud.cross_section.iter_mut().for_each(|area| *area *= 1.04);
    let [_, hits, light] = deviations(&ensemble(&wide, 606, true), &cpu);
    assert!(hits > 6.0 && light.abs() > 6.0, "{hits} {light}");
}
