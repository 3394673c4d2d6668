//! Light that is scattered more than once: its energy, closed forms, paths, and the hard cases MS1 to MS10.

use super::common::{draw, exact, input, lamp, scattering, sun};
use super::paths::{Block, Face, seen, trace};
use crate::common::{apart, constant, cubic, grid, largest, noise, parallel, perspective, transfer, volume};
use sheet_light::Error;
use sheet_light::half::{Balance, HalfCounts, HalfInput, HalfParams, Scattering, balance, fold};
use splat_core::glam::DVec3;
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{Accumulator, Grid, LayerSet, Material, Receiver, TransferFunction, TransferPoint, Transmittance};

const BOTH: Scattering = Scattering::ForwardAndBack;

fn params(scattering: Scattering) -> HalfParams {
    HalfParams { scattering, ..exact(None) }
}

/// A medium of this albedo and asymmetry.
fn medium(albedo: f32, asymmetry: f32) -> Material {
    Material { single_scattering_albedo: albedo, asymmetry, ..scattering() }
}

/// The balance of one light over one volume of one extinction.
fn block(grid: &Grid, sigma: f32, material: &Material, lit: &LitBy<'static>, params: &HalfParams) -> Balance {
    let tf = constant(sigma);
    let volumes = [volume(grid, &tf, material)];
    let lights = [*lit];
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [8, 8]);
    balance(&input(&volumes, &camera, &lights), params, 0).unwrap()
}

#[test]
fn slabs_reflect_and_let_through_what_paths_do() {
    // 64 times as wide as deep.
    let slab = grid([256, 256, 4], cubic(0.5), |_| 1.0);
    for (n, tau) in [1.0, 5.0, 20.0].into_iter().enumerate() {
        for (m, albedo) in [0.5, 0.9, 0.99].into_iter().enumerate() {
            for asymmetry in [0.0, 0.85] {
                let paths = Block { width: f64::INFINITY, depth: tau, albedo, asymmetry };
                let expected = trace(&paths, 40_000, (10 * n + m) as u64);
                let material = medium(albedo as f32, asymmetry as f32);
                let found = block(&slab, tau as f32 / 2.0, &material, &sun([0.0, 0.0, 1.0]), &params(BOTH));
                let [back, through] = [found.reflected, found.transmitted].map(|v| v[0] / found.incident[0]);
                let what = format!("τ {tau}, ω {albedo}, g {asymmetry}: {back} {through}, not {expected:?}");
                assert!((back - expected[0]).abs() < 0.02 && (through - expected[1]).abs() < 0.02, "{what}");
            }
        }
    }
}

/// Effects apart, `scatterN` among them.
const APART: ChannelLayout =
    ChannelLayout::new(&LayerSet { effects: true, shadow: false, normal: false, depth: false, object: false })
        .with_multiple();

/// First channels of `scatter1` and `scatterN`.
const ONCE: usize = 9;
const MORE: usize = 12;

fn draw_apart(input: &HalfInput<'_>, params: &HalfParams) -> (Accumulator, HalfCounts) {
    let mut out = Accumulator::new(input.sheets.camera.size, 1, APART.count(), false, false);
    let counts = fold(input, params, &APART, &mut out, None).unwrap().counts;
    (out, counts)
}

#[test]
fn cubes_lose_by_the_sides_what_paths_do() {
    let cube = grid([32, 32, 32], cubic(0.25), |_| 1.0);
    for (n, tau) in [1.0, 5.0, 20.0].into_iter().enumerate() {
        for (albedo, asymmetry) in [(1.0, 0.0), (0.9, 0.0), (1.0, 0.85), (0.9, 0.85)] {
            let expected = trace(&Block { width: tau, depth: tau, albedo, asymmetry }, 40_000, n as u64);
            let material = medium(albedo as f32, asymmetry as f32);
            let found = block(&cube, tau as f32 / 8.0, &material, &sun([0.0, 0.0, 1.0]), &params(BOTH));
            let shares = [found.reflected, found.transmitted, found.sides].map(|v| v[0] / found.incident[0]);
            let worst = (0..3).map(|n| (shares[n] - expected[n]).abs()).fold(0.0, f64::max);
            println!("τ {tau}, ω {albedo}, g {asymmetry}: off by {worst:.3}");
            // Two streams along the light know little of thin cubes, and their edges are taken for slanted surfaces.
            assert!(worst < 0.125, "τ {tau}, ω {albedo}, g {asymmetry}: {shares:?}, not {expected:?}");
        }
    }
}

