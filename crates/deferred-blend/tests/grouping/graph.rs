//! The overlap graph beside every pair asked for in f64.

use super::{ball, flat, least, medium, mixed, one_place};
use crate::scenes::disc;
use deferred_blend::Error;
use deferred_blend::grouping::{Coplanar, GraphParams, OverlapGraph, Relaxation};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Cloud, Progress, Splat, rng};

/// Pairs of an overlap graph by places in the cloud.
pub(super) fn edges(graph: &OverlapGraph) -> Vec<[usize; 2]> {
    let edges_of_node = |node: usize| {
        let place = graph.place(node);
        graph.neighbors(node).iter().map(move |&n| [place, graph.place(n as usize)])
    };
    let mut edges: Vec<[usize; 2]> = (0..graph.nodes()).flat_map(edges_of_node).collect();
    edges.sort_unstable();
    edges
}

fn axes(cloud: &Cloud, i: usize) -> [DVec3; 2] {
    let normal = cloud.normal_of(i).as_dvec3();
    let radius = f64::from(cloud.radius[i]);
    let tangent = cloud.tangent_of(i).as_dvec3();
    let first = if tangent == DVec3::ZERO { normal.any_orthonormal_vector() * radius } else { tangent };
    [first, normal.cross(first).normalize() * radius]
}

fn shape(cloud: &Cloud, i: usize) -> DMat3 {
    let [a, b] = axes(cloud, i);
    let c = cloud.normal_of(i).as_dvec3() * a.length().min(b.length());
    let columns = DMat3::from_cols(a, b, c);
    columns * columns.transpose()
}

/// The contact function of two ellipsoids, its maximum by a thousand steps.
fn contact(cloud: &Cloud, i: usize, j: usize) -> f64 {
    let offset = cloud.position[j].as_dvec3() - cloud.position[i].as_dvec3();
    let a = shape(cloud, i);
    let b = shape(cloud, j);
    let steps = (1..1000).map(|k| f64::from(k) / 1000.0);
    steps.map(|l| l * (1.0 - l) * offset.dot((a * (1.0 - l) + b * l).inverse() * offset)).fold(0.0, f64::max)
}

/// Ordered pairs that overlap, each asked for on its own.
fn reference(cloud: &Cloud, relaxation: &Relaxation) -> Vec<[usize; 2]> {
    let c = f64::from(relaxation.factor);
    let joins = |i: usize, j: usize| {
        let p = cloud.position[i].as_dvec3();
        let q = cloud.position[j].as_dvec3();
        let round = cloud.tangent_of(i).length() + cloud.tangent_of(j).length() == 0.0;
        let reach = f64::from(cloud.radius[i]) + f64::from(cloud.radius[j]);
        let overlaps = if round { (p - q).length() < c * reach } else { i != j && contact(cloud, i, j) < c * c };
        let n = cloud.normal_of(i).as_dvec3();
        let m = cloud.normal_of(j).as_dvec3();
        let of_one_plane = relaxation.coplanar.is_some_and(|coplanar| {
            let far = (p - q).dot(n).abs().max((p - q).dot(m).abs());
            let color = (0..3).all(|k| (cloud.color[i][k] - cloud.color[j][k]).abs() <= coplanar.color);
            n.dot(m) >= f64::from(coplanar.cosine) && far <= f64::from(coplanar.offset) * reach && color
        });
        i != j && overlaps && !(relaxation.opposite && n.dot(m) < 0.0) && !of_one_plane
    };
    let pairs = (0..cloud.len()).flat_map(|i| (0..cloud.len()).map(move |j| [i, j]));
    pairs.filter(|&[i, j]| joins(i, j)).collect()
}

fn assert_same(cloud: &Cloud, relaxation: Relaxation) -> usize {
    let params = GraphParams { relaxation, ..GraphParams::default() };
    let graph = OverlapGraph::build(cloud, &params, None).expect("a valid cloud");
    let expected = reference(cloud, &relaxation);
    assert_eq!(edges(&graph), expected, "{relaxation:?}");
    assert_eq!(graph.edges() as usize * 2, expected.len());
    expected.len()
}

#[test]
fn edges_are_those_of_every_pair_in_f64() {
    for cloud in [mixed(500), ball(), flat()] {
        for factor in [1.0, 0.8, 0.6] {
            assert!(assert_same(&cloud, Relaxation { factor, ..Relaxation::default() }) > 0);
        }
    }
}

