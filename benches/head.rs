//! The MRI head of the assets, and other volumes seen as it is.

use read::{Loaded, ReadParams};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Camera, Grid, Projection, TransferFunction, TransferPoint};
use std::path::Path;

/// A volume whose view, transfer functions and extinctions are the head's, stretched over the range of its values and by its
/// diagonal. `benches/peers/vtk_volume.py` has the same.
pub struct HeadLike {
    /// The volume.
    pub grid: Grid,
    /// The value in the place of 0.
    lowest: f32,
    /// What one of the 255 steps of the head's values is.
    step: f32,
    /// Its diagonal over the head's.
    length: f64,
}

impl HeadLike {
    /// Skin, skull and brain, all translucent: values and extinctions in 1/mm.
    pub const SEMI: &[(f32, f32)] = &[(30.0, 0.0), (80.0, 0.004), (150.0, 0.01), (200.0, 0.05), (255.0, 0.08)];

    /// A surface that is nearly opaque.
    pub const ISO: &[(f32, f32)] = &[(90.0, 0.0), (110.0, 2.0)];

    /// The volume of a file, `dense`, which is a formula of 256³ voxels that are all visible, or the head.
    pub fn new(file: Option<&str>) -> Self {
        const HEAD: DVec3 = DVec3::new(197.0, 233.0, 189.0);
        let asset = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/mni152/mni152_t1.nii.gz");
        let grid = match file {
            Some("dense") => dense(),
            Some(file) => read(Path::new(file)),
            None => read(&asset),
        };
        let range = |least: f32, of: fn(f32, f32) -> f32| grid.values.iter().copied().fold(least, of);
        let in_bytes = file.is_none_or(|file| file == "dense");
        let (lowest, highest) =
            if in_bytes { (0.0, 255.0) } else { (range(f32::MAX, f32::min), range(f32::MIN, f32::max)) };
        let diagonal = (grid.axes * DVec3::from_array(grid.dims.map(|n| n as f64))).length();
        Self { lowest, step: (highest - lowest) / 255.0, length: diagonal / HEAD.length(), grid }
    }

    /// A transfer function from extinctions in 1/mm of the head at its values of 0 to 255.
    pub fn transfer(&self, points: &[(f32, f32)]) -> TransferFunction {
        let point = |&(value, extinction): &(f32, f32)| {
            let t = value / 255.0;
            let color = [0.4 + 0.6 * t, 0.9 * t, 0.8 - 0.6 * t];
            let extinction = extinction / self.length as f32;
            TransferPoint { value: self.lowest + self.step * value, color, extinction }
        };
        TransferFunction::new(points.iter().map(point).collect()).expect("values rise")
    }

    /// A square picture of all of it, by parallel rays or in perspective.
    pub fn camera(&self, pixels: u32, perspective: bool) -> Camera {
        let middle = self.grid.origin + self.grid.axes * DVec3::from_array(self.grid.dims.map(|n| 0.5 * n as f64));
        let projection = if perspective {
            Projection::Perspective { fov_y: 0.54 }
        } else {
            Projection::Orthographic { height: 240.0 * self.length }
        };
        let eye = middle + self.length * DVec3::new(-260.0, 260.0, 100.0);
        Camera::look_at(eye, middle, DVec3::Z, projection, [pixels; 2]).expect("a camera")
    }
}

fn read(path: &Path) -> Grid {
    match read::file(path, &ReadParams::default(), None).expect("a volume that can be read") {
        (Loaded::Grid(grid), _) => grid,
        _ => panic!("{} is no volume", path.display()),
    }
}

/// Three waves whose values are 40 to 240: the head's transfer functions show all of them.
fn dense() -> Grid {
    let wave = |n: usize| (n as f64 / 256.0 * std::f64::consts::TAU * 3.0).sin();
    let value = |i: usize| (140.0 + 100.0 / 3.0 * (wave(i % 256) + wave(i / 256 % 256) + wave(i >> 16))).round();
    let values = (0..256 * 256 * 256).map(|i| value(i) as f32).collect();
    Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims: [256; 3], values }
}