#[test]
fn ms01_no_light_is_lost_or_made() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 4.0), (0.9, 40.0)]);
    let white = constant(0.7);
    let grids = [grid([13, 12, 11], cubic(0.5), noise), grid([12, 12, 12], cubic(0.4), |_| 1.0)];
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [8, 8]);
    for asymmetry in [-0.6, 0.0, 0.85] {
        let material = medium(1.0, asymmetry);
        let volumes = [volume(&grids[0], &tf, &material), volume(&grids[1], &white, &material)];
        let lights = [sun([1.0, 2.0, 3.0]), sun([0.0, 0.0, 1.0]), lamp([2.0, 5.0, 9.0])];
        for (light, scattering) in (0..3).flat_map(|n| [Scattering::Forward, BOTH].map(|s| (n, s))) {
            let input = input(&volumes[..], &camera, &lights);
            let found = balance(&input, &params(scattering), light).unwrap();
            let what = format!("{:?}, {scattering:?}, g {asymmetry}: {found:?}", lights[light].light.shape);
            assert!(found.incident[0] > 0.0 && found.missing().iter().all(|m| m.abs() < 1e-5), "{what}");
            // White alone absorbs nothing.
            let volumes = &volumes[1..];
            let found = balance(&self::input(volumes, &camera, &lights), &params(scattering), light).unwrap();
            assert!((0..3).all(|c| found.absorbed[c].abs() < 1e-5 * found.incident[c]), "{found:?}");
            assert!(found.missing().iter().all(|m| m.abs() < 1e-5), "{found:?}");
        }
    }
}

#[test]
fn ms02_energy_knows_no_slabs_and_the_picture_converges_with_them() {
    let tf = transfer(&[(-1.5, 0.0), (0.0, 0.6), (1.5, 1.8)]);
    let cloud = |p: DVec3| (0.9 * p.x + 0.3 * p.z).sin() + 0.4 * (0.7 * p.y - 0.8 * p.z).cos();
    let grid = grid([10, 10, 10], cubic(0.5), cloud);
    let material = medium(1.0, 0.6);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([1.0, 0.3, 2.0])];
    let camera = parallel([0.0, 0.0, 12.0], 5.0, [16, 16]);
    let with = |slabs: f64| {
        let params = HalfParams { scattering: BOTH, voxels_per_cell: 4, ..exact(Some(5.0 / slabs)) };
        let input = input(&volumes, &camera, &lights);
        (balance(&input, &params, 0).unwrap(), draw_apart(&input, &params).0)
    };
    let (energy, truth) = with(320.0);
    assert!(energy.missing().iter().all(|m| m.abs() < 1e-5));
    let error = |slabs: f64| {
        let (found, out) = with(slabs);
        assert_eq!(found, energy, "{slabs} slabs");
        let squares =
            out.channels[MORE + 1].iter().zip(&truth.channels[MORE + 1]).map(|(a, b)| f64::from((a - b) * (a - b)));
        squares.sum::<f64>().sqrt()
    };
    let errors = [5.0, 10.0, 20.0, 40.0].map(error);
    let order = (errors[0] / errors[3]).log2() / 3.0;
    assert!(order > 0.9, "order {order}: {errors:?}");
}

