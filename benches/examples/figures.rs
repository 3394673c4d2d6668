//! Figures 12, 13, 15, 16 and 19 of Zhang and Pajarola 2007 with scans of our own, as one sheet of four columns. Rows from the top:
//!
//! 1. one group of eight by WGC, by hashing with collisions kept and with collisions resolved (Fig. 12), and one of four by WGC (Fig. 16);
//! 2. all groups of each of these in 1+1 passes;
//! 3. 1+1 passes by plain depth with groups by MGC, c = 1, 0.8, 0.6 and 0.4 (Fig. 13);
//! 4. 2+1 passes of the same bunny; dragon, bunny and raw LiDAR at c = 0.4 with Eq. 14 (Fig. 15);
//! 5. opaque balls that bounce about a translucent dragon: Algorithm 1, Algorithm 2 (Fig. 19), the three nearest layers, gaps.
//!
//! `cargo run --release -p organza-benches --example figures -- docs/images/surfel-figures.png`
#![allow(clippy::expect_used, reason = "an example")]

use deferred_blend::grouping::{Collisions, Coverage, Method, Recipe};
use deferred_blend::{DiscInput, Discs, OpaqueInput, Params, Passes, Shown, resolve_opaque};
use organza::scene::{LoadOptions, Override, Scene, load, parse};
use organza::{Context, Files, Progress, RenderOptions, render};
use std::path::Path;

/// A tile.
const SIZE: [u32; 2] = [200, 170];
const COLUMNS: u32 = 4;
/// Frame of the bouncing balls.
const FRAME: u32 = 5;

type Picture = Vec<[f32; 3]>;

fn options(sets: &[&str], frame: Option<u32>) -> LoadOptions {
    let size = format!("camera.size=[{}, {}]", SIZE[0], SIZE[1]);
    let sets = std::iter::once(&*size).chain(sets.iter().copied());
    let overrides = sets.map(|set| Override::parse(set).expect("a key")).collect();
    LoadOptions { overrides, frame, ..LoadOptions::default() }
}

fn scenes() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes")
}

/// An opaque model before white.
fn model(camera: &str, object: &str, sets: &[&str]) -> Scene {
    let text = format!(
        "version = 1\n[camera]\n{camera}\n[background]\ncolor = [1, 1, 1]\n[ambient]\ncolor = [0.2, 0.2, 0.22]\n\
         [[light]]\nkind = 'directional'\ndirection = [0.4, -0.6, -0.7]\nirradiance = [2.4, 2.3, 2.2]\n\
         [material.clay]\nspecular = 0.05\n[[object]]\nname = 'model'\nmaterial = 'clay'\n{object}\n[render]\ntechnique = 'surfels'\n"
    );
    parse(&scenes().join("figures.toml"), text.as_bytes(), &options(sets, None)).expect("a scene")
}

const NEAR: &str = "position = [-25, 45, 60]\ntarget = [-15, 35, 6]\nfov_y = 8";
const WHOLE: &str = "position = [-30, 38, 115]\ntarget = [0, 24, 0]\nfov_y = 26";
const BUNNY: &str = "mesh = '../assets/stanford-bunny/bunny.ply.gz'\ntransform = { up = 'z' }\n";
const DRAGON: &str = "mesh = '../assets/stanford-dragon/dragon_res3.ply.gz'";
const BEFORE_DRAGON: &str = "position = [0.1, 0.19, 0.4]\ntarget = [-0.003, 0.12, -0.003]\nfov_y = 28";
const LIDAR: &str = "points = '../assets/autzen/autzen_trim.laz'";

fn drawn(scene: &Scene) -> Picture {
    let options = RenderOptions::default();
    render(scene, &options, &Progress::new()).expect("a picture").layers.rgb("beauty").expect("always there").to_vec()
}

