//! A whole frame of the outdoor scene, from files to image, and its parts by the cost record; and one of as many points as the
//! paper's largest scene has, where the camera turns; and one of a dragon alone, opaque and translucent.
//!
//! Plain tables of minima, and of medians: other work on the machine only ever adds time.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use organza::scene::{LoadOptions, Override, Scene};
use organza::{Progress, Render, RenderOptions, Sequence, render, scene};
use organza_benches::record;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

const REPEATS: usize = 7;
/// Frames in which the camera turns, by 6° each.
const TURNED: u32 = 12;
/// Spacings that make 1.84 M splats of the scene, the points of Gunjee 2007, Table 1, in the picture of its size.
const PAPER: [&str; 7] = [
    "object.bunny.spacing=0.004",
    "object.cloud.cloud.spacing=0.014",
    "object.fountain.density.spacing=0.0091",
    "object.crown.implicit.spacing=0.007",
    "object.trunk.implicit.spacing=0.007",
    "camera.size=[600, 500]",
    "render.antialias=1",
];

/// A dragon alone of 0.60 M discs, which lets light through unless told otherwise.
const DRAGON: [&str; 6] = [
    "object.dragon.spacing=0.00042",
    "object.ball.visible=false",
    "object.table.visible=false",
    "camera.size=[600, 500]",
    "render.technique=points",
    "render.antialias=1",
];

fn main() {
    let options = RenderOptions::default();
    let progress = Progress::new();
    let mut whole = Passes::default();
    let outdoor = load("outdoor", &LoadOptions::default());
    for _ in 0..REPEATS {
        whole.add(|| render(&outdoor, &options, &progress).expect("the scene renders"));
    }
    println!("outdoor, 960x540 with 4 samples a pixel: least of {REPEATS}");
    whole.print("outdoor", |seconds| seconds[0]);
    turn("turning", "outdoor", &PAPER);
    turn("opaque dragon", "dragon", &[&DRAGON[..], &["object.dragon.opacity=1.0"]].concat());
    turn("translucent dragon", "dragon", &DRAGON);
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        status.lines().filter(|l| l.starts_with("VmHWM")).for_each(|l| println!("{l}"));
    }
}

/// A scene with changes, whose camera turns: the frames behind the first.
fn turn(name: &str, file: &str, sets: &[&str]) {
    let options = RenderOptions::default();
    let progress = Progress::new();
    let overrides: Vec<Override> = sets.iter().map(|set| Override::parse(set).expect("an override")).collect();
    let frame =
        |k| LoadOptions { frame: Some(k), turntable: Some(60), overrides: overrides.clone(), ..LoadOptions::default() };
    let frames: Vec<Scene> = (0..=TURNED).map(|k| load(file, &frame(k))).collect();
    let mut sequence = Sequence::new(&frames);
    let mut turned = Passes::default();
    for (k, scene) in frames.iter().enumerate() {
        let mut draw = || sequence.render(scene, &options, &progress).expect("the scene renders");
        match k {
            0 => println!("{name}, 600x500, {} splats", drawn(&draw())),
            _ => turned.add(draw),
        }
    }
    println!("frames behind the first: medians of {TURNED}");
    turned.print(name, |seconds| seconds[seconds.len() / 2]);
}

fn load(name: &str, options: &LoadOptions) -> Scene {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenes/{name}.toml"));
    scene::load(&file, options).expect("a scene of the repository")
}

/// Splats that were given footprints.
fn drawn(render: &Render) -> u64 {
    render.cost.stages.iter().filter(|stage| stage.name == organza::pass::PROJECT).map(|stage| stage.items_in).sum()
}

/// Seconds of passes by name, and splats of a frame.
#[derive(Default)]
struct Passes(BTreeMap<String, Vec<f64>>, u64);

impl Passes {
    fn add(&mut self, draw: impl FnOnce() -> Render) {
        let start = Instant::now();
        let rendered = draw();
        self.1 = drawn(&rendered);
        let mut of_one = BTreeMap::from([("total".to_owned(), start.elapsed().as_secs_f64())]);
        for stage in &rendered.cost.stages {
            *of_one.entry(stage.name.clone()).or_default() += stage.seconds;
        }
        of_one.into_iter().for_each(|(name, seconds)| self.0.entry(name).or_default().push(seconds));
    }

    /// What is taken of each pass's seconds, which rise.
    fn print(mut self, frame: &str, statistic: impl Fn(&[f64]) -> f64) {
        for (name, seconds) in &mut self.0 {
            seconds.sort_by(f64::total_cmp);
            println!("{name:>16} {:8.1} ms", statistic(seconds) * 1e3);
            record(&format!("frame/{frame}/{name}"), &seconds.iter().map(|s| 1e3 * s).collect::<Vec<_>>(), self.1);
        }
    }
}