#[test]
fn ms04_without_albedo_nothing_is_done_and_no_bit_changes() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.9, 1.5)]);
    let grid = grid([12, 12, 12], cubic(0.5), noise);
    let camera = perspective([2.0, 3.0, 12.0], 40.0, [40, 40]);
    let black = medium(0.0, 0.5);
    let glowing = Material { emission: [0.1; 3], ..medium(0.0, 0.5) };
    for (material, light) in [(black, sun([1.0, 2.0, 1.0])), (glowing, lamp([9.0, 3.0, 12.0]))] {
        let volumes = [volume(&grid, &tf, &material)];
        let lights = [light];
        let input = input(&volumes, &camera, &lights);
        let plain = draw(&input, &params(Scattering::None)).unwrap();
        for mode in [Scattering::Forward, BOTH] {
            let out = draw(&input, &params(mode)).unwrap();
            assert_eq!(out, plain);
            assert_eq!((out.1.scatter_passes, out.1.scatter_cells), (0, 0));
            assert_eq!(balance(&input, &params(mode), 0), Ok(Balance::default()));
        }
    }
    // Nor where a medium scatters and nobody asks for it.
    let white = medium(1.0, 0.5);
    let volumes = [volume(&grid, &tf, &white)];
    let lights = [sun([1.0, 2.0, 1.0])];
    let input = input(&volumes, &camera, &lights);
    let counts = draw(&input, &params(Scattering::None)).unwrap().1;
    let scattered = draw(&input, &params(BOTH)).unwrap().1;
    assert!(counts.scatter_passes == 0 && scattered.scatter_passes > 0);
    assert_eq!((counts.eye_fragments, counts.light_fragments), (scattered.eye_fragments, scattered.light_fragments));
}

#[test]
fn beauty_is_the_sum_of_effects_and_single_scattering_keeps_its_bits() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.9, 4.0)]);
    let grid = grid([12, 12, 12], cubic(0.5), noise);
    let material = medium(0.9, 0.5);
    let camera = perspective([2.0, 3.0, 12.0], 40.0, [40, 40]);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([1.0, 2.0, 1.0]), lamp([-9.0, 3.0, -12.0])];
    let input = input(&volumes, &camera, &lights);
    let once = draw_apart(&input, &params(Scattering::None)).0;
    let both = draw_apart(&input, &params(BOTH)).0;
    assert_eq!(once.channels[..MORE], both.channels[..MORE]);
    assert!(once.channels[MORE..MORE + 3].iter().flatten().all(|v| *v == 0.0));
    assert!(both.channels[MORE].iter().any(|v| *v > 0.01) && both.channels.iter().flatten().all(|v| v.is_finite()));
    let beauty = draw(&input, &params(BOTH)).unwrap().0;
    for at in 0..1600 {
        let sum: f32 = (0..5).map(|effect| both.channels[3 * effect][at]).sum();
        assert!((beauty.channels[0][at] - sum).abs() < 1e-6, "{at}: {sum}");
    }
    // Effects apart without room for it.
    let layout = ChannelLayout::new(&LayerSet { effects: true, ..LayerSet::default() });
    let mut out = Accumulator::new(camera.size, 1, layout.count(), false, false);
    let refused = fold(&input, &params(BOTH), &layout, &mut out, None);
    assert!(matches!(refused, Err(Error::Parameter { name: "scattering", .. })), "{refused:?}");
}

