//! What files say of single points: tangents and radii of discs, shadow coefficients, masses, and what transfer functions make of a column.

use convert::{
    Classified, ColorBy, DiscShape, DiscSize, MatterParams, PointColors, PointsShown, SplatParams, SurfelParams, cost,
    raw_to_matter, raw_to_surfels, scattered_share, shown_points,
};
use read::{Loaded, ReadParams, bytes};
use splat_core::glam::{DVec2, DVec3, Vec3};
use splat_core::{Cloud, Column, Footprint, RawPoints, Similarity, TransferFunction, TransferPoint, optics, rng};

/// Points of the plane y = 0 that lie `across` apart along x and one apart along z.
fn lines(side: u32, across: f32) -> RawPoints {
    let at = |i: u32| Vec3::new((i % side) as f32 * across, 0.0, (i / side) as f32);
    RawPoints { position: (0..side * side).map(at).collect(), ..RawPoints::default() }
}

fn elliptical() -> SurfelParams {
    SurfelParams { shape: DiscShape::Elliptical, ..SurfelParams::default() }
}

/// The cloud of some points, as large as is foretold.
pub(crate) fn surfels(points: &RawPoints, params: &SurfelParams) -> Cloud {
    let (cloud, _) = raw_to_surfels(points, params, None).unwrap();
    cloud.validate().unwrap();
    let predicted = cost::raw_points(points, params).unwrap();
    assert_eq!((predicted.splats, predicted.bytes), (cloud.len() as u64, cloud.bytes()));
    cloud
}

fn column(name: &str, points: &RawPoints, number: impl Fn(usize) -> f64) -> Column {
    Column { name: name.into(), values: (0..points.len()).map(number).collect() }
}

/// The splats around the middle, by their places.
fn inner(cloud: &Cloud, side: u32, across: f32) -> Vec<usize> {
    let middle = 0.5 * Vec3::new((side - 1) as f32 * across, 0.0, (side - 1) as f32);
    let near = |i: &usize| ((cloud.position[*i] - middle) / Vec3::new(across, 1.0, 1.0)).abs().max_element() < 3.0;
    (0..cloud.len()).filter(near).collect()
}

/// Σ K·w at a place of the plane y = 0, which discs lie in.
fn depth_at(cloud: &Cloud, place: DVec2) -> f64 {
    let footprint = Footprint::default();
    let disc_depth = |i: usize| {
        let radius = f64::from(cloud.radius[i]);
        let tangent = cloud.tangent_of(i).as_dvec3();
        let long = if tangent == DVec3::ZERO { DVec3::X * radius } else { tangent };
        let p = cloud.position[i].as_dvec3();
        let along = long.normalize();
        let way = DVec3::new(place.x - p.x, 0.0, place.y - p.z);
        let square = (way.dot(along) / long.length()).powi(2) + (way.dot(along.cross(DVec3::Y)) / radius).powi(2);
        f64::from(cloud.cross_section[i]) * footprint.norm() / (radius * long.length()) * footprint.profile(square)
    };
    (0..cloud.len()).map(disc_depth).sum()
}

#[test]
fn ellipses_of_a_rectangular_lattice_are_the_discs_of_a_square_one_stretched() {
    for across in [3.0f32, 1.5] {
        let points = lines(30, across);
        let tau = optics::optical_depth(0.4);
        let cloud = surfels(&points, &SurfelParams { opacity: 0.4, ..elliptical() });
        for i in inner(&cloud, 30, across) {
            let tangent = cloud.tangent[i].abs();
            assert!((tangent - Vec3::X * 2.4 * across).length() < 1e-4 * across, "{tangent}");
            assert!((cloud.radius[i] - 2.4).abs() < 1e-4, "{}", cloud.radius[i]);
            assert!((f64::from(cloud.cross_section[i]) / (tau * f64::from(across)) - 1.0).abs() < 1e-5);
        }
        let ripple = |cloud: &Cloud| {
            let at = |k: u32| {
                DVec2::new(14.0 * f64::from(across), 14.0)
                    + DVec2::new(f64::from(k % 8) * f64::from(across), f64::from(k / 8)) / 8.0
            };
            (0..64).map(|k| (depth_at(cloud, at(k)) / tau - 1.0).abs()).fold(0.0, f64::max)
        };
        // As a square lattice ripples.
        assert!(ripple(&cloud) < 2.5e-4, "{across}: {}", ripple(&cloud));
    }
    // What lies alike along all ways stays round.
    let square = surfels(&lines(12, 1.0), &elliptical());
    assert!(
        inner(&square, 12, 1.0)
            .into_iter()
            .all(|i| square.tangent[i] == Vec3::ZERO && (square.radius[i] - 2.4).abs() < 1e-5)
    );
}

