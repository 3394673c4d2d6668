//! Raw points become a medium: columns of files, closed forms of lattices, mass that is kept, invariances, and what is refused.

use convert::{
    ConvertError, Kept, MatterParams, MatterReport, PointsShown, SplatParams, Within, cost, raw_to_matter, reference,
    shown_points,
};
use read::{Loaded, Notes, ReadParams, bytes};
use splat_core::glam::{DQuat, DVec3, Vec3};
use splat_core::{Cloud, Column, Footprint, Gaussians, RawPoints, Similarity, SplatKind, rng};

const SIDE: u32 = 12;

/// A cubic lattice of spacing 1.
fn lattice() -> RawPoints {
    let at = |i: u32| Vec3::new((i % SIDE) as f32, (i / SIDE % SIDE) as f32, (i / SIDE / SIDE) as f32);
    RawPoints { position: (0..SIDE.pow(3)).map(at).collect(), ..RawPoints::default() }
}

/// Points that lie at random, coloured, with what files say of matter.
fn scattered() -> RawPoints {
    let unit = |i: u64, a: u64| rng::unit_f32(21, 0, i, a);
    let numbers = |a: u64, low: f64| (0..900).map(|i| low + f64::from(unit(i, a))).collect();
    let column = |name: &str, values| Column { name: name.to_owned(), values };
    RawPoints {
        // Some of them twice.
        position: (0..900).map(|i| i % 800).map(|i| Vec3::new(unit(i, 0), unit(i, 1), 0.5 * unit(i, 2))).collect(),
        color: (0..900).map(|i| [unit(i, 3), unit(i, 4), 0.5]).collect(),
        columns: vec![column("radius", numbers(5, 0.25)), column("extinction", numbers(6, 0.0))],
        ..RawPoints::default()
    }
}

fn medium(points: &RawPoints, params: &MatterParams) -> (Cloud, MatterReport) {
    let (cloud, report) = raw_to_matter(points, params, None).unwrap();
    cloud.validate().unwrap();
    assert!(cloud.kind.iter().all(|k| *k == SplatKind::Medium));
    let predicted = cost::raw_matter(points, params).unwrap();
    assert_eq!((predicted.splats, predicted.bytes), (report.splats, cloud.bytes()), "as predicted");
    assert_eq!(predicted.at_most, Some(predicted.splats));
    (cloud, report)
}

fn mass(cloud: &Cloud) -> f64 {
    cloud.cross_section.iter().map(|k| f64::from(*k)).sum()
}

fn refused(points: &RawPoints, params: &MatterParams) -> String {
    raw_to_matter(points, params, None).unwrap_err().to_string()
}

#[test]
fn a_lattice_has_the_extinction_of_its_points_within_and_ends_half_a_step_beyond_them() {
    let scale = 0.25;
    let transform = Similarity { scale, rotation: DQuat::from_rotation_x(0.3), translation: DVec3::new(1.0, 2.0, 3.0) };
    let params = MatterParams {
        splat: SplatParams { transform, ..SplatParams::default() },
        extinction: 2.0,
        ..MatterParams::default()
    };
    let (cloud, report) = medium(&lattice(), &params);
    assert!((report.median_spacing - scale).abs() < 1e-3 * scale && report.lone == 0, "{report:?}");
    // Extinction is after the transform, and through the lattice leads a way of as many steps as there are points.
    let expected = 2.0 * f64::from(SIDE) * scale;
    for i in 0..64u32 {
        let p = DVec3::new(5.0 + f64::from(i % 8) / 8.0, 5.0 + f64::from(i / 8) / 8.0, 0.0) * scale;
        let p = transform.rotation * p;
        let along = transform.rotation * DVec3::Z;
        let depth = reference::line_depth(&cloud, Footprint::default(), p, along);
        assert!((depth / expected - 1.0).abs() < 3e-3, "{depth}, expected {expected}");
    }
}