#[test]
fn ms07_a_cone_from_nothing_to_the_half_space() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 4.0), (0.9, 40.0)]);
    let grid = grid([16, 16, 16], cubic(0.25), noise);
    let material = medium(1.0, 0.85);
    let camera = parallel([1.0, 2.0, 10.0], 5.0, [32, 32]);
    let volumes = [volume(&grid, &tf, &material)];
    let lights = [sun([1.0, 2.0, 3.0])];
    let input = input(&volumes, &camera, &lights);
    let with = |cone: f64| {
        let params = HalfParams { cone: Some(cone), voxels_per_cell: 8, ..params(BOTH) };
        (draw(&input, &params).unwrap(), balance(&input, &params, 0).unwrap())
    };
    let none = with(0.0);
    let least = with(1e-6);
    assert!(apart(&none.0.0, &least.0.0) < 1e-6 && none.0.1.scatter_passes < least.0.1.scatter_passes);
    let mut sides = 0.0;
    for cone in [0.0, 0.2, 0.8, 1.5, 1.57] {
        let (out, found) = with(cone);
        assert!(out.0.channels[0].iter().all(|v| v.is_finite() && *v >= 0.0));
        assert!(found.missing()[0].abs() < 1e-5 && found.sides[0] >= sides, "{cone}: {found:?}");
        sides = found.sides[0];
    }
    for cone in [-0.1, std::f64::consts::FRAC_PI_2, f64::NAN] {
        let refused = draw(&input, &HalfParams { cone: Some(cone), ..params(BOTH) });
        assert!(matches!(refused, Err(Error::Parameter { name: "cone", .. })));
    }
    let refused = draw(&input, &HalfParams { voxels_per_cell: 0, ..params(BOTH) });
    assert!(matches!(refused, Err(Error::Parameter { name: "voxels_per_cell", .. })));
}

#[test]
fn ms08_a_dense_medium_makes_no_numbers_that_are_not_normal_and_no_more_work_a_cell() {
    let grid = grid([24, 24, 24], cubic(0.25), |_| 1.0);
    let material = medium(0.9, 0.5);
    let camera = parallel([0.0, 0.0, -10.0], 5.0, [24, 24]);
    let with = |sigma: f32| {
        let tf = constant(sigma);
        let volumes = [volume(&grid, &tf, &material)];
        draw_apart(
            &input(&volumes, &camera, &[sun([0.0, 0.0, 1.0])]),
            &HalfParams { voxels_per_cell: 8, ..params(BOTH) },
        )
    };
    let passes_a_cell = |counts: &HalfCounts| counts.scatter_passes as f64 / counts.scatter_cells as f64;
    let (thin, counts) = with(0.5);
    assert!(thin.channels[MORE].iter().any(|v| *v > 1e-3));
    for sigma in [20.0, 2000.0, 1e6] {
        let (dense, more) = with(sigma);
        assert!(dense.channels.iter().flatten().all(|v| v.is_finite() && !v.is_subnormal()), "σ {sigma}");
        // Thick layers are cut into thinner ones, and each is blurred: more cells, up to a bound, of no more work.
        assert!(more.scatter_cells <= 1 << 16, "σ {sigma}: {more:?}");
        assert!(passes_a_cell(&more) <= passes_a_cell(&counts), "σ {sigma}: {more:?}, {counts:?}");
        assert!(dense.channels[MORE].iter().all(|v| *v < 1e-12), "σ {sigma}");
    }
}

#[test]
fn ms09_a_symmetric_cloud_is_lit_symmetrically() {
    let tf = transfer(&[(0.3, 0.0), (1.0, 3.0)]);
    let cloud = |p: DVec3| 1.2 - 0.4 * p.length() + 0.2 * (2.0 * p.x).cos() * (2.0 * p.y).cos();
    let grid = grid([24, 24, 24], cubic(0.25), cloud);
    let material = medium(1.0, 0.85);
    let volumes = [volume(&grid, &tf, &material)];
    let n = 40;
    let camera = parallel([0.0, 0.0, 10.0], 6.0, [n as u32; 2]);
    for light in [sun([0.0, 0.0, 1.0]), sun([0.0, 0.0, -1.0]), lamp([0.0, 0.0, 12.0])] {
        let params = HalfParams { voxels_per_cell: 16, ..params(BOTH) };
        let out = draw_apart(&input(&volumes, &camera, &[light]), &params).0;
        let plane = &out.channels[MORE];
        let brightest = plane.iter().copied().fold(0.0, f32::max);
        let turned = |at: &dyn Fn(usize, usize) -> usize| {
            let other: Vec<f32> = (0..n * n).map(|k| plane[at(k % n, k / n)]).collect();
            largest(plane, &other) / brightest
        };
        let off = [turned(&|x, y| y * n + n - 1 - x), turned(&|x, y| x * n + y), turned(&|x, y| (n - 1 - x) * n + y)];
        assert!(off.iter().all(|v| *v < 1e-5), "{:?}: {off:?}", light.light.shape);
    }
}

