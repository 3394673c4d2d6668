//! A ball and a torus of clear glass before a wall of two colours, by index: how far the technique `surfels` stands from path tracing with
//! rays that are traced, bent by all layers together (Eq. 16 of Zhang and Pajarola 2007) or by the nearest alone; and where.
//!
//! `cargo run --release -p organza-benches --example glass -- docs/papers/zhang-pajarola-2007-glass.csv`
#![allow(clippy::expect_used, reason = "an example")]

use organza::scene::{LoadOptions, Override, Scene, parse};
use organza::{Progress, RenderOptions, render};
use organza_judge::truth::{Orders, truth};
use splat_core::LayerData;
use std::fmt::Write;

/// Pixels along a side; four samples each.
const SIDE: usize = 64;
/// Paths a sample.
const PATHS: u32 = 64;
/// Pixels of a body this near to its edge are its rim.
const RIM: usize = 4;

const INDICES: [f64; 7] = [1.0, 1.1, 1.2, 1.33, 1.5, 1.65, 1.8];

const SHAPES: [(&str, &str); 2] =
    [("ball", "x^2 + y^2 + z^2 - 0.25"), ("torus", "(sqrt(x^2 + y^2) - 0.4)^2 + z^2 - 0.0225")];

fn scene(shape: &str, set: &str, index: f64) -> Scene {
    let wall = |name: &str, y: f64, color: &str| {
        format!(
            "[material.{name}]\nshading = 'unlit'\ncolor = {color}\n[[object]]\nname = '{name}'\nmaterial = '{name}'\n\
             rectangle = {{ center = [0, {y:?}, -2], u = [3, 0, 0], v = [0, 1, 0], spacing = 0.04 }}\n"
        )
    };
    let text = format!(
        "version = 1\n[camera]\nposition = [0.6, 0.9, 3.8]\ntarget = [0, 0, 0]\nfov_y = 18\nsize = [{SIDE}, {SIDE}]\n\
         [background]\ncolor = [0.4, 0.5, 0.7]\n[material.glass]\nior = {index:?}\n\
         [[object]]\nname = 'body'\nmaterial = 'glass'\ntechnique = 'surfels'\n\
         implicit = {{ expression = '{shape}', box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], spacing = 0.02 }}\n{}{}\
         [render]\nlayers = ['object']\n",
        wall("above", 1.0, "[1, 0.1, 0]"),
        wall("below", -1.0, "[0, 0.2, 1]")
    );
    let overrides = vec![Override::parse(set).expect("a key")];
    parse("glass.toml".as_ref(), text.as_bytes(), &LoadOptions { overrides, ..LoadOptions::default() })
        .expect("a scene")
}

/// Pixels, and which of them show the body.
fn drawn(scene: &Scene) -> (Vec<[f64; 3]>, Vec<bool>) {
    let layers = render(scene, &RenderOptions::default(), &Progress::new()).expect("a picture").layers;
    let Some(LayerData::Id(ids)) = layers.images.get("object") else { panic!("objects were asked for") };
    let pixels = layers.rgb("beauty").expect("always there").iter().map(|p| p.map(f64::from)).collect();
    (pixels, ids.iter().map(|id| *id == 0).collect())
}

/// Path tracing of four times the pixels, averaged.
fn traced(scene: &Scene) -> Vec<[f64; 3]> {
    let truth = truth(scene, &RenderOptions::default(), Orders::One, PATHS, &Progress::new());
    let image = truth.expect("no limit").expect("every object has a truth").image;
    image.pixels().iter().map(|p| p.map(f64::from)).collect()
}

fn rmse(a: &[[f64; 3]], b: &[[f64; 3]], of: impl Fn(usize) -> bool) -> f64 {
    let chosen: Vec<usize> = (0..a.len()).filter(|k| of(*k)).collect();
    let square = |k: &usize| (0..3).map(|c| (a[*k][c] - b[*k][c]).powi(2)).sum::<f64>() / 3.0;
    (chosen.iter().map(square).sum::<f64>() / chosen.len().max(1) as f64).sqrt()
}

fn main() {
    let to = std::env::args().nth(1).expect("a file to write");
    let mut rows = String::from("shape,index,bending,rmse,rmse_inside,rmse_rim\n");
    for (name, shape) in SHAPES {
        for index in INDICES {
            let exact = traced(&scene(shape, "render.antialias=4", index));
            for bending in ["traced", "power", "nearest"] {
                let (seen, body) = drawn(&scene(shape, &format!("render.surfels.bending='{bending}'"), index));
                let is_rim = |k: usize| {
                    let around = |v: usize| v.saturating_sub(RIM)..(v + RIM + 1).min(SIDE);
                    body[k] && around(k / SIDE).any(|y| around(k % SIDE).any(|x| !body[y * SIDE + x]))
                };
                let all = rmse(&seen, &exact, |k| body[k]);
                let (inside, rim) = (rmse(&seen, &exact, |k| body[k] && !is_rim(k)), rmse(&seen, &exact, is_rim));
                let row = format!("{name},{index},{bending},{all:.4},{inside:.4},{rim:.4}");
                println!("{row}");
                writeln!(rows, "{row}").expect("a string takes all");
            }
        }
    }
    std::fs::write(to, rows).expect("a place for the table");
}
