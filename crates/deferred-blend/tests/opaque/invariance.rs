//! Nothing depends on the order of the discs, the number of threads, the origin or a power of two of the scale.

use super::{plain, resolve, voronoi};
use crate::floored::by_turns;
use crate::scenes::{Scene, camera, soup};
use deferred_blend::grouping::Groups;
use deferred_blend::{Opaque, Params, Passes};
use splat_core::glam::DVec3;
use splat_core::{Camera, Cloud, rng};

fn view() -> Camera {
    camera(DVec3::new(0.0, 0.0, 4.0), [100, 70])
}

/// By every way, without what tells of the machine.
fn pictures(scene: &Scene, groups: &Groups) -> [Opaque; 3] {
    [Passes::TwoPlusOne, plain(groups), voronoi(groups)].map(|passes| {
        let mut picture = resolve(scene, &Params::default(), passes);
        picture.counts.bytes = 0;
        picture
    })
}

#[test]
fn perm_opaque_pictures_do_not_depend_on_the_order_of_discs() {
    let mut scene = Scene::new(soup(2000, 1.0), view());
    let groups = by_turns(&scene.cloud, 5);
    let one = pictures(&scene, &groups);
    scene.ids.reverse();
    assert_eq!(pictures(&scene, &groups), one);
    scene.ids.sort_by_key(|&i| rng::bits(3, 1, u64::from(i), 0));
    assert_eq!(pictures(&scene, &groups), one);
    // Where each group has one disc a pixel, the order of the cloud does not matter either.
    let order: Vec<u32> = scene.ids.clone();
    let by_disc = order.iter().map(|&i| groups.by_disc()[i as usize]).collect();
    let shuffled = Scene::new(scene.cloud.gather(&order), view());
    let other = pictures(&shuffled, &Groups::new(5, by_disc).expect("below the count"));
    for (one, other) in one[1..].iter().zip(&other[1..]) {
        assert_eq!(one.image, other.image);
    }
}

#[test]
fn threads_opaque_pictures_have_the_same_bits() {
    let scene = Scene::new(soup(2000, 1.0), view());
    let groups = by_turns(&scene.cloud, 5);
    let by = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| pictures(&scene, &groups))
    };
    let one = by(1);
    assert!([2, 3, 7].into_iter().all(|threads| by(threads) == one));
}

#[test]
fn shift_opaque_pictures_are_the_same_far_away() {
    let mut scene = Scene::new(soup(1000, 1.0), view());
    let groups = by_turns(&scene.cloud, 5);
    let one = pictures(&scene, &groups);
    let far = DVec3::new(16_777_216.0, -33_554_432.0, 16_777_216.0);
    scene.cloud.origin += far;
    scene.camera.position += far;
    assert_eq!(pictures(&scene, &groups), one);
}

#[test]
fn scale2_opaque_pictures_keep_their_bits() {
    let picture = |exponent: i32| {
        let scale = 2f32.powi(exponent);
        let mut cloud: Cloud = soup(1000, 1.0);
        cloud.origin *= f64::from(scale);
        cloud.position.iter_mut().for_each(|p| *p *= scale);
        cloud.radius.iter_mut().for_each(|r| *r *= scale);
        cloud.tangent.iter_mut().for_each(|t| *t *= scale);
        cloud.cross_section.iter_mut().for_each(|a| *a *= scale * scale);
        let scene = Scene::new(cloud, camera(DVec3::new(0.0, 0.0, 4.0 * f64::from(scale)), [64, 48]));
        pictures(&scene, &by_turns(&scene.cloud, 5)).map(|picture| {
            let depth: Vec<f32> = picture.image.depth.iter().map(|depth| depth / scale).collect();
            (depth, picture.image.channels, picture.disc)
        })
    };
    let one = picture(0);
    for exponent in [-20, 20] {
        assert_eq!(picture(exponent), one, "2^{exponent}");
    }
}