#[test]
fn neither_order_nor_threads_nor_a_turn_nor_a_power_of_two_changes_ellipses() {
    let at = |i: u64| {
        Vec3::new(4.0 * rng::unit_f32(1, 0, i, 0), 0.2 * rng::unit_f32(1, 0, i, 1), 20.0 * rng::unit_f32(1, 0, i, 2))
    };
    let position: Vec<Vec3> = (0..900).map(at).collect();
    let points = RawPoints { position: position.clone(), ..RawPoints::default() };
    let once = surfels(&points, &elliptical());
    assert!(once.tangent.iter().filter(|t| **t != Vec3::ZERO).count() > 800);
    let back = RawPoints { position: position.iter().rev().copied().collect(), ..RawPoints::default() };
    assert_eq!(surfels(&back, &elliptical()), once);
    for threads in [1, 2, 7] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| surfels(&points, &elliptical())), once, "{threads} threads");
    }
    let transform = Similarity { scale: 1024.0, ..Similarity::default() };
    let scaled = surfels(
        &points,
        &SurfelParams {
            splat: SplatParams { transform, ..SplatParams::default() },
            lone_spacing: 1024.0,
            ..elliptical()
        },
    );
    assert!(
        (0..once.len())
            .all(|i| scaled.tangent[i] == once.tangent[i] * 1024.0 && scaled.radius[i] == once.radius[i] * 1024.0)
    );
    // No longer than lone discs may be.
    let longest = once.tangent.iter().map(|t| t.length()).fold(0.0, f32::max);
    let (_, report) = raw_to_surfels(&points, &elliptical(), None).unwrap();
    assert!(f64::from(longest) <= 2.4 * 4.0 * report.median_spacing * (1.0 + 1e-6), "{longest}");
}

#[test]
fn tangents_and_radii_of_a_file_are_the_cores_of_discs_and_leave_cross_sections_alone() {
    let mut points = lines(12, 1.0);
    let plain = surfels(&points, &SurfelParams { opacity: 0.5, ..SurfelParams::default() });
    points.normal = vec![Vec3::Y; points.len()];
    points.columns = vec![
        column("tx", &points, |_| 0.6),
        // Out of the plane, which takes that part away.
        column("ty", &points, |_| 5.0),
        column("tz", &points, |_| 0.8),
        column("radius", &points, |_| 0.25),
    ];
    let transform = Similarity { scale: 2.0, ..Similarity::default() };
    let params = SurfelParams {
        opacity: 0.5,
        splat: SplatParams { transform, ..SplatParams::default() },
        ..SurfelParams::default()
    };
    let cloud = surfels(&points, &params);
    for i in 0..cloud.len() {
        let core = Footprint::CORE;
        assert!((cloud.tangent[i] * core - Vec3::new(1.2, 0.0, 1.6)).length() < 1e-6, "{}", cloud.tangent[i]);
        assert!((cloud.radius[i] * core - 0.5).abs() < 1e-6);
        assert!(
            (cloud.cross_section[i] / plain.cross_section[i] - 4.0).abs() < 1e-5,
            "the area of the point, four times as large"
        );
    }
    // A tangent of no length, or along the normal, is none; with one size for all neither counts.
    for (name, number) in [("tx", 0.0), ("tz", 0.0)] {
        points.columns.iter_mut().find(|c| c.name == name).unwrap().values.fill(number);
    }
    assert!(surfels(&points, &params).tangent.iter().all(|t| *t == Vec3::ZERO));
    let sized = surfels(&points, &SurfelParams { size: Some(DiscSize::World(0.9)), ..params.clone() });
    assert!(sized.tangent.is_empty() && sized.radius.iter().all(|r| (r - 1.0).abs() < 1e-6));
    let said =
        |shown: PointsShown<'_>| shown_points(points.clone().into(), &shown, &SplatParams::default()).unwrap().said;
    assert!(said(PointsShown::default()).is_empty());
    let both = said(PointsShown { has_size: true, shape: DiscShape::Elliptical, ..PointsShown::default() });
    assert_eq!(both.len(), 3, "{both:?}");
    points.columns.retain(|c| c.name != "ty");
    let said = shown_points(points.clone().into(), &PointsShown::default(), &SplatParams::default()).unwrap().said;
    assert_eq!(said, ["`tx` is not used: a tangent has `ty` too"]);
    assert!(surfels(&points, &params).tangent.is_empty());
}

