//! Clouds that are packed: how far each number may be off, what is exact, how many bytes a splat.

use glam::{DVec3, Vec3};
use splat_core::{Cloud, Error, Gaussians, PackedCloud, Splat, SplatKind, rng};
use std::sync::Arc;

fn unit(item: u64, k: u64) -> f32 {
    rng::unit_f32(7, 0, item, k)
}

fn direction(item: u64) -> Vec3 {
    let z = 2.0 * unit(item, 10) - 1.0;
    let angle = std::f32::consts::TAU * unit(item, 11);
    let (sin, cos) = angle.sin_cos();
    let flat = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(flat * cos, flat * sin, z)
}

/// A cloud of all kinds, in canonical order, 10⁷ m away.
fn cloud(n: u64) -> Cloud {
    let mut cloud = Cloud::new(DVec3::new(1e7, -1e7, 3.0));
    for i in 0..n {
        // Seven objects, each of one kind, material and footprint.
        let object = (i % 7) as u32;
        let kind = [SplatKind::Medium, SplatKind::Surface, SplatKind::Opaque][object as usize % 3];
        cloud.push(&Splat {
            position: Vec3::new(unit(i, 0), unit(i, 1), unit(i, 2)) * 40.0 - Vec3::splat(20.0),
            radius: 0.02 + 0.1 * unit(i, 3),
            cross_section: 0.3 * unit(i, 4),
            color: [unit(i, 5), 3.0 * unit(i, 6), 0.0],
            kind,
            material: object as u16 % 5,
            footprint: object as u8 % 2,
            object,
            normal: if kind == SplatKind::Medium { Vec3::ZERO } else { direction(i) },
            value: 1000.0 + unit(i, 8),
            crossing_depth: unit(i, 9),
            // Some discs are round, and some have no normal of their own for light.
            tangent: if i % 5 == 0 { Vec3::ZERO } else { direction(i + n) * (0.01 + 0.1 * unit(i, 12)) },
            shading_normal: if i % 3 == 0 { Vec3::ZERO } else { direction(i + 2 * n) },
            shadow_coefficient: 0.5 + 0.5 * unit(i, 13),
            ..Splat::default()
        });
    }
    cloud.canonicalize();
    cloud
}

fn range(values: impl Iterator<Item = f32>) -> [f64; 2] {
    let range = values.map(f64::from).fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)]);
    assert!(range[0] <= range[1]);
    range
}

/// What steps are even in.
type Measure = fn(f64) -> f64;

/// Half of one of so many steps over the range of `values` by `measure`, with the rounding of f32 at their size.
fn check(name: &str, pairs: &[(f32, f32)], steps: f64, measure: Measure) {
    let [low, high] = range(pairs.iter().map(|p| p.0));
    let half = 0.5 * (measure(high) - measure(low)) / steps;
    let rounding = 4.0 * f64::from(f32::EPSILON) * measure(low.abs().max(high.abs()));
    for (given, found) in pairs {
        let error = (measure(f64::from(*given)) - measure(f64::from(*found))).abs();
        assert!(error <= half + rounding, "{name}: {given} became {found}, half a step is {half:e}");
    }
}