/// Everything behind a plane.
struct Wall(f32);

impl Transmittance for Wall {
    fn transmittance(&self, receiver: &Receiver) -> [f32; 3] {
        if receiver.position.z < self.0 { [0.0; 3] } else { [1.0; 3] }
    }
}

static WALL: Wall = Wall(0.1);

#[test]
fn ms10_no_light_passes_an_opaque_wall() {
    let grid = grid([24, 24, 24], cubic(0.25), |_| 1.0);
    let material = medium(1.0, 0.5);
    let tf = constant(0.8);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([0.0, 0.0, -10.0], 6.0, [24, 24]);
    let params = HalfParams { voxels_per_cell: 8, ..params(BOTH) };
    let light = LitBy { shadow: Some(&WALL), ..sun([0.0, 0.0, 1.0]) };
    let found = balance(&input(&volumes, &camera, &[light]), &params, 0).unwrap();
    assert!(found.transmitted[0] == 0.0 && found.absorbed[0] > 0.1 * found.incident[0], "{found:?}");
    assert!(found.missing()[0].abs() < 1e-5, "{found:?}");
    // The eye looks from behind at what a second wall, one layer of cells farther, leaves of the dark half.
    let lights = [light, sun([0.0, 0.0, 1.0])];
    let opaque = [9.0f32; 576];
    let seen = |n: usize| {
        let whole = input(&volumes, &camera, &lights[n..=n]);
        let out = draw_apart(&HalfInput { opaque: &opaque, ..whole }, &params).0;
        [ONCE, MORE].map(|c| out.channels[c].iter().copied().fold(0.0, f32::max))
    };
    assert_eq!(seen(0), [0.0; 2]);
    assert!(seen(1).iter().all(|v| *v > 1e-3), "{:?}", seen(1));
}

#[test]
fn x1_scattered_light_knows_no_threads() {
    let tf = transfer(&[(0.3, 0.0), (0.5, 0.4), (0.9, 6.0)]);
    let grid = grid([20, 20, 20], cubic(0.5), noise);
    let material = medium(0.95, 0.7);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([2.0, 3.0, 16.0], 50.0, [60, 50]);
    let lights = [sun([1.0, 2.0, 1.5]), lamp([0.0, 3.0, -14.0])];
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| draw(&input(&volumes, &camera, &lights), &params(BOTH)).unwrap())
    };
    let one = with(1);
    for threads in [2, 3, 7] {
        assert_eq!(with(threads), one, "{threads} threads");
    }
}

#[test]
fn hv13_scattered_light_is_linear_in_powers_of_two() {
    let tf = transfer(&[(0.2, 0.0), (0.5, 0.4), (0.9, 6.0)]);
    let grid = grid([12, 12, 12], cubic(0.5), noise);
    let material = medium(1.0, 0.85);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = perspective([2.0, 3.0, 12.0], 40.0, [40, 40]);
    for light in [sun([1.0, 2.0, 1.0]), lamp([-9.0, 3.0, -12.0])] {
        let with = |factor: f32| {
            let mut light = light;
            light.light.intensity = [7.0 * factor, 3.0 * factor, factor];
            draw_apart(&input(&volumes, &camera, &[light]), &params(BOTH)).0
        };
        let one = with(1.0);
        let mut other = with(2f32.powi(20));
        assert!(one.channels[MORE].iter().any(|c| *c > 1e-4));
        other.channels.iter_mut().flatten().for_each(|c| *c *= 2f32.powi(-20));
        assert_eq!(one, other);
    }
}

