//! Footprints that are images: their energy, how they lie, and how near a tabulated formula comes to the formula.

use glam::{DVec3, Vec3};
use splat_core::raster::{
    Detail, FoldInput, OpaqueImage, OpaqueInput, Params, ProjectInput, fold, project, resolve_opaque,
};
use splat_core::{
    Accumulator, Camera, Cloud, Direction, Error, Footprint, FootprintImage, FootprintStack, Material, Projection,
    Splat, SplatKind,
};

const SIZE: u32 = 96;

/// Coverages of an image of `size` pixels by a function of the place, 0 to 1 from the top left.
fn image(size: [u32; 2], function: impl Fn(f64, f64) -> f64) -> FootprintImage {
    let at = |i: u32, n: u32| (f64::from(i) + 0.5) / f64::from(n);
    let pixels = (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j)));
    let coverage: Vec<f32> = pixels.map(|(i, j)| function(at(i, size[0]), at(j, size[1])) as f32).collect();
    FootprintImage::new(size, &coverage).unwrap()
}

/// A blade that leans to the right, with nothing in the corners.
fn blade() -> FootprintImage {
    image([64, 64], |x, y| f64::from(u8::from((x - 0.3 - 0.4 * (1.0 - y)).abs() < 0.12 * y && (0.1..0.9).contains(&y))))
}

fn camera() -> Camera {
    let view = Projection::Orthographic { height: f64::from(SIZE) };
    Camera::look_at(DVec3::Z * 400.0, DVec3::ZERO, DVec3::Y, view, [SIZE, SIZE]).unwrap()
}

/// Optical depths of one translucent disc, whose pixels are a unit wide.
fn depths(splat: Splat, image: Option<FootprintImage>) -> Vec<f32> {
    depths_by(splat, image, &Params::default())
}

fn depths_unfiltered(splat: Splat, image: Option<FootprintImage>) -> Vec<f32> {
    depths_by(splat, image, &Params { resampling_sigma_px: 0.0, ..Params::default() })
}

fn depths_by(splat: Splat, image: Option<FootprintImage>, params: &Params) -> Vec<f32> {
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&splat);
    let stack = FootprintStack::default();
    let footprints = &image.map_or(stack.clone(), |image| stack.with_image(0, image.into()));
    let materials = &[Material::default()];
    let camera = &camera();
    let cloud = &cloud;
    let detail = Detail::ALL;
    let projected = &project(&ProjectInput { cloud, camera, footprints, materials, params, detail });
    let mut seen = Accumulator::new([SIZE; 2], 1, 3, false, false);
    let opaque = &OpaqueImage::default();
    let direction = Direction::FrontToBack;
    let input = FoldInput { projected, order: &[0], values: &[1.0; 3], materials, opaque, direction, params };
    fold(&input, &mut seen, None).unwrap();
    seen.optical_depth.swap_remove(0)
}

fn disc(radius: f32, tangent: Vec3) -> Splat {
    let kind = SplatKind::Surface;
    let normal = Vec3::Z;
    Splat {
        radius,
        cross_section: 50.0,
        kind,
        normal,
        tangent,
        position: Vec3::new(0.2, -0.3, 0.0),
        ..Splat::default()
    }
}

/// Σ of the optical depths of a disc that shows the blade, over what it is to be, in the mean over places in a pixel.
fn kept(splat: Splat, expected: f64) -> f64 {
    const STEPS: usize = 3;
    let place = |k: usize| Vec3::new((k % STEPS) as f32, (k / STEPS) as f32, 0.0) / STEPS as f32;
    let sum = |k: usize| {
        let depths = depths(Splat { position: splat.position + place(k), ..splat }, Some(blade()));
        depths.iter().map(|d| f64::from(*d)).sum::<f64>()
    };
    (0..STEPS * STEPS).map(sum).sum::<f64>() / (STEPS * STEPS) as f64 / expected
}