#[test]
fn every_number_is_off_by_half_a_step_of_its_block_at_most() {
    let cloud = cloud(10_000);
    let found = PackedCloud::new(&cloud).unwrap().unpack();
    found.validate().unwrap();
    assert_eq!(found.origin, cloud.origin);
    assert_eq!(
        (&found.kind, &found.material, &found.footprint, &found.object),
        (&cloud.kind, &cloud.material, &cloud.footprint, &cloud.object)
    );
    let all: Vec<usize> = (0..cloud.len()).collect();
    for block in all.chunks(256) {
        let pairs = |number: &dyn Fn(&Cloud, usize) -> f32| -> Vec<(f32, f32)> {
            block.iter().map(|i| (number(&cloud, *i), number(&found, *i))).collect()
        };
        let [even, root]: [Measure; 2] = [|v| v, f64::sqrt];
        for axis in 0..3 {
            check("position", &pairs(&|c, i| c.position[i][axis]), 65535.0, even);
        }
        check("radius", &pairs(&|c, i| c.radius[i]), 255.0, root);
        check("cross_section", &pairs(&|c, i| c.cross_section[i]), 65535.0, root);
        check("value", &pairs(&|c, i| c.value[i]), 65535.0, even);
        check("shadow_coefficient", &pairs(&|c, i| c.shadow_coefficient[i]), 255.0, even);
        let lengths = pairs(&|c, i| c.tangent[i].length()).into_iter().filter(|(given, _)| *given > 0.0);
        check("length of the tangent", &lengths.collect::<Vec<_>>(), 255.0, root);
        check("crossing_depth", &pairs(&|c, i| c.crossing_depth[i]), 65535.0, root);
        // Colours from 0 to the brightest number of the block.
        let colors = block.iter().flat_map(|i| cloud.color[*i].into_iter().zip(found.color[*i]));
        check("color", &colors.chain([(0.0, 0.0)]).collect::<Vec<_>>(), 255.0, root);
    }
    for (name, vector) in [
        ("normal", (|c, i| c.normal[i]) as fn(&Cloud, usize) -> Vec3),
        ("shading normal", |c, i| c.shading_normal[i]),
        ("tangent", |c, i| c.tangent[i]),
    ] {
        let pair = |i: &usize| [vector(&cloud, *i), vector(&found, *i)].map(|v| v.as_dvec3().normalize_or_zero());
        let pairs: Vec<_> = all.iter().map(pair).collect();
        assert!(pairs.iter().all(|[a, b]| a.length() == 0.0 || a.dot(*b) > 0.0), "{name}");
        assert!(pairs.iter().all(|[a, b]| (*a == DVec3::ZERO) == (*b == DVec3::ZERO)), "{name}");
        // The least angle between steps makes the cosine's own rounding count.
        let worst = pairs.iter().map(|[a, b]| a.cross(*b).length().asin().to_degrees()).fold(0.0, f64::max);
        assert!((0.3..0.64).contains(&worst), "{name}: {worst}°");
    }
}

#[test]
fn normals_along_axes_and_on_edges_are_kept() {
    let mut cloud = Cloud::default();
    let axes = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];
    axes.iter().for_each(|n| cloud.push(&Splat { normal: *n, kind: SplatKind::Opaque, ..Splat::default() }));
    assert_eq!(PackedCloud::new(&cloud).unwrap().unpack(), cloud);
}

#[test]
fn what_a_block_has_one_of_is_exact_and_empty_columns_stay_empty() {
    let mut cloud = Cloud::new(DVec3::ONE);
    let splat = Splat { radius: 0.1, cross_section: 0.03, color: [0.7; 3], object: 9, ..Splat::default() };
    (0..300).for_each(|_| cloud.push(&splat));
    cloud.shadow_coefficient = vec![0.25; 300];
    assert_eq!(PackedCloud::new(&cloud).unwrap().unpack(), cloud);
    assert_eq!(PackedCloud::new(&Cloud::default()).unwrap().unpack(), Cloud::default());
}

#[test]
fn numbers_stay_within_those_of_their_block() {
    // From these least numbers on, 255 steps that are rounded to f32 lead beyond 1.
    for least in [0.002_246_144_5f32, 0.002_943_646_4, 0.003_199_537_3, 0.000_920_137_33] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        for (shadow_coefficient, tangent) in [(least, Vec3::X), (1.0, Vec3::Y * 1e-30), (0.5, Vec3::ZERO)] {
            cloud.push(&Splat { radius: 0.1, shadow_coefficient, tangent, ..Splat::default() });
        }
        let found = PackedCloud::new(&cloud).unwrap().unpack();
        assert!(found.shadow_coefficient.iter().all(|share| (least..=1.0).contains(share)), "{found:?}");
        // What is too short for its length to be a number is a round disc, before and behind.
        assert_eq!(found.tangent, [Vec3::X, Vec3::ZERO, Vec3::ZERO]);
    }
}