/// Pairs of discs that touch, but for what their places are rounded by.
#[test]
fn discs_that_hardly_touch_or_hardly_do_not_are_told_apart_in_f64() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    let mut touching = 0;
    for i in 0..500u64 {
        let u = |n| rng::unit_f32(7, 0, i, n) - 0.5;
        let radii = [1.0 + u(0), 1.0 + u(1)];
        let direction = Vec3::new(u(2), u(3), u(4)).normalize();
        let first = 6.0 * Vec3::from_array([i % 8, i / 8 % 8, i / 64].map(|step| step as f32 - 4.0));
        let second = first + direction * (radii[0] + radii[1]);
        for (position, radius) in [first, second].into_iter().zip(radii) {
            cloud.push(&Splat { radius, ..disc(position, Vec3::Z, 1.0, 0.5) });
        }
        let apart = second.as_dvec3().distance(first.as_dvec3()) / f64::from(radii[0] + radii[1]) - 1.0;
        touching += usize::from(apart.abs() < 1e-7);
    }
    assert!(touching > 50, "{touching}");
    let found = assert_same(&cloud, Relaxation::default());
    assert!((200..1000).contains(&found), "{found}");
}

#[test]
fn each_relaxation_removes_its_edges_and_no_others() {
    let cloud = mixed(500);
    let edges = assert_same(&cloud, Relaxation::default());
    let opposite = assert_same(&cloud, Relaxation { opposite: true, ..Relaxation::default() });
    assert!(opposite < edges * 2 / 3, "{opposite} of {edges}");
    let mut flat = flat();
    let none = assert_same(&flat, Relaxation { coplanar: Some(Coplanar::default()), ..Relaxation::default() });
    assert_eq!(none, 0, "one plane and one colour");
    flat.color.iter_mut().enumerate().for_each(|(i, color)| color[1] = [0.2, 0.8][i % 2]);
    let colored = assert_same(&flat, Relaxation { coplanar: Some(Coplanar::default()), ..Relaxation::default() });
    assert!(colored > 1000, "edges between two colours stay: {colored}");
    flat.object.iter_mut().for_each(|object| *object = 7);
    let coplanar = Some(Coplanar { color: 1.0, ..Coplanar::default() });
    assert_eq!(assert_same(&flat, Relaxation { coplanar, ..Relaxation::default() }), 0);
}

#[test]
fn memory_is_eight_bytes_an_edge() {
    let graph = OverlapGraph::build(&ball(), &GraphParams::default(), None).expect("a valid cloud");
    let of_edges = graph.bytes() as f64 - 52.0 * graph.nodes() as f64 - 4.0;
    assert_eq!(of_edges / graph.edges() as f64, 8.0);
}

#[test]
fn nothing_and_a_single_disc_have_no_edges() {
    for cloud in least() {
        let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None).expect("a valid cloud");
        assert_eq!((graph.nodes(), graph.edges(), graph.max_degree()), (cloud.len(), 0, 0));
    }
}

#[test]
fn more_edges_than_fit_are_refused_and_ten_thousand_discs_at_one_place_fit() {
    let cloud = one_place(10_000);
    let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None).expect("400 MB");
    assert_eq!(graph.edges(), 10_000 * 9_999 / 2);
    let params = GraphParams { max_bytes: 1 << 20, ..GraphParams::default() };
    let Err(Error::Limit(exceeded)) = OverlapGraph::build(&cloud, &params, None) else { panic!("expected a limit") };
    assert_eq!(exceeded.limit, Some(1 << 20));
    assert!(exceeded.hint.contains("hashing"));
}

#[test]
fn parameters_and_clouds_are_checked() {
    let cloud = ball();
    let with = |relaxation| GraphParams { relaxation, ..GraphParams::default() };
    for factor in [0.0, -1.0, 1.0001, f32::NAN, f32::INFINITY] {
        let params = with(Relaxation { factor, ..Relaxation::default() });
        let Err(error) = OverlapGraph::build(&cloud, &params, None) else { panic!("{factor} was taken") };
        assert!(error.to_string().starts_with("factor c of the radii is "), "{error}");
    }
    for coplanar in [
        Coplanar { cosine: f32::NAN, ..Coplanar::default() },
        Coplanar { offset: -1.0, ..Coplanar::default() },
        Coplanar { color: f32::INFINITY, ..Coplanar::default() },
    ] {
        let params = with(Relaxation { coplanar: Some(coplanar), ..Relaxation::default() });
        assert!(matches!(OverlapGraph::build(&cloud, &params, None), Err(Error::Parameter { .. })));
    }
    for disc_scale in [0.0, 1.5, f32::NAN] {
        let params = GraphParams { disc_scale, ..GraphParams::default() };
        assert!(matches!(OverlapGraph::build(&cloud, &params, None), Err(Error::Parameter { .. })));
    }
    assert!(matches!(OverlapGraph::build(&medium(), &GraphParams::default(), None), Err(Error::Cloud(_))));
    let mut broken = ball();
    broken.radius[7] = f32::NAN;
    assert!(matches!(OverlapGraph::build(&broken, &GraphParams::default(), None), Err(Error::Cloud(_))));
}

#[test]
fn the_search_stops_when_it_is_cancelled() {
    let progress = Progress::new();
    progress.cancel();
    assert_eq!(OverlapGraph::build(&ball(), &GraphParams::default(), Some(&progress)).err(), Some(Error::Cancelled));
}