/// Turned by any angle, seen from any side, and from a disc that fills the picture to one within a pixel: Στ is K, in the mean over
/// places in a pixel, from which a hard image of few pixels deviates as the filter's own formula does.
#[test]
fn an_image_keeps_the_energy_turned_slanted_and_far_away() {
    for radius in [40.0, 11.0, 6.0, 3.0, 1.5, 0.2] {
        for degrees in [0.0f32, 17.0, 90.0] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let facing = disc(radius, Vec3::new(cos, sin, 0.0) * radius);
            let kept = self::kept(facing, 50.0);
            assert!((kept - 1.0).abs() < 0.01, "radius {radius}, {degrees}°: {kept}");
            // Slanted by 60° it has half the area in the picture, and τ of one crossing stays.
            let normal = Vec3::new(0.0, 0.75f32.sqrt(), 0.5);
            let along = Vec3::X * cos + normal.cross(Vec3::X) * sin;
            let slanted = Splat { normal, tangent: along * radius, ..facing };
            let kept = self::kept(slanted, 25.0);
            assert!((kept - 1.0).abs() < 0.01, "radius {radius}, {degrees}°: {kept}");
        }
    }
}

/// A quarter turn of the tangent turns the picture by a quarter, on the lattice of pixels.
#[test]
fn a_quarter_turn_of_the_tangent_turns_the_picture() {
    let centered = |tangent: Vec3| Splat { position: Vec3::ZERO, ..disc(20.0, tangent * 20.0) };
    let seen = depths(centered(Vec3::X), Some(blade()));
    let turned = depths(centered(Vec3::Y), Some(blade()));
    let n = SIZE as usize;
    let mut most: f32 = 0.0;
    for y in 0..n {
        for x in 0..n {
            // What lay to the right lies above.
            most = most.max((turned[(n - 1 - x) * n + y] - seen[y * n + x]).abs());
        }
    }
    let top = seen.iter().copied().fold(0.0, f32::max);
    assert!(top > 0.1 && most < 1e-6 * top, "{most:e} of {top}");
    // The image lies upright: its top, where the blade is thin, is above, and it leans to the right.
    let row = |y: usize| (0..n).filter(|x| seen[y * n + x] > 0.5 * top).collect::<Vec<_>>();
    let rows: Vec<usize> = (0..n).filter(|y| !row(*y).is_empty()).collect();
    let first = row(rows[1]);
    let last = row(rows[rows.len() - 2]);
    assert!(first.len() < last.len() && first[0] > last[0], "{first:?} {last:?}");
}

/// The disc that is seen from behind shows the image mirrored.
#[test]
fn the_back_shows_the_mirror_image() {
    let front = depths(Splat { position: Vec3::ZERO, ..disc(20.0, Vec3::X * 20.0) }, Some(blade()));
    let behind = Splat { position: Vec3::ZERO, normal: -Vec3::Z, ..disc(20.0, -Vec3::X * 20.0) };
    let back = depths(behind, Some(blade()));
    let n = SIZE as usize;
    let mirrored = (0..n * n).map(|k| (back[k / n * n + n - 1 - k % n] - front[k]).abs()).fold(0.0, f32::max);
    assert!(mirrored < 1e-6, "{mirrored:e}");
}

/// Of a slanted disc at the side of the picture each ray shows what lies where it meets the disc.
#[test]
fn a_slanted_disc_off_the_axis_shows_its_image_where_rays_meet_it() {
    let view = Projection::Perspective { fov_y: 1.4 };
    let camera = &Camera::look_at(DVec3::ZERO, -DVec3::Z, DVec3::Y, view, [SIZE, SIZE]).unwrap();
    let position = Vec3::new(-1.8, 1.6, -3.0);
    let normal = Vec3::new(0.6, 0.0, 0.8);
    let tangent = Vec3::new(0.64, 0.6, -0.48) * 0.5;
    let across = normal.cross(Vec3::new(0.64, 0.6, -0.48)) * 0.5;
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&Splat { position, normal, tangent, ..disc(0.5, tangent) });
    // The right half.
    let half = image([64, 64], |x, _| f64::from(u8::from(x > 0.5)));
    let footprints = &FootprintStack::default().with_image(0, half.into());
    let params = &Params::default();
    let materials = &[Material::default()];
    let cloud = &cloud;
    let projected = &project(&ProjectInput { cloud, camera, footprints, materials, params, detail: Detail::ALL });
    let mut seen = Accumulator::new([SIZE; 2], 1, 3, false, false);
    let opaque = &OpaqueImage::default();
    let direction = Direction::FrontToBack;
    let input = FoldInput { projected, order: &[0], values: &[1.0; 3], materials, opaque, direction, params };
    fold(&input, &mut seen, None).unwrap();
    let mut shown = [0, 0];
    for (k, depth) in seen.optical_depth[0].iter().enumerate() {
        let at = [k as u32 % SIZE, k as u32 / SIZE].map(|v| f64::from(v) + 0.5);
        let ray = camera.direction(at[0], at[1]).0.as_vec3();
        let place = ray * (normal.dot(position) / normal.dot(ray)) - position;
        let [x, y] = [tangent, across].map(|axis| place.dot(axis) / axis.length_squared());
        if x.abs() > 0.3 && x.abs() < 0.7 && y.abs() < 0.7 {
            shown[usize::from(x > 0.0)] += 1;
            assert_eq!(*depth > 0.0, x > 0.0, "{x} {y}: {depth}");
        }
    }
    assert!(shown.into_iter().all(|n| n > 20), "{shown:?}");
}