#[test]
fn cells_are_few_and_no_more_at_800_slabs_than_at_50() {
    let tf = constant(0.25);
    let material = medium(0.9, 0.5);
    let camera = parallel([0.0, 0.0, 12.0], 8.0, [8, 8]);
    let [along, aslant, lamp] = [sun([0.0, 0.0, 1.0]), sun([1.0, 2.0, 3.0]), lamp([20.0, 30.0, 30.0])];
    for (dims, lights) in [
        ([12, 12, 12], [along, aslant]),
        ([40, 40, 4], [along, lamp]),
        ([4, 40, 40], [aslant, lamp]),
        ([64, 4, 4], [along, aslant]),
    ] {
        let grid = grid(dims, cubic(0.5), |_| 1.0);
        let volumes = [volume(&grid, &tf, &material)];
        for light in lights {
            let counts = |slabs: f64| {
                draw(&input(&volumes, &camera, &[light]), &HalfParams { scattering: BOTH, ..exact(Some(6.0 / slabs)) })
                    .unwrap()
                    .1
            };
            let few = counts(50.0);
            let many = counts(800.0);
            let what = format!("{dims:?}, {:?}: {few:?}", light.light.shape);
            assert!(many.slabs > 4 * few.slabs && few.scatter_passes > 0, "{what}");
            assert_eq!((few.light_bytes, few.scatter_cells), (many.light_bytes, many.scatter_cells), "{what}");
            assert_eq!(few.scatter_passes, many.scatter_passes, "{what}");
            assert!(32 * few.scatter_cells <= few.voxels, "{what}");
            let plain = draw(&input(&volumes, &camera, &[light]), &exact(None)).unwrap().1;
            assert!(few.light_bytes > plain.light_bytes && plain.scatter_cells == 0, "{what}");
        }
    }
}

#[test]
fn colours_are_albedos_and_extinction_by_channel_is_its_own() {
    let point = TransferPoint { value: 0.0, color: [1.0, 0.9, 0.5], extinction: 4.0 };
    let tf = TransferFunction::new(vec![point]).unwrap();
    let grid = grid([32, 32, 8], cubic(0.25), |_| 1.0);
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [8, 8]);
    let with = |tf: &TransferFunction, material: &Material| {
        let volumes = [volume(&grid, tf, material)];
        balance(&input(&volumes, &camera, &[sun([0.0, 0.0, 1.0])]), &params(BOTH), 0).unwrap()
    };
    let all = with(&tf, &medium(0.9, 0.3));
    for (c, color) in point.color.into_iter().enumerate() {
        let one = with(&constant(4.0), &medium(0.9 * color, 0.3));
        assert!((all.reflected[c] / one.reflected[0] - 1.0).abs() < 1e-5, "{c}: {all:?}");
    }
    assert!(all.reflected[0] > all.reflected[1] && all.reflected[1] > all.reflected[2]);
    // No layer is above an optical depth of 1/2, so channels have the same cells alone and together.
    let thick = Material { extinction_rgb: [0.5, 1.0, 2.0], ..medium(0.9, 0.3) };
    let all = with(&constant(0.5), &thick);
    for (c, factor) in thick.extinction_rgb.into_iter().enumerate() {
        let one = with(&constant(0.5 * factor), &medium(0.9, 0.3));
        assert!((all.transmitted[c] / one.transmitted[0] - 1.0).abs() < 1e-5, "{c}: {all:?}");
    }
}

