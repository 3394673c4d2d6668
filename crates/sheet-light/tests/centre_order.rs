//! The oldest method: voxels composited whole, each in the order of its centre, beside sheets (section 2 of the paper: colours bleed, and
//! animations sparkle).

use crate::common::{cubic, draw, exact, grid, in_box, input, largest, parallel, projected, unlit, volume};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::{self, FoldInput, OpaqueImage};
use splat_core::{
    Accumulator, Camera, Cloud, Direction, Grid, Material, Splat, SplatKind, TransferFunction, TransferPoint,
};

const SPACING: f64 = 0.25;

/// How far the plane lies before the middle, near the faces that are seen.
const PLANE: f64 = 1.6;

/// 1 before a plane, 0 behind it.
fn halves() -> Grid {
    grid([20; 3], cubic(SPACING), |p| f64::from(u8::from(p.dot(across()) > PLANE)))
}

/// Away from the plane.
fn across() -> DVec3 {
    DVec3::new(1.0, 0.3, 1.2).normalize()
}

/// The same voxels as splats: green where the value is 0, red where it is 1, as the transfer function has it.
fn whole_kernels(grid: &Grid, of_a_voxel: f64, camera: &Camera) -> [Vec<f32>; 2] {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let mut values = Vec::new();
    let [nx, ny, nz] = grid.dims;
    for (k, j, i) in (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| (k, j, i)))) {
        cloud.push(&Splat {
            position: grid.position(i, j, k).as_vec3(),
            normal: Vec3::ZERO,
            radius: 2.0 * SPACING as f32,
            cross_section: (of_a_voxel * SPACING * SPACING) as f32,
            kind: SplatKind::Medium,
            ..Splat::default()
        });
        let red = grid.values[(k * ny + j) * nx + i];
        values.extend([red, 1.0 - red, 0.0]);
    }
    let materials = [Material::default()];
    let projected = projected(&cloud, camera, &materials);
    let place = camera.view_from_offset(cloud.origin);
    let depth: Vec<f32> = cloud.position.iter().map(|p| place.depth(*p)).collect();
    let mut order: Vec<u32> = (0..cloud.len() as u32).collect();
    order.sort_by(|a, b| depth[*a as usize].total_cmp(&depth[*b as usize]));
    let mut out = Accumulator::new(camera.size, 1, 3, false, false);
    let params = raster::Params { transmittance_cutoff: 0.0, ..raster::Params::default() };
    let input = FoldInput {
        projected: &projected,
        order: &order,
        values: &values,
        materials: &materials,
        opaque: &OpaqueImage::default(),
        direction: Direction::FrontToBack,
        params: &params,
    };
    raster::fold(&input, &mut out, None).unwrap();
    [out.channels[0].clone(), out.channels[1].clone()]
}

fn sheets(grid: &Grid, of_a_voxel: f64, camera: &Camera) -> [Vec<f32>; 2] {
    let extinction = (of_a_voxel / SPACING) as f32;
    let point = |value, red| TransferPoint { value, color: [red, 1.0 - red, 0.0], extinction };
    let tf = TransferFunction::new(vec![point(0.0, 0.0), point(1.0, 1.0)]).unwrap();
    let material = unlit();
    let out = draw(&input(&[volume(grid, &tf, &material)], camera, &[]), &exact()).unwrap().0;
    [out.channels[0].clone(), out.channels[1].clone()]
}

/// Red and green of a pixel's ray, in closed form: the plane parts it in two.
fn closed_form(camera: &Camera, of_a_voxel: f64, at: usize) -> [f64; 2] {
    let [near, far] = in_box(camera, DVec3::splat(20.0 * SPACING), at);
    let [x, y] = [at % SIZE, at / SIZE].map(|v| v as f64 + 0.5);
    let (from, along) = camera.view_ray(x, y);
    let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
    let plane = (PLANE - across().dot(camera.position + world(from))) / across().dot(world(along));
    let plane = plane.clamp(near, far);
    let opacity = |length: f64| -(-length * of_a_voxel / SPACING).exp_m1();
    // Red lies before green.
    [opacity(plane - near), (1.0 - opacity(plane - near)) * opacity(far - plane)]
}

/// Pixels of a side.
const SIZE: usize = 48;

/// A camera, sheets, whole kernels, and the closed form.
struct Frame(Camera, [Vec<f32>; 2], [Vec<f32>; 2], [Vec<f32>; 2]);

/// For voxels of an optical depth: RMSE from the closed form, and the largest step between frames 0.1° apart; of sheets, of whole kernels, and of
/// the closed form.
fn measured(of_a_voxel: f64) -> [[f64; 2]; 3] {
    let grid = halves();
    let frame = |n: i32| {
        let (sin, cos) = (20.0 + 0.1 * f64::from(n)).to_radians().sin_cos();
        let camera = parallel([40.0 * sin, 0.0, 40.0 * cos], 2.0, [SIZE as u32; 2]);
        let closed: Vec<_> = (0..SIZE * SIZE).map(|at| closed_form(&camera, of_a_voxel, at)).collect();
        let closed = [0, 1].map(|c| closed.iter().map(|pixel| pixel[c] as f32).collect::<Vec<f32>>());
        Frame(camera, sheets(&grid, of_a_voxel, &camera), whole_kernels(&grid, of_a_voxel, &camera), closed)
    };
    let frames: Vec<Frame> = (0..4).map(frame).collect();
    let square = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    let errors = |pick: fn(&Frame) -> &[Vec<f32>; 2]| {
        let rmse =
            (0..2).map(|c| square(&pick(&frames[0])[c], &frames[0].3[c])).sum::<f64>() / (2 * SIZE * SIZE) as f64;
        let step = |a: &[Vec<f32>; 2], b: &[Vec<f32>; 2]| (0..2).map(|c| largest(&a[c], &b[c])).fold(0.0, f32::max);
        let steps = frames.windows(2).map(|pair| step(pick(&pair[0]), pick(&pair[1])));
        [rmse.sqrt(), f64::from(steps.fold(0.0, f32::max))]
    };
    assert_eq!(frames[0].0.size, [SIZE as u32; 2]);
    [errors(|f| &f.1), errors(|f| &f.2), errors(|f| &f.3)]
}

/// The paper says that they do. Two colours that meet in a plane do not show it: sheets blur the plane as their kernels do, twice along the view.
#[test]
fn whole_kernels_in_the_order_of_their_centres_neither_bleed_nor_sparkle_more_than_sheets() {
    for of_a_voxel in [0.5, 4.0] {
        let [sheets, whole, closed] = measured(of_a_voxel);
        println!("{of_a_voxel} a voxel: sheets {sheets:.4?}, whole kernels {whole:.4?}, closed form {closed:.4?}");
        assert!(whole[0] < sheets[0] && whole[1] < 1.2 * sheets[1] && closed[1] > 0.004, "{of_a_voxel} a voxel");
    }
}