fn read(content: &str, matter: bool) -> Result<RawPoints, String> {
    let params = ReadParams { matter, ..ReadParams::default() };
    match bytes("a.csv", content.as_bytes(), &params, None) {
        Ok((Loaded::Points(points), _)) => Ok(points),
        Ok(other) => panic!("{other:?}"),
        Err(e) => Err(e.to_string()),
    }
}

#[test]
fn numbers_of_files_that_attributes_cannot_have_are_refused_with_their_place() {
    for (column, bad, expected, matter) in [
        ("shadow_coefficient", "1.5", "a share from 0 to 1", false),
        ("shadow_coefficient", "-0.1", "a share from 0 to 1", true),
        ("radius", "0", "a finite length above 0", false),
        ("tx", "nan", "a finite number", false),
        ("mass", "-1", "a finite number from 0 on", true),
    ] {
        let error = read(&format!("x,y,z,{column}\n0,0,0,1\n1,0,0,{bad}\n"), matter).unwrap_err();
        assert!(error.starts_with(&format!("a.csv:3:7: expected {expected}, found '{bad}'")), "{error}");
        assert!(error.contains("points are drawn by this column"), "{error}");
    }
    let points = read("x,y,z,shadow_coefficient\n0,0,0,0.25\n1,0,0,0.75\n", false).unwrap();
    let mut shares = surfels(&points, &SurfelParams::default()).shadow_coefficient;
    shares.sort_by(f32::total_cmp);
    assert_eq!(shares, [0.25, 0.75]);
    // A mass says nothing of a surface.
    assert!(read("x,y,z,mass\n0,0,0,-1\n", false).unwrap().columns.is_empty());
    let mut points = lines(4, 1.0);
    points.columns = vec![column("shadow_coefficient", &points, |i| if i == 5 { 2.0 } else { 1.0 })];
    let error = raw_to_surfels(&points, &SurfelParams::default(), None).unwrap_err().to_string();
    assert!(error.contains("point 5: shadow_coefficient is 2.0"), "{error}");
}

/// Points of a box of this size that lie at random.
fn strewn(count: u64, size: f32) -> RawPoints {
    let at = |i: u64| size * Vec3::from_array([0, 1, 2].map(|a| rng::unit_f32(7, 0, i, a)));
    RawPoints { position: (0..count).map(at).collect(), ..RawPoints::default() }
}