#[test]
fn media_that_share_cells_mix_by_their_scattering() {
    let grid = grid([16, 16, 16], cubic(0.5), |_| 1.0);
    let camera = parallel([0.0, 0.0, 10.0], 2.0, [8, 8]);
    let lights = [sun([0.0, 0.0, 1.0])];
    let one = constant(0.3);
    let other = constant(0.9);
    let sum = constant(1.2);
    let same = medium(0.9, 0.4);
    let dark = medium(0.6, 0.4);
    let bright = medium(1.0, 0.4);
    let balanced =
        |volumes: &[sheet_light::Volume<'_>]| balance(&input(volumes, &camera, &lights), &params(BOTH), 0).unwrap();
    let whole = balanced(&[volume(&grid, &sum, &same)]);
    // Twice the voxels share the same place: the cells are no larger, for that is what two volumes pay for.
    for (a, b) in [(&same, &same), (&dark, &bright)] {
        let parts = balanced(&[volume(&grid, &one, a), volume(&grid, &other, b)]);
        let off = (parts.reflected[0] - whole.reflected[0]).abs() / whole.incident[0];
        assert!(off < 0.01, "{off}: {parts:?}, not {whole:?}");
    }
}

#[test]
fn a_far_lamp_is_a_sun() {
    let cloud = |p: DVec3| 1.5 - 0.6 * p.length() + 0.3 * (2.0 * p.x + p.y).cos();
    let grid = grid([16, 16, 16], cubic(0.25), cloud);
    let material = medium(1.0, 0.6);
    let tf = transfer(&[(0.2, 0.0), (1.0, 4.0)]);
    let volumes = [volume(&grid, &tf, &material)];
    let camera = parallel([1.0, 2.0, 10.0], 5.0, [32, 32]);
    let at = DVec3::new(1.0, 2.0, 3.0).normalize() * 2e3;
    let mut far = lamp(at.to_array());
    far.light.intensity = [4e6; 3];
    let lit_by = |light: LitBy<'static>| {
        let params = HalfParams { voxels_per_cell: 8, ..params(BOTH) };
        let input = input(&volumes, &camera, std::slice::from_ref(&light));
        (draw_apart(&input, &params).0, balance(&input, &params, 0).unwrap())
    };
    let one = lit_by(far);
    let other = lit_by(sun([1.0, 2.0, 3.0]));
    let brightest = other.0.channels[MORE].iter().copied().fold(0.0, f32::max);
    let off = largest(&one.0.channels[MORE], &other.0.channels[MORE]) / brightest;
    assert!(off < 0.01, "{off}");
    assert!((one.1.reflected[0] / other.1.reflected[0] - 1.0).abs() < 0.01);
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    #[test]
    fn faces_of_a_cube_are_as_bright_as_by_paths() {
        let cube = grid([48, 48, 48], cubic(0.125), |_| 1.0);
        let eyes = [(Face::Lit, [0.0, 0.01, 20.0]), (Face::Side, [20.0, 0.01, 0.0]), (Face::Far, [0.0, 0.01, -20.0])];
        for (tau, asymmetry) in [(5.0, 0.0), (20.0, 0.0), (20.0, 0.85), (60.0, 0.85)] {
            let tf = constant((tau / 6.0) as f32);
            let material = medium(1.0, asymmetry as f32);
            let volumes = [volume(&cube, &tf, &material)];
            let lights = [sun([0.0, 0.0, 1.0])];
            let block = Block { width: tau, depth: tau, albedo: 1.0, asymmetry };
            for (face, from) in eyes {
                let expected = seen(&block, face, 120_000, 5);
                let camera = parallel(from, 6.0, [32, 32]);
                let out = draw_apart(&input(&volumes, &camera, &lights), &params(BOTH)).0;
                let mean = |c: usize| out.channels[c].iter().map(|v| f64::from(*v)).sum::<f64>() / 1024.0;
                let all = (mean(ONCE) + mean(MORE), expected[0] + expected[1]);
                let what =
                    format!("τ {tau}, g {asymmetry}, {face:?}: {} and {}, not {expected:?}", mean(ONCE), mean(MORE));
                assert!((mean(ONCE) - expected[0]).abs() < 0.01 * all.1 + 1e-4, "{what}");
                println!("{what}: {:.3} of it", all.0 / all.1);
                assert!((all.0 / all.1 - 1.0).abs() < 1.0 / 3.0, "{what}");
            }
        }
    }
}