#[test]
fn a_splat_with_a_normal_takes_less_than_sixteen_bytes() {
    let bytes = |cloud: &Cloud| {
        let packed = PackedCloud::new(cloud).unwrap();
        let [bytes, before] = [packed.bytes(), cloud.bytes()].map(|b| b as f64 / cloud.len() as f64);
        println!("{bytes:.2} bytes a splat in place of {before}");
        [bytes, before]
    };
    let all = cloud(30_000);
    let mut cloud = all.clone();
    (cloud.value, cloud.crossing_depth, cloud.shading_normal) = (Vec::new(), Vec::new(), Vec::new());
    let [bytes_of_ellipses, before] = bytes(&cloud);
    assert!(bytes_of_ellipses <= 20.0 && before >= 68.0, "with tangents and shadow coefficients");
    (cloud.tangent, cloud.shadow_coefficient) = (Vec::new(), Vec::new());
    let [of_normals, before] = bytes(&cloud);
    assert!(of_normals <= 16.0 && before >= 52.0);
    let [of_all, before] = bytes(&all);
    assert!(of_all <= 26.0 && before >= 88.0);
}

#[test]
fn x1_any_number_of_threads_packs_and_unpacks_the_same_bits() {
    let cloud = cloud(20_000);
    let packed_by = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let packed = PackedCloud::new(&cloud).unwrap();
            let again = packed.unpack();
            (packed, again)
        })
    };
    let one = packed_by(1);
    assert!([2, 3, 7].into_iter().all(|threads| packed_by(threads) == one));
}

#[test]
fn what_is_no_number_and_gaussians_are_refused() {
    let mut bad = cloud(10);
    bad.color[4][1] = f32::NAN;
    assert!(matches!(PackedCloud::new(&bad), Err(Error::Invalid { attribute: "color", index: 4, .. })));
    let mut gaussian = cloud(10);
    let mut table = Gaussians::default();
    table.axes.push([Vec3::X, Vec3::Y, Vec3::Z]);
    table.opacity.push(0.5);
    table.harmonics.push([1.0; 3]);
    gaussian.gaussians = Arc::new(table);
    gaussian.gaussian = vec![Gaussians::NONE; 10];
    (gaussian.gaussian[3], gaussian.kind[3]) = (0, SplatKind::Medium);
    gaussian.validate().unwrap();
    assert!(matches!(PackedCloud::new(&gaussian), Err(Error::Invalid { attribute: "gaussian", index: 3, .. })));
}

#[test]
fn bytes_are_the_packed_cloud_again_and_no_others() {
    for n in [0, 1, 257, 700] {
        let mut all = cloud(n);
        if n == 257 {
            (all.value, all.tangent) = (Vec::new(), Vec::new());
        }
        let packed = PackedCloud::new(&all).unwrap();
        let bytes = packed.to_bytes();
        assert_eq!(PackedCloud::from_bytes(&bytes).unwrap(), packed);
        assert!(bytes.len() as u64 <= packed.bytes() + 48, "{} {}", bytes.len(), packed.bytes());
        for length in (0..bytes.len()).step_by(1 + bytes.len() / 97) {
            let error = PackedCloud::from_bytes(&bytes[..length]).unwrap_err().to_string();
            assert!(error.contains("as many as its counts say, more than these"), "{length}: {error}");
        }
        let longer = [&bytes[..], &[0]].concat();
        let error = PackedCloud::from_bytes(&longer).unwrap_err().to_string();
        assert!(error.contains("as many as its counts say"), "{error}");
    }
    // Counts that no memory holds, a kind that there is not, a look beyond the list.
    let bytes = PackedCloud::new(&cloud(7)).unwrap().to_bytes();
    let with = |at: usize, byte: u8| {
        let mut bytes = bytes.clone();
        bytes[at] = byte;
        PackedCloud::from_bytes(&bytes).map(|_| ()).unwrap_err().to_string()
    };
    let looks = 48 + 104;
    assert!(with(7, 255).contains("as many as its counts say"));
    assert!(with(looks + 7, 3).contains("look 0: kind"), "{}", with(looks + 7, 3));
    assert!(with(looks + 7 * 8, 200).contains("splat 0: look is 200"), "{}", with(looks + 56, 200));
}
