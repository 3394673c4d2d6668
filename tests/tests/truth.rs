//! The points technique against physical truth: the same scene path-traced without splats.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use organza::scene::{self, Scene};
use organza::truth::{Truth, truth};
use organza::{Progress, RenderOptions, render};
use std::path::Path;

const SAMPLES: u32 = 64;
/// Pixels along a side of the squares that are compared: means of 64 pixels, 4096 paths.
const SIDE: usize = 8;

fn scene(size: [u32; 2]) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/truth.toml");
    let mut scene = scene::parse(&path, &std::fs::read(&path).unwrap(), &Default::default()).unwrap();
    scene.camera.size = size;
    scene
}

fn traced(scene: &Scene) -> Result<Truth, String> {
    truth(scene, &RenderOptions::default(), SAMPLES, &Progress::new()).unwrap()
}

fn drawn(scene: &Scene) -> Vec<[f64; 3]> {
    let image = render(scene, &RenderOptions::default(), &Progress::new()).unwrap();
    image.layers.rgb("beauty").unwrap().iter().map(|p| p.map(f64::from)).collect()
}

/// Mean over each square of `SIDE`² pixels.
fn squares(image: &[[f64; 3]], [width, height]: [u32; 2]) -> Vec<[f64; 3]> {
    let (across, down) = (width as usize / SIDE, height as usize / SIDE);
    let mut out = vec![[0.0; 3]; across * down];
    for (k, pixel) in image.iter().enumerate() {
        let (x, y) = (k % width as usize / SIDE, k / width as usize / SIDE);
        (0..3).for_each(|c| out[y * across + x][c] += pixel[c] / (SIDE * SIDE) as f64);
    }
    out
}

fn rmse(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let square = |(a, b): (&[f64; 3], &[f64; 3])| (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>();
    (a.iter().zip(b).map(square).sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

#[test]
fn points_agree_with_path_tracing_of_meshes_media_and_translucent_surfaces() {
    let size = [160, 88];
    let scene = scene(size);
    let truth = traced(&scene).unwrap();
    let exact = squares(truth.image.pixels(), size);
    let image = drawn(&scene);
    let error = rmse(&squares(&image, size), &exact);
    // The truth's own error: a square holds 64 pixels.
    let noise = (truth.standard_error.iter().flatten().map(|s| s * s).sum::<f64>()
        / (3 * truth.standard_error.len() * SIDE * SIDE) as f64)
        .sqrt();
    println!("RMSE {error:.5}, truth's standard error {noise:.5}");
    assert!(noise < 0.003, "truth's standard error {noise}");
    assert!(error < 0.006, "RMSE {error}");
    // The comparison can fail: a fifth less light, or no shadows.
    let mut dimmer = scene.clone();
    dimmer.lights.iter_mut().for_each(|l| l.shadow = false);
    assert!(rmse(&squares(&drawn(&dimmer), size), &exact) > 3.0 * error);
}

#[test]
fn what_has_no_physical_form_is_named() {
    let mut unshadowed = scene([16, 9]);
    unshadowed.lights[0].shadow = false;
    assert!(traced(&unshadowed).unwrap_err().contains("light 0"));
    let mut thin = scene([16, 9]);
    thin.objects[1].casts_shadow = false;
    assert!(traced(&thin).unwrap_err().contains("'bunny'"));
}
