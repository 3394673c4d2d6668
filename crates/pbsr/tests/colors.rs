//! Colours of particles have nine bits each, and no bias: what is seen of many is the colour itself.

use crate::common::*;
use pbsr::{
    BrownianParams, BrownianSampler, Density, FieldVolumeParams, FieldVolumeSampler, GridSampler, ImplicitSurface,
    LatticeSampler, LineParams, LineSampler, MeshSampler, MetropolisParams, MetropolisSampler, PackedColor, Particles,
    Sampler, SplatParams, SplatSampler, SurfaceParams, VolumeParams, pixel_area,
};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Cloud, DAabb, Grid, Interpolation, Splat, SplatKind, TransferFunction, TransferPoint, rng};

/// Far from what nine bits hold: nearest rounding changes the channels by 8·10⁻⁴, 10⁻³ and 6·10⁻³ of themselves.
const COLOR: [f32; 3] = [0.950_01, 0.5005, 0.0511];

/// The largest deviation of the means of some colours from [`COLOR`] in standard deviations, and the standard deviations
/// over the colour.
fn deviation(colors: impl Iterator<Item = [f32; 3]>) -> (f64, f64) {
    let mut n = 0.0;
    let mut sum = [0.0; 3];
    let mut squares = [0.0; 3];
    for color in colors {
        n += 1.0;
        for c in 0..3 {
            let off = f64::from(color[c]) - f64::from(COLOR[c]);
            sum[c] += off;
            squares[c] += off * off;
        }
    }
    let sigma = |c: usize| (squares[c] / n).sqrt() / n.sqrt();
    let worst = |number: &dyn Fn(usize) -> f64| (0..3).map(number).fold(0.0, f64::max);
    (worst(&|c| (sum[c] / n).abs() / sigma(c)), worst(&|c| sigma(c) / f64::from(COLOR[c])))
}

/// 4 σ: one in a thousand of three channels and more samplers deviates as far by chance.
#[track_caller]
fn no_bias(name: &str, colors: impl Iterator<Item = [f32; 3]>) {
    let (off, sigma) = deviation(colors);
    assert!(4.0 * sigma < 2e-4, "{name}: a bias of 2e-4 would not be seen: {sigma}");
    assert!(off < 4.0, "{name}: {off} standard deviations");
}

fn surface() -> SurfaceParams {
    SurfaceParams { cross_section: 4e-6, color: COLOR, ..SurfaceParams::default() }
}

#[test]
fn every_sampler_gives_its_colour_in_the_mean() {
    let mesh = rectangle(Vec3::ZERO, Vec3::X, Vec3::Y, 3);
    let mut colored = mesh.clone();
    colored.color = vec![[1.0; 3]; mesh.position.len()];
    let ball = ImplicitSurface {
        field: &Field::UNIT,
        level: 0.0,
        bounds: DAabb::around(DVec3::ZERO, DVec3::splat(1.1)),
        inside: None,
    };
    let axes = DMat3::from_diagonal(DVec3::splat(0.25));
    let grid = Grid { origin: DVec3::splat(-0.9), axes, dims: [8; 3], values: (0..512).map(|i| i as f32).collect() };
    let point = |value| TransferPoint { value, color: COLOR, extinction: 1.0 };
    let transfer = TransferFunction::new(vec![point(0.0), point(511.0)]).unwrap();
    let volume = VolumeParams { cross_section: 8e-6, ..VolumeParams::default() };
    let few = MetropolisParams { burn_in: 4, stride: 1, ..MetropolisParams::default() };
    let mut cloud = Cloud::new(DVec3::ZERO);
    for (kind, normal) in [(SplatKind::Medium, Vec3::ZERO), (SplatKind::Surface, Vec3::Z)] {
        cloud.push(&Splat { radius: 0.5, cross_section: 3.0, color: COLOR, kind, normal, ..Splat::default() });
    }
    let extinction = Density { field: &Field::Nothing, max: 1.0 };
    let splats = SplatParams { cross_section: 4e-6, ..SplatParams::default() };
    let walk = BrownianParams::for_width(2.0);
    let fine = SurfaceParams { cross_section: 1e-5, ..surface() };
    let samplers: [(&str, Box<dyn Sampler + '_>); 9] = [
        ("triangles", Box::new(MeshSampler::new(&mesh, &surface(), None).unwrap())),
        ("colours of vertices", Box::new(MeshSampler::new(&colored, &surface(), None).unwrap())),
        ("lines", Box::new(LineSampler::new(&ball, &LineParams { resolution: 24 }, &fine, None).unwrap())),
        ("lattice lines", Box::new(LatticeSampler::new(&grid, Interpolation::CatmullRom, 200.5, &surface()).unwrap())),
        ("walk", Box::new(BrownianSampler::new(&ball, &walk, &fine).unwrap())),
        ("cells", Box::new(GridSampler::new(&grid, &transfer, &volume, None).unwrap())),
        ("chains", Box::new(MetropolisSampler::new(&grid, &transfer, &volume, &few, None).unwrap())),
        ("splats", Box::new(SplatSampler::new(&cloud, &splats).unwrap())),
        (
            "field",
            Box::new(
                FieldVolumeSampler::new(
                    extinction,
                    DAabb::new(DVec3::ZERO, DVec3::ONE),
                    &FieldVolumeParams { resolution: 4, cross_section: 2e-6, color: COLOR, seed: 1 },
                )
                .unwrap(),
            ),
        ),
    ];
    for (name, sampler) in &samplers {
        let mut scratch = Particles::default();
        let mut colors = Vec::new();
        for chunk in 0..sampler.chunks() {
            colors.extend(sampler.chunk(3, chunk, &mut scratch).color.iter().map(|c| c.get()));
        }
        no_bias(name, colors.into_iter());
    }
}

#[test]
fn an_unlit_sheet_has_its_colour_in_the_mean_of_the_sets() {
    let camera = front(64);
    let mesh = rectangle(Vec3::ZERO, Vec3::X * 1.5, Vec3::Y * 1.5, 4);
    let params = SurfaceParams { opacity: 1.0, cross_section: pixel_area(&camera, DVec3::Z), ..surface() };
    let sampler = MeshSampler::new(&mesh, &params, None).unwrap();
    let ensemble = render(&camera, &[&sampler], 64);
    let layers = ensemble.read(&|_, _| [0.0; 3], None);
    no_bias("sheet", layers.rgb("beauty").unwrap().iter().copied());
}

#[test]
fn colours_are_within_a_step_and_exact_where_they_need_no_rounding() {
    for i in 0..20_000u64 {
        let u = |k| rng::unit_f32(2, 1, i, k);
        let place = Vec3::new(u(3), u(4), u(5));
        let color: [f32; 3] = std::array::from_fn(|k| (u(k as u64) * 20.0 - 10.0).exp2());
        let largest = color.iter().fold(0.0f32, |m, c| m.max(*c));
        let back = PackedColor::at(color, place).get();
        for k in 0..3 {
            assert!((back[k] - color[k]).abs() <= largest / 255.5, "{color:?} → {back:?}");
        }
        for exact in [[1.0, 0.5, 0.0], [0.375, 0.125, 0.25], [65408.0, 128.0, 0.0], [0.0; 3]] {
            assert_eq!(PackedColor::at(exact, place).get(), exact, "{place}");
        }
    }
}