/// The discs of one group that face the viewer.
fn one_group(scene: &Scene, method: Method, groups: u32) -> Picture {
    let context = Context { files: &Files::default(), options: &RenderOptions::default(), progress: &Progress::new() };
    let loaded = organza::load(scene, context).expect("the model");
    let cloud = &loaded.cloud;
    let params = Params::default();
    let Params { disc_scale, gap, .. } = params;
    let recipe = Recipe { method, groups, coverage: Coverage::Partial, disc_scale, gap };
    let members = recipe.group(cloud, None).expect("groups");
    let eye = (loaded.camera.position - cloud.origin).as_vec3();
    let cosine = |i: usize| cloud.normal[i].dot((eye - cloud.position[i]).normalize());
    let is_seen = |i: &u32| members.groups().by_disc()[*i as usize] == 0 && cosine(*i as usize) > 0.0;
    let ids: Vec<u32> = (0..cloud.len() as u32).filter(is_seen).collect();
    let values: Vec<f32> = (0..cloud.len()).map(|i| 0.7 * cosine(i).max(0.0)).collect();
    let camera = &loaded.camera.with_samples(2);
    let input = DiscInput { cloud, ids: &ids, camera, footprints: &loaded.footprints, materials: &loaded.materials };
    let discs = &Discs::project(&input, &params);
    let shown = Shown::Discs(&values);
    let passes = Passes::TwoPlusOne;
    let input = OpaqueInput { discs, shown, channels: 1, objects: false, passes, max_bytes: u64::MAX };
    let seen = resolve_opaque(&input, &params, None).expect("a picture");
    let sample = |x: u32, y: u32| {
        let k = (y * 2 * SIZE[0] + x) as usize;
        if seen.disc[k] == u32::MAX { 1.0 } else { seen.image.channels[0][k] }
    };
    let pixel = |x: u32, y: u32| (0..4).map(|k| sample(2 * x + k % 2, 2 * y + k / 2)).sum::<f32>() / 4.0;
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y))).map(|(x, y)| [pixel(x, y); 3]).collect()
}

fn main() {
    let to = std::env::args().nth(1).expect("a file to write");
    let bunny = |sets: &[&str]| model(NEAR, BUNNY, sets);
    let one_pass = "render.surfels.opaque='one_pass'";
    let plain = "render.surfels.voronoi=false";
    let eight = "render.surfels.groups=8";
    let four = "render.surfels.groups=4";
    let by = |grouping: &'static str| -> Vec<&'static str> {
        match grouping {
            "wgc" => vec![one_pass, "render.surfels.grouping='wgc'"],
            "keep" => vec![one_pass, "render.surfels.grouping='hash'", "render.surfels.collisions='keep'"],
            _ => vec![one_pass, "render.surfels.grouping='hash'"],
        }
    };
    let [keep, resolve] = [Collisions::Keep, Collisions::Resolve].map(Method::Hash);
    let mut tiles = vec![
        one_group(&bunny(&[]), Method::Weighted, 8),
        one_group(&bunny(&[]), keep, 8),
        one_group(&bunny(&[]), resolve, 8),
        one_group(&bunny(&[]), Method::Weighted, 4),
    ];
    for (grouping, count) in [("wgc", eight), ("keep", eight), ("resolve", eight), ("wgc", four)] {
        tiles.push(drawn(&bunny(&[&*by(grouping), &[count]].concat())));
    }
    let at = |c: f64| format!("render.surfels.overlap_factor={c}");
    let mgc = [one_pass, "render.surfels.grouping='mgc'"];
    for c in [1.0, 0.8, 0.6, 0.4] {
        tiles.push(drawn(&bunny(&[&mgc[..], &[plain, &at(c)]].concat())));
    }
    tiles.push(drawn(&bunny(&[])));
    let last = at(0.4);
    let voronoi = [&mgc[..], &[&*last]].concat();
    for (camera, object) in [(BEFORE_DRAGON, DRAGON), (WHOLE, BUNNY), ("auto = true", LIDAR)] {
        tiles.push(drawn(&model(camera, object, &voronoi)));
    }
    let layers =
        ["algorithm1", "algorithm2", "peeled", "gaps"].map(|layers| format!("render.surfels.layers='{layers}'"));
    for set in &layers {
        let more: &[&str] = if set.contains("peeled") { &["render.surfels.peeled_layers=3"] } else { &[] };
        let sets = [&[&**set], more].concat();
        tiles.push(drawn(&load(&scenes().join("bouncing.toml"), &options(&sets, Some(FRAME))).expect("a scene")));
    }
    let srgb = |v: f32| (255.0 * v.clamp(0.0, 1.0).powf(1.0 / 2.2) + 0.5) as u8;
    let sheet = image::RgbImage::from_fn(COLUMNS * SIZE[0], tiles.len() as u32 / COLUMNS * SIZE[1], |x, y| {
        let tile = &tiles[(y / SIZE[1] * COLUMNS + x / SIZE[0]) as usize];
        image::Rgb(tile[(y % SIZE[1] * SIZE[0] + x % SIZE[0]) as usize].map(srgb))
    });
    sheet.save(to).expect("a place for the sheet");
}