#[test]
fn masses_absorb_alike_however_dense_they_lie() {
    let params = MatterParams { extinction: 0.5, ..MatterParams::default() };
    let total = |points: &RawPoints, params: &MatterParams| -> f64 {
        let (cloud, _) = raw_to_matter(points, params, None).unwrap();
        cloud.validate().unwrap();
        assert_eq!(cost::raw_matter(points, params).unwrap().bytes, cloud.bytes());
        cloud.cross_section.iter().map(|k| f64::from(*k)).sum()
    };
    let with_mass = |mut points: RawPoints| {
        points.columns = vec![column("mass", &points, |i| 0.25 + i as f64 % 3.0)];
        points
    };
    let masses: f64 = (0..600).map(|i| 0.25 + f64::from(i) % 3.0).sum();
    for size in [0.1, 1.0, 30.0] {
        let found = total(&with_mass(strewn(600, size)), &params);
        assert!((found / (0.5 * masses) - 1.0).abs() < 1e-6, "{size}: {found} of {}", 0.5 * masses);
    }
    // Nor does a scale, nor that points become one.
    let transform = Similarity { scale: 8.0, ..Similarity::default() };
    let scaled = MatterParams { splat: SplatParams { transform, ..SplatParams::default() }, ..params.clone() };
    let fewer = MatterParams { spacing: Some(0.3), ..params.clone() };
    for params in [scaled, fewer] {
        assert!((total(&with_mass(strewn(600, 1.0)), &params) / (0.5 * masses) - 1.0).abs() < 1e-6);
    }
    // Without masses it is their volume that counts, which grows with the box.
    let volumes = [1.0, 2.0].map(|size| total(&strewn(600, size), &params));
    assert!((volumes[1] / volumes[0] - 8.0).abs() < 1e-4, "{volumes:?}");
    // One that has none is not drawn, and shares of shadows are means by mass.
    let mut points = strewn(3, 1.0);
    points.columns =
        vec![column("mass", &points, |i| i as f64), column("shadow_coefficient", &points, |i| [0.0, 0.0, 0.75][i])];
    let (cloud, _) = raw_to_matter(&points, &MatterParams { spacing: Some(10.0), ..params.clone() }, None).unwrap();
    assert_eq!((cloud.len(), cloud.shadow_coefficient[0]), (1, 0.5));
    assert_eq!(raw_to_matter(&points, &params, None).unwrap().0.len(), 2);
}

#[test]
fn a_transfer_function_classifies_points_by_any_column() {
    let mut points = lines(5, 1.0);
    points.opacity = vec![0.5; points.len()];
    points.columns = vec![column("heat", &points, |i| i as f64), column("extinction", &points, |_| 2.0)];
    let point = |value, extinction| TransferPoint { value, color: [1.0, 0.5, 0.0], extinction };
    let transfer = TransferFunction::new(vec![point(0.0, 0.0), point(20.0, 1.0)]).unwrap();
    let shown = |classified| {
        let colors = PointColors::Transfer(transfer.clone(), classified);
        let by = ColorBy { column: "heat".into(), colors };
        let shown = PointsShown { color_by: Some(&by), ..PointsShown::default() };
        let shown = shown_points(points.clone().into(), &shown, &SplatParams::default()).unwrap();
        (shown.points, shown.said)
    };
    let (found, said) = shown(Classified::Opacity);
    assert_eq!((found.opacity[10], found.opacity[24], found.color[10]), (0.25, 0.5, [1.0, 0.5, 0.0]));
    assert!(
        said[0].starts_with("points have the colours and opacities of `heat` by the object's `transfer`"),
        "{said:?}"
    );
    let (found, said) = shown(Classified::Extinction);
    assert_eq!(found.column("extinction", DVec3::Y).unwrap()[10], 1.0);
    assert!(found.opacity == points.opacity && said[0].contains("colours and extinctions"), "{said:?}");
    assert_eq!(shown(Classified::No).0.opacity, points.opacity);
}

/// Points that fill a cube.
fn filling(count: u64) -> RawPoints {
    let at = |i: u64| Vec3::from_array([0, 1, 2].map(|axis| rng::unit(7, 0, i, axis) as f32));
    RawPoints { position: (0..count).map(at).collect(), ..RawPoints::default() }
}

