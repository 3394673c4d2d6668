//! How far the picture of a tabulated Gaussian is from that of the formula, by the table's size: the table of docs/accuracy.md.
//!
//! A disc of 90 pixels' radius whose image is the default profile, in the circle that its image holds, beside the disc of that circle by the
//! formula; without the pixel's filter, in the mean over 16 places in a pixel and 4 turns.

use glam::{DVec3, Vec3};
use splat_core::raster::{Detail, FoldInput, OpaqueImage, Params, ProjectInput, fold, project};
use splat_core::{
    Accumulator, Camera, Cloud, Direction, Footprint, FootprintImage, FootprintStack, Material, Projection, Splat,
    SplatKind, glam,
};

const SIZE: u32 = 192;
const RADIUS: f32 = 90.0;

/// Optical depths of one disc whose pixels are a unit wide.
fn depths(splat: &Splat, footprints: &FootprintStack) -> Vec<f32> {
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(splat);
    let view = Projection::Orthographic { height: f64::from(SIZE) };
    let camera = &Camera::look_at(DVec3::Z * 400.0, DVec3::ZERO, DVec3::Y, view, [SIZE, SIZE]).expect("a camera");
    let materials = &[Material::default()];
    let params = &Params { resampling_sigma_px: 0.0, ..Params::default() };
    let cloud = &cloud;
    let detail = Detail::ALL;
    let projected = &project(&ProjectInput { cloud, camera, footprints, materials, params, detail });
    let mut seen = Accumulator::new([SIZE; 2], 1, 3, false, false);
    let opaque = &OpaqueImage::default();
    let direction = Direction::FrontToBack;
    let input = FoldInput { projected, order: &[0], values: &[1.0; 3], materials, opaque, direction, params };
    fold(&input, &mut seen, None).expect("nobody cancels");
    seen.optical_depth.swap_remove(0)
}

/// Largest and root-mean-square difference over the peak, and the difference of the sums.
fn errors(texels: u32) -> [f64; 3] {
    let formula = Footprint::default();
    let at = |i: u32| (f64::from(i) + 0.5) / f64::from(texels) - 0.5;
    let places = (0..texels * texels).map(|k| [at(k % texels), at(k / texels)]);
    let coverage: Vec<f32> = places.map(|[x, y]| formula.profile(4.0 * (x * x + y * y)) as f32).collect();
    let image = FootprintImage::new([texels; 2], &coverage).expect("shares");
    let formulas = FootprintStack::default();
    let table = FootprintStack::default().with_image(0, image.into());
    let [mut largest, mut squares, mut sums, mut count] = [0.0f64; 4];
    for k in 0..64 {
        let position = Vec3::new((k % 4) as f32, (k / 4 % 4) as f32, 0.0) / 4.0;
        let (sin, cos) = (k as f32 / 16.0).floor().sin_cos();
        let splat =
            Splat { position, kind: SplatKind::Surface, normal: Vec3::Z, cross_section: 1.0, ..Splat::default() };
        let tangent = Vec3::new(cos, sin, 0.0) * RADIUS;
        let seen = depths(&Splat { radius: RADIUS, tangent, ..splat }, &table);
        let exact = depths(&Splat { radius: RADIUS * 0.5f32.sqrt(), ..splat }, &formulas);
        let peak = exact.iter().copied().fold(0.0, f32::max);
        for (a, b) in seen.iter().zip(&exact).filter(|(_, b)| **b > 0.0) {
            let error = f64::from((a - b) / peak);
            largest = largest.max(error.abs());
            squares += error * error;
            count += 1.0;
        }
        let sum = |depths: &[f32]| depths.iter().map(|d| f64::from(*d)).sum::<f64>();
        sums += (sum(&seen) / sum(&exact) - 1.0) / 64.0;
    }
    [largest, (squares / count).sqrt(), sums]
}

fn main() {
    println!("| texels a side | largest error over the peak | RMS over the peak | Στ off by |\n|---|---|---|---|");
    for texels in [8, 16, 32, 64, 128] {
        let [largest, rms, sums] = errors(texels);
        println!("| {texels} | {largest:.1e} | {rms:.1e} | {:.0e} |", sums.abs());
    }
}