#[test]
fn a_radius_blurs_and_takes_nothing_away_and_an_extinction_is_a_factor() {
    let plain = medium(&lattice(), &MatterParams::default()).0;
    let mut points = lattice();
    let n = points.len();
    points.columns = vec![Column { name: "smoothing_length".into(), values: vec![1.75; n] }];
    let smoothed = medium(&points, &MatterParams::default()).0;
    assert!(smoothed.radius.iter().all(|r| *r == 3.5));
    assert_eq!(smoothed.cross_section, plain.cross_section);
    points.columns.push(Column { name: "radius".into(), values: vec![1.5; n] });
    let transform = Similarity { scale: 4.0, ..Similarity::default() };
    let params = MatterParams { splat: SplatParams { transform, ..SplatParams::default() }, ..MatterParams::default() };
    assert!(medium(&points, &params).0.radius.iter().all(|r| *r == 6.0), "lengths scale");
    // Half of the points twice as thick, and the others not there.
    points.columns = vec![Column { name: "extinction".into(), values: (0..n).map(|i| [2.0, 0.0][i % 2]).collect() }];
    let (half, report) = medium(&points, &MatterParams::default());
    assert_eq!((half.len(), report.points), (n / 2, n as u64));
    assert!((mass(&half) / mass(&plain) - 1.0).abs() < 1e-3);
}

#[test]
fn points_at_one_place_share_its_matter() {
    let mut points = lattice();
    let alone = mass(&medium(&points, &MatterParams::default()).0);
    points.position.extend([Vec3::splat(5.0); 2000]);
    let (cloud, report) = medium(&points, &MatterParams::default());
    assert_eq!((report.duplicates, cloud.len()), (2000, points.len()));
    assert!((mass(&cloud) / alone - 1.0).abs() < 1e-5);
    let same = RawPoints { position: vec![Vec3::ONE; 1000], ..RawPoints::default() };
    let (cloud, report) = medium(&same, &MatterParams { lone_spacing: 0.5, ..MatterParams::default() });
    assert!(report.duplicates == 999 && (report.volume - 0.125).abs() < 1e-12);
    assert!((mass(&cloud) - 0.125).abs() < 1e-6);
}

#[test]
fn a_point_stands_for_as_much_where_few_of_the_others_are_kept() {
    let keep = [Kept { column: "x".into(), within: Within::Range([5.0, 5.0]) }];
    let shown = PointsShown { keep: &keep, as_matter: true, ..PointsShown::default() };
    let layer = shown_points(lattice().into(), &shown, &SplatParams::default()).unwrap();
    assert!(layer.said.is_empty());
    let (cloud, report) = medium(&layer.points, &MatterParams::default());
    assert_eq!(cloud.len() as u32, SIDE * SIDE);
    let whole_volume = medium(&lattice(), &MatterParams::default()).1.volume;
    assert!((report.volume * f64::from(SIDE) / whole_volume - 1.0).abs() < 1e-2, "{} of {whole_volume}", report.volume);
}

#[test]
fn points_that_become_one_keep_their_mass_their_middle_and_their_colour() {
    let points = scattered();
    let moments = |cloud: &Cloud| {
        let share = |i: usize| f64::from(cloud.cross_section[i]);
        let sum = |vector: &dyn Fn(usize) -> DVec3| (0..cloud.len()).map(|i| share(i) * vector(i)).sum::<DVec3>();
        let place = sum(&|i| cloud.position[i].as_dvec3());
        [DVec3::splat(mass(cloud)), place, sum(&|i| Vec3::from_array(cloud.color[i]).as_dvec3())]
    };
    let full = medium(&points, &MatterParams::default()).0;
    let (few, _) = medium(&points, &MatterParams { spacing: Some(0.25), ..MatterParams::default() });
    assert!(few.len() <= 4 * 4 * 2 && few.len() > 20, "{}", few.len());
    for (a, b) in moments(&full).into_iter().zip(moments(&few)) {
        assert!((a - b).length() < 1e-5 * a.length(), "{a} {b}");
    }
    // Eight of a lattice have the kernel of a voxel of theirs.
    let (cloud, _) = medium(&lattice(), &MatterParams { spacing: Some(2.0), ..MatterParams::default() });
    let inner = cloud.radius.iter().copied().fold(f32::INFINITY, f32::min);
    assert!((f64::from(inner / Footprint::default().cutoff) / 1.6 - 1.0).abs() < 1e-2, "{inner}");
}

