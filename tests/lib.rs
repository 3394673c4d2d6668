//! What the end-to-end tests share: scenes drawn by the library or by the real command.
#![allow(clippy::unwrap_used, clippy::missing_panics_doc, reason = "a test fails by panicking")]

use organza::{Layers, Progress, Render, RenderOptions, render, scene};

/// Head of a scene seen by parallel rays along −z: `height` world units in `size` pixels squared.
pub fn parallel_view(height: f64, size: u32) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\northographic = {height:?}\n\
         size = [{size}, {size}]\n"
    )
}

/// Renders a scene text.
pub fn draw(text: &str) -> Render {
    let scene = scene::parse("test.toml".as_ref(), text.as_bytes(), &scene::LoadOptions::default())
        .unwrap_or_else(|e| panic!("{e}\n{text}"));
    render(&scene, &RenderOptions::default(), &Progress::new()).unwrap_or_else(|e| panic!("{e}"))
}

/// Values of a scalar layer, or of one channel of a colour layer written `name.c` with c from 0 to 2.
pub fn channel(layers: &Layers, name: &str) -> Vec<f64> {
    if let Some(values) = layers.scalar(name) {
        return values.iter().map(|v| f64::from(*v)).collect();
    }
    let (name, c) = name.rsplit_once('.').unwrap();
    let c: usize = c.parse().unwrap();
    layers.rgb(name).unwrap().iter().map(|p| f64::from(p[c])).collect()
}

/// The values inside a rectangle of pixels, columns `x` and rows `y`.
pub fn window(values: &[f64], width: u32, x: std::ops::Range<u32>, y: std::ops::Range<u32>) -> Vec<f64> {
    y.flat_map(|y| x.clone().map(move |x| (y * width + x) as usize)).map(|k| values[k]).collect()
}

/// Mean, and the largest distance from it.
pub fn mean_and_ripple(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (mean, values.iter().map(|v| (v - mean).abs()).fold(0.0, f64::max))
}
