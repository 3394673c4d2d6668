//! What the end-to-end tests share: the real command, from a scene text to the channels of its EXR file.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc, reason = "a test fails by panicking")]

mod peak;
mod place;

pub use peak::{Peak, run_measured};
pub use place::Place;

use exr::prelude::{ReadChannels, ReadLayers, read};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

/// The command, which cargo builds beside the tests.
pub fn organza() -> Command {
    let test = std::env::current_exe().unwrap();
    let folder = test.parent().and_then(Path::parent).unwrap();
    Command::new(folder.join(format!("organza-under-test{}", std::env::consts::EXE_SUFFIX)))
}

/// The channels of an EXR file by name, such as `R`, `A`, `direct.G`, `depth.first.Z`.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Width and height, pixels.
    pub size: [u32; 2],
    channels: BTreeMap<String, Vec<f32>>,
}

impl Picture {
    /// Values of a channel, row by row from the top left.
    pub fn channel(&self, name: &str) -> Vec<f64> {
        let values =
            self.channels.get(name).unwrap_or_else(|| panic!("no channel {name} in {:?}", self.channels.keys()));
        values.iter().map(|v| f64::from(*v)).collect()
    }

    /// Opacity of what lies before the background: `A`, or `opacity.A` where the background is part of the picture.
    pub fn opacity(&self) -> Vec<f64> {
        self.channel(if self.channels.contains_key("opacity.A") { "opacity.A" } else { "A" })
    }

    /// Names of all channels in alphabetical order.
    pub fn names(&self) -> Vec<String> {
        self.channels.keys().cloned().collect()
    }

    /// SHA-256 of all channels; depths are divided by `scale`, a power of two, first.
    pub fn sha256(&self, scale: f64) -> String {
        let mut hasher = Sha256::new();
        for (name, values) in &self.channels {
            let scale = if name.ends_with('Z') { scale } else { 1.0 };
            values.iter().for_each(|v| hasher.update(((f64::from(*v) / scale) as f32).to_bits().to_le_bytes()));
        }
        hasher.finalize().iter().fold(String::new(), |text, byte| text + &format!("{byte:02x}"))
    }
}

/// Runs `organza render` on a scene text and reads the EXR file.
pub fn draw(scene: &str, arguments: &[&str]) -> Picture {
    draw_in(tempfile::tempdir().unwrap().path(), scene, arguments)
}

/// [`draw`] in a folder that holds the scene's data.
pub fn draw_in(folder: &Path, scene: &str, arguments: &[&str]) -> Picture {
    std::fs::write(folder.join("scene.toml"), scene).unwrap();
    draw_file(&folder.join("scene.toml"), arguments)
}

/// [`draw`] of a scene file.
pub fn draw_file(scene: &Path, arguments: &[&str]) -> Picture {
    let folder = tempfile::tempdir().unwrap();
    let image = folder.path().join("out.exr");
    let mut command = organza();
    command.arg("render").arg(scene).arg("-o").arg(&image).args(arguments);
    let out = command.output().unwrap();
    assert!(out.status.success(), "{}\n{}", String::from_utf8_lossy(&out.stderr), scene.display());
    picture_of(&image)
}

/// The channels of an EXR file.
pub fn picture_of(image: &Path) -> Picture {
    let reader = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = reader.from_file(image).unwrap();
    let layer = image.layer_data;
    let channels = layer.channel_data.list.iter();
    Picture {
        size: [layer.size.0 as u32, layer.size.1 as u32],
        channels: channels.map(|c| (c.name.to_string(), c.sample_data.values_as_f32().collect())).collect(),
    }
}

/// A Radiance HDR image of these mantissas and exponents, by column and row.
pub fn hdr(size: [u32; 2], pixel: impl Fn(u32, u32) -> [u8; 4]) -> Vec<u8> {
    let header = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", size[1], size[0]);
    let pixels = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
    header.into_bytes().into_iter().chain(pixels.flat_map(|(x, y)| pixel(x, y))).collect()
}

/// Head of a scene seen by parallel rays along −z: `height` world units in `size` pixels squared.
pub fn parallel_view(height: f64, size: u32) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\northographic = {height:?}\n\
         size = [{size}, {size}]\n"
    )
}

/// Head of a scene for the command: a small picture with a point light.
pub const SMALL_SCENE: &str = r#"version = 1
[camera]
position = [0, 0, 4]
target = [0, 0, 0]
size = [24, 16]
[background]
color = [0.25, 0.5, 1.0]
[[light]]
kind = "point"
position = [2, 4, 1]
intensity = [20, 20, 20]
"#;

/// The values inside a rectangle of pixels, columns `x` and rows `y`.
pub fn window(values: &[f64], width: u32, x: std::ops::Range<u32>, y: std::ops::Range<u32>) -> Vec<f64> {
    y.flat_map(|y| x.clone().map(move |x| (y * width + x) as usize)).map(|k| values[k]).collect()
}

/// Mean, and the largest distance from it.
pub fn mean_and_ripple(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (mean, values.iter().map(|v| (v - mean).abs()).fold(0.0, f64::max))
}

/// The layers that sum to beauty, of every technique that there is.
pub const EFFECTS: [&str; 5] = ["background", "ambient", "emission", "direct", "scatter1"];

/// The sum of [`EFFECTS`] in the channel `R`, `G` or `B`, and of those effects that not every scene has.
pub fn sum_of_effects(picture: &Picture, channel: &str) -> Vec<f64> {
    const OF_SOME: [&str; 3] = ["scatterN", "reflection", "refraction"];
    let name = |effect: &str| format!("{effect}.{channel}");
    let some = OF_SOME.map(name).into_iter().filter(|name| picture.channels.contains_key(name));
    let names = EFFECTS.map(name).into_iter().chain(some);
    let effects: Vec<Vec<f64>> = names.map(|name| picture.channel(&name)).collect();
    (0..effects[0].len()).map(|k| effects.iter().map(|effect| effect[k]).sum()).collect()
}

/// Largest difference between two channels.
pub fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