#[test]
fn neither_order_nor_threads_nor_a_shift_nor_a_power_of_two_changes_a_bit() {
    for spacing in [None, Some(0.25)] {
        let params = MatterParams { spacing, ..MatterParams::default() };
        let points = scattered();
        let once = medium(&points, &params).0;
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by_key(|i| rng::bits(3, 0, *i as u64, 0));
        let reordered = |values: &[f64]| order.iter().map(|i| values[*i]).collect();
        let shuffled = RawPoints {
            position: order.iter().map(|i| points.position[*i]).collect(),
            color: order.iter().map(|i| points.color[*i]).collect(),
            columns: points
                .columns
                .iter()
                .map(|c| Column { name: c.name.clone(), values: reordered(&c.values) })
                .collect(),
            ..RawPoints::default()
        };
        assert_eq!(medium(&shuffled, &params).0, once, "shuffled");
        for threads in [1, 2, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            assert_eq!(pool.install(|| medium(&points, &params).0), once, "{threads} threads");
        }
        // A multiple of the spacing, so that the lattice that thins lies alike.
        let mut far = medium(&RawPoints { origin: DVec3::splat(1e7), ..points.clone() }, &params).0;
        assert_eq!(far.origin, DVec3::splat(1e7));
        far.origin = DVec3::ZERO;
        assert_eq!(far, once, "far away");
        for k in [-20i32, 10] {
            let scale = libm::exp2(f64::from(k));
            let transform = Similarity { scale, ..Similarity::default() };
            let splat = SplatParams { transform, ..SplatParams::default() };
            let scaled = medium(&points, &MatterParams { splat, extinction: 1.0 / scale, ..params.clone() }).0;
            let s = scale as f32;
            assert!((0..once.len()).all(|i| scaled.position[i] == once.position[i] * s
                && scaled.radius[i] == once.radius[i] * s
                && scaled.cross_section[i] == once.cross_section[i] * s * s));
        }
    }
}

#[test]
fn few_points_and_lone_ones_have_finite_matter() {
    let matter =
        |position: Vec<Vec3>| medium(&RawPoints { position, ..RawPoints::default() }, &MatterParams::default());
    assert_eq!(matter(Vec::new()).0.len(), 0);
    assert_eq!(matter(vec![Vec3::X]).1.volume, 1.0);
    assert_eq!(matter(vec![Vec3::ZERO, Vec3::X]).0.len(), 2);
    let mut points = lattice();
    points.position.push(Vec3::splat(1000.0));
    let (cloud, report) = matter(points.position);
    assert_eq!(report.lone, 1);
    let said = report.said().unwrap();
    assert!(said.starts_with("1 of 1729 points lie so far from others"), "{said}");
    assert!(cloud.cross_section.iter().all(|k| *k <= 64.1), "the cube of four medians");
}

#[test]
fn numbers_that_matter_cannot_have_are_refused() {
    let params = MatterParams::default();
    for (name, bad) in
        [("radius", 0.0), ("radius", f64::NAN), ("smoothing_length", -1.0), ("extinction", f64::INFINITY)]
    {
        let mut points = lattice();
        points.columns = vec![Column { name: name.into(), values: vec![1.0; points.len()] }];
        points.columns[0].values[7] = bad;
        let error = refused(&points, &params);
        assert!(error.contains("point 7") && error.contains(name), "{error}");
    }
    for (name, params) in [
        ("extinction", MatterParams { extinction: -1.0, ..params.clone() }),
        ("largest_spacing", MatterParams { largest_spacing: 0.5, ..params.clone() }),
        ("spacing", MatterParams { lone_spacing: 0.0, ..params.clone() }),
        ("spacing", MatterParams { spacing: Some(f64::NAN), ..params.clone() }),
    ] {
        let error = refused(&lattice(), &params);
        assert!(error.contains(&format!("{name} is")), "{error}");
    }
    let few = splat_core::Limits::elements(100);
    let limited = MatterParams { splat: SplatParams { limits: few, ..SplatParams::default() }, ..params.clone() };
    assert!(matches!(raw_to_matter(&lattice(), &limited, None), Err(ConvertError::Limit(_))));
    let gaussians = Gaussians { axes: vec![[Vec3::X, Vec3::Y, Vec3::Z]], opacity: vec![0.5], ..Gaussians::default() };
    let points = RawPoints { position: vec![Vec3::ZERO], gaussians, ..RawPoints::default() };
    let error = refused(&points, &params);
    assert!(error.contains("as is \"medium\", expected \"surface\": 3D Gaussians"), "{error}");
}