#[test]
fn balls_have_discs_all_around_at_their_radius() {
    let mut points = filling(1000);
    points.columns.push(column("radius", &points, |i| 0.01 + 1e-5 * i as f64));
    points.value = (0..1000).map(|i| i as f32).collect();
    let transform = Similarity { scale: 2.0, translation: DVec3::new(5.0, -3.0, 1.0), ..Similarity::default() };
    let splat = SplatParams { transform, ..SplatParams::default() };
    let balls = SurfelParams { shape: DiscShape::Balls, values: true, splat, ..SurfelParams::default() };
    let cloud = surfels(&points, &balls);
    let discs = cloud.len() / 1000;
    assert_eq!(cloud.len(), 400_000);
    for ball in (0..1000).map(|ball| ball * discs..(ball + 1) * discs) {
        let value = cloud.value[ball.start];
        let radius = 2.0 * (0.01 + 1e-5 * f64::from(value));
        let middle = transform.apply(points.position[value as usize].as_dvec3());
        let mut area = 0.0;
        let mut sum = DVec3::ZERO;
        for i in ball {
            let away = cloud.origin + cloud.position[i].as_dvec3() - middle;
            // The mean square of the distances of its middle and of its rim.
            let hides = f64::from(Footprint::CORE * cloud.radius[i]);
            let distance = (radius * radius - 0.5 * hides * hides).sqrt();
            assert!((away.length() / distance - 1.0).abs() < 1e-4 && cloud.value[i] == value);
            assert!((away.normalize() - cloud.normal[i].as_dvec3()).length() < 1e-3);
            area += f64::from(cloud.cross_section[i]);
            sum += cloud.normal[i].as_dvec3();
        }
        assert!((area / (4.0 * std::f64::consts::PI * radius * radius) - 1.0).abs() < 1e-4);
        assert!(sum.length() < 0.01 * discs as f64, "{sum}");
    }
    // A size is a diameter, and counts before what the file says; without either balls are a quarter of the median spacing.
    let sized = surfels(&points, &SurfelParams { size: Some(DiscSize::World(0.5)), ..balls.clone() });
    points.columns.clear();
    let (unsized_balls, report) = raw_to_surfels(&points, &balls, None).unwrap();
    for (cloud, radius) in [(sized, 0.25), (unsized_balls, 0.25 * report.median_spacing)] {
        let away = cloud.position[0].as_dvec3() - cloud.position[discs / 2].as_dvec3();
        assert!(away.length() < 2.0 * radius && away.length() > radius, "{away}, {radius}");
    }
    // Points at one place are told of, unless they become one.
    let mut twice = filling(100);
    twice.position.extend_from_within(..);
    let said = |merge_duplicates: bool| {
        let params = SurfelParams { merge_duplicates, ..balls.clone() };
        raw_to_surfels(&twice, &params, None).unwrap().1.said()
    };
    assert!(said(false).unwrap().contains("100 points lie where another one lies"));
    assert_eq!(said(true), None);
    // Few balls have more discs, many have few.
    for (count, expected) in [(3, 3 * 512), (100_000, 600_000)] {
        assert_eq!(surfels(&filling(count), &balls).len(), expected);
    }
}

#[test]
fn what_lies_on_no_surface_is_told_from_what_lies_on_one() {
    for count in [2000, 100_000] {
        let share = scattered_share(&filling(count));
        assert!(share > 0.8, "{count}: {share}");
    }
    assert_eq!(scattered_share(&filling(31)), 0.0);
    // A plane, one that is rough by a tenth of its spacing, lines of a scan, and a ball of few points are surfaces.
    let mut rough = lines(30, 1.0);
    for (i, p) in rough.position.iter_mut().enumerate() {
        p.y = 0.1 * rng::unit(3, 0, i as u64, 0) as f32;
    }
    let on_ball = |i: u64| {
        let z = 2.0 * rng::unit(5, 0, i, 0) - 1.0;
        let (sin, cos) = (std::f64::consts::TAU * rng::unit(5, 0, i, 1)).sin_cos();
        DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z).as_vec3()
    };
    let ball = RawPoints { position: (0..500).map(on_ball).collect(), ..RawPoints::default() };
    for surface in [lines(30, 1.0), rough, lines(30, 3.0), ball] {
        let share = scattered_share(&surface);
        assert!(share < 0.05, "{share}");
    }
    // Lines of a scan that lie far apart are one, a ring and a bent wire are none.
    assert!(scattered_share(&lines(30, 8.0)) < 0.05);
    let ring = |turns: f64| {
        let at = |i: u32| {
            let (sin, cos) = (f64::from(i) / 180.0 * std::f64::consts::TAU * turns).sin_cos();
            DVec3::new(cos, sin, 0.3 * sin + 0.01 * f64::from(i)).as_vec3()
        };
        RawPoints { position: (0..180).map(at).collect(), ..RawPoints::default() }
    };
    for turns in [0.9, 1.0, 1.5] {
        let share = scattered_share(&ring(turns));
        assert!(share > 0.8, "{turns}: {share}");
    }
    // All at one place, and places that are no numbers.
    assert_eq!(scattered_share(&RawPoints { position: vec![Vec3::ONE; 100], ..RawPoints::default() }), 0.0);
    assert_eq!(scattered_share(&RawPoints { position: vec![Vec3::NAN; 100], ..RawPoints::default() }), 0.0);
}