/// The table of a formula gives its picture; the error falls with the square of the texels' width.
#[test]
fn a_tabulated_formula_comes_to_the_formula_with_second_order() {
    // The circle in an image whose corners lie on the rim has √½ of the radius.
    let radius = 40.0;
    let exact = depths_unfiltered(disc(radius * 0.5f32.sqrt(), Vec3::ZERO), None);
    let most = exact.iter().copied().fold(0.0, f32::max);
    let formula = Footprint::default();
    let error = |texels: u32| {
        let table = image([texels; 2], |x, y| formula.profile(4.0 * ((x - 0.5).powi(2) + (y - 0.5).powi(2))));
        let seen = depths_unfiltered(disc(radius, Vec3::X * radius), Some(table));
        seen.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max) / most
    };
    let errors = [8, 16, 32].map(error);
    assert!(errors[2] < 0.01, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((3.0..5.0).contains(&(pair[0] / pair[1])), "{errors:?}");
    }
}

/// An opaque blade hides what is behind it where it covers, and as much area from far away.
#[test]
fn an_opaque_image_covers_as_much_from_far_away() {
    let footprints = FootprintStack::default().with_image(0, blade().into());
    let area = |radius: f32| {
        let mut covered = 0;
        let mut discs = 0;
        for i in 0..64 {
            let mut cloud = Cloud::new(DVec3::ZERO);
            let (sin, cos) = (i as f32).sin_cos();
            let tangent = Vec3::new(cos, sin, 0.0) * radius;
            let position = Vec3::new((i % 8) as f32 / 8.0, (i / 8) as f32 / 8.0, 0.0);
            cloud.push(&Splat { kind: SplatKind::Opaque, position, ..disc(radius, tangent) });
            let materials = &[Material::default()];
            let camera = &camera();
            let params = &Params::default();
            let cloud = &cloud;
            let footprints = &footprints;
            let detail = Detail::ALL;
            let projected = &project(&ProjectInput { cloud, camera, footprints, materials, params, detail });
            let input = OpaqueInput { projected, ids: &[0], values: &[1.0; 3], channels: 3, objects: false };
            let (seen, _) = resolve_opaque(&input, None).unwrap();
            covered += seen.depth.iter().filter(|d| d.is_finite()).count();
            discs += 1;
        }
        covered as f32 / (discs as f32 * radius * radius)
    };
    let whole = area(40.0);
    for radius in [20.0, 10.0, 6.0, 4.0, 3.0] {
        let kept = area(radius) / whole;
        assert!((kept - 1.0).abs() < 0.2, "radius {radius}: {kept} of {whole}");
    }
}

#[test]
fn images_without_energy_or_out_of_range_are_refused() {
    let refused = |size, coverage: &[f32]| match FootprintImage::new(size, coverage) {
        Err(Error::Invalid { found, .. }) => found,
        other => format!("{other:?}"),
    };
    assert_eq!(refused([2, 1], &[0.0, 0.0]), "0.0");
    assert_eq!(refused([2, 1], &[0.5, f32::NAN]), "NaN");
    assert_eq!(refused([2, 1], &[1.5, 0.0]), "1.5");
    assert!(matches!(FootprintImage::new([2, 2], &[1.0]), Err(Error::ColumnLength { found: 1, expected: 4, .. })));
}
