//! How far glass by the technique `surfels` stands from path tracing, and where: a closed ball and a torus before a wall of two colours, by
//! index, with rays that are traced through all surfaces, bent by the number of layers (Eq. 16 of Zhang and Pajarola 2007), and bent by the
//! nearest layer alone. A table and a picture.
//!
//! `cargo run --release -p organza-judge --example glass -- docs/papers/zhang-pajarola-2007-glass.csv docs/images/glass-report.png`
#![allow(clippy::expect_used, reason = "an example")]

use organza::scene::{LoadOptions, Override, Scene, parse};
use organza::{Progress, RenderOptions, render};
use organza_judge::truth::{Orders, Truth, truth};
use splat_core::LayerData;
use std::fmt::Write;

/// Pixels along a side of what the table is of, and of a tile of the picture.
const SIDES: [usize; 2] = [64, 160];
/// Paths a pixel.
const PATHS: [u32; 2] = [100, 36];
/// Pixels of a body that lie nearer to its edge than this share of the side are its rim.
const RIM: f64 = 1.0 / 16.0;
/// Of the picture.
const SHOWN: f64 = 1.5;

const INDICES: [f64; 7] = [1.0, 1.1, 1.2, 1.33, SHOWN, 1.65, 1.8];
const BENDINGS: [&str; 3] = ["traced", "power", "nearest"];
const SHAPES: [(&str, &str); 2] =
    [("ball", "x^2 + y^2 + z^2 - 0.25"), ("torus", "(sqrt(x^2 + y^2) - 0.4)^2 + z^2 - 0.0225")];

type Picture = Vec<[f64; 3]>;

fn scene(shape: &str, set: &str, index: f64, side: usize) -> Scene {
    let wall = |name: &str, y: f64, color: &str| {
        format!(
            "[material.{name}]\nshading = 'unlit'\ncolor = {color}\n[[object]]\nname = '{name}'\nmaterial = '{name}'\n\
             rectangle = {{ center = [0, {y:?}, -2], u = [3, 0, 0], v = [0, 1, 0], spacing = 0.04 }}\n"
        )
    };
    let text = format!(
        "version = 1\n[camera]\nposition = [0.6, 0.9, 3.8]\ntarget = [0, 0, 0]\nfov_y = 18\nsize = [{side}, {side}]\n\
         [background]\ncolor = [0.4, 0.5, 0.7]\n[material.glass]\nior = {index:?}\n\
         [[object]]\nname = 'body'\nmaterial = 'glass'\ntechnique = 'surfels'\n\
         implicit = {{ expression = '{shape}', box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], spacing = 0.02 }}\n{}{}\
         [render]\nlayers = ['object']\n",
        wall("above", 1.0, "[1, 0.1, 0]"),
        wall("below", -1.0, "[0, 0.2, 1]")
    );
    let overrides = vec![Override::parse(set).expect("a key")];
    let options = LoadOptions { overrides, ..LoadOptions::default() };
    parse("glass.toml".as_ref(), text.as_bytes(), &options).expect("a scene")
}

/// Pixels, and which of them show the body.
fn drawn(shape: &str, bending: &str, index: f64, side: usize) -> (Picture, Vec<bool>) {
    let scene = scene(shape, &format!("render.surfels.bending='{bending}'"), index, side);
    let layers = render(&scene, &RenderOptions::default(), &Progress::new()).expect("a picture").layers;
    let Some(LayerData::Id(ids)) = layers.images.get("object") else { panic!("objects were asked for") };
    let pixels = layers.rgb("beauty").expect("always there").iter().map(|p| p.map(f64::from)).collect();
    (pixels, ids.iter().map(|id| *id == 0).collect())
}

/// Path tracing.
fn traced(shape: &str, index: f64, side: usize, paths: u32) -> Truth {
    let scene = scene(shape, "render.antialias=2", index, side);
    let truth = truth(&scene, &RenderOptions::default(), Orders::One, paths, &Progress::new());
    truth.expect("no limit").expect("every object has a truth")
}

/// The root of the mean squared difference of some pixels, without what the noise of path tracing has of it.
fn rmse(seen: &[[f64; 3]], exact: &Truth, chooses: impl Fn(usize) -> bool) -> f64 {
    let chosen: Vec<usize> = (0..seen.len()).filter(|k| chooses(*k)).collect();
    let square =
        |k: usize, c: usize| (seen[k][c] - exact.image.pixels()[k][c]).powi(2) - exact.standard_error[k][c].powi(2);
    let sum: f64 = chosen.iter().flat_map(|&k| (0..3).map(move |c| (k, c))).map(|(k, c)| square(k, c)).sum();
    (sum.max(0.0) / (3 * chosen.len()).max(1) as f64).sqrt()
}

/// Of all that the body covers, of its rim, and of what lies within that.
fn errors(seen: &[[f64; 3]], exact: &Truth, body: &[bool], side: usize) -> [f64; 3] {
    let reach = (RIM * side as f64) as usize;
    let is_rim = |k: usize| {
        let around = |v: usize| v.saturating_sub(reach)..(v + reach + 1).min(side);
        body[k] && around(k / side).any(|y| around(k % side).any(|x| !body[y * side + x]))
    };
    [rmse(seen, exact, |k| body[k]), rmse(seen, exact, is_rim), rmse(seen, exact, |k| body[k] && !is_rim(k))]
}

fn table() -> String {
    let mut rows = String::from("shape,index,bending,rmse,rmse_rim,rmse_within\n");
    for (name, shape) in SHAPES {
        for index in INDICES {
            let exact = traced(shape, index, SIDES[0], PATHS[0]);
            for bending in BENDINGS {
                let (seen, body) = drawn(shape, bending, index, SIDES[0]);
                let [all, rim, within] = errors(&seen, &exact, &body, SIDES[0]);
                let row = format!("{name},{index},{bending},{all:.4},{rim:.4},{within:.4}");
                println!("{row}");
                writeln!(rows, "{row}").expect("a string takes all");
            }
        }
    }
    rows
}

/// A row for each shape: path tracing, then each way of bending with the differences from that below it, black where there are none.
fn sheet() -> image::RgbImage {
    let side = SIDES[1];
    let columns = 1 + BENDINGS.len();
    let mut tiles: Vec<Picture> = Vec::new();
    for (_, shape) in SHAPES {
        let exact = traced(shape, SHOWN, side, PATHS[1]).image.pixels().to_vec();
        let seen = BENDINGS.map(|bending| drawn(shape, bending, SHOWN, side).0);
        let apart = |seen: &Picture| {
            seen.iter().zip(&exact).map(|(a, b)| [0, 1, 2].map(|c| (a[c] - b[c]).abs())).collect::<Picture>()
        };
        let differences = seen.each_ref().map(apart);
        tiles.push(exact.clone());
        tiles.extend(seen);
        tiles.push(vec![[0.0; 3]; side * side]);
        tiles.extend(differences);
    }
    let srgb = |v: f64| (255.0 * v.clamp(0.0, 1.0).powf(1.0 / 2.2) + 0.5) as u8;
    let size = [columns * side, tiles.len() / columns * side].map(|n| n as u32);
    image::RgbImage::from_fn(size[0], size[1], |x, y| {
        let x = x as usize;
        let y = y as usize;
        image::Rgb(tiles[y / side * columns + x / side][y % side * side + x % side].map(srgb))
    })
}

fn main() {
    let mut to = std::env::args().skip(1);
    let [rows, picture] = [(); 2].map(|()| to.next().expect("a file for the table, and one for the picture"));
    sheet().save(picture).expect("a place for the picture");
    std::fs::write(rows, table()).expect("a place for the table");
}