fn read(name: &str, content: &str) -> (RawPoints, Notes) {
    let params = ReadParams { matter: true, ..ReadParams::default() };
    match bytes(name, content.as_bytes(), &params, None).unwrap_or_else(|e| panic!("{e}")) {
        (Loaded::Points(points), notes) => (points, notes),
        (other, _) => panic!("{other:?}"),
    }
}

/// A PLY file of two points with a radius before and an extinction behind their places.
fn ply(radius: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float radius\nproperty float x\nproperty float y\n\
         property float z\nproperty double extinction\nend_header\n0.5 0 0 0 3\n{radius} 1 0 0 4\n"
    )
}

fn pcd(radius: &str) -> String {
    format!(
        "VERSION 0.7\nFIELDS x y z radius extinction\nSIZE 4 4 4 4 4\nTYPE F F F F F\nCOUNT 1 1 1 1 1\nWIDTH 2\n\
         HEIGHT 1\nPOINTS 2\nDATA ascii\n0 0 0 0.5 3\n1 0 0 {radius} 4\n"
    )
}

fn text(radius: &str) -> String {
    format!("x,y,z,radius,extinction\n0,0,0,0.5,3\n1,0,0,{radius},4\n")
}

#[test]
fn columns_of_matter_are_kept_where_points_become_a_medium_and_only_named_elsewhere() {
    for (name, content) in [("a.ply", ply("0.75")), ("a.pcd", pcd("0.75")), ("a.csv", text("0.75"))] {
        let (points, notes) = read(name, &content);
        let column_of = |column: &str| points.column(column, DVec3::Y).unwrap();
        assert_eq!((column_of("radius"), column_of("extinction")), (vec![0.5, 0.75], vec![3.0, 4.0]), "{name}");
        assert!(notes.unused.is_empty(), "{name}: {:?}", notes.unused);
        let (surface, notes) = bytes(name, content.as_bytes(), &ReadParams::default(), None).unwrap();
        assert_eq!(notes.unused, ["extinction"], "{name}");
        assert!(matches!(surface, Loaded::Points(points) if points.columns.len() == 1), "{name}");
    }
}

#[test]
fn numbers_of_files_that_points_cannot_have_are_refused_with_their_place() {
    for bad in ["0", "-1", "nan", "inf"] {
        for (name, content, place) in
            [("a.ply", ply(bad), "11:1"), ("a.pcd", pcd(bad), "11:7"), ("a.csv", text(bad), "3:7")]
        {
            let params = ReadParams { matter: true, ..ReadParams::default() };
            let error = bytes(name, content.as_bytes(), &params, None).unwrap_err().to_string();
            let expected = format!("{name}:{place}: expected a finite length above 0, found");
            assert!(error.starts_with(&expected) && error.contains("points are drawn by this column"), "{error}");
            // Discs have a radius too, and no extinction.
            let error = bytes(name, content.as_bytes(), &ReadParams::default(), None).unwrap_err().to_string();
            assert!(error.starts_with(&expected), "{error}");
            let endless = content.replace("extinction", "temperature");
            assert!(bytes(name, endless.replace("radius", "size").as_bytes(), &params, None).is_ok(), "{name}");
        }
    }
}
