//! The depth of Eq. 14.

use super::{minimum, plain, resolve, voronoi};
use crate::floored::by_turns;
use crate::scenes::{Scene, camera, disc, parallel, sphere};
use deferred_blend::{Params, Passes};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Splat};

/// Two discs of one plane in one group meet at the bisector of their centres, and a third, far behind, makes steps of depth small:
/// n is from a few to a million.
#[test]
fn db5_cells_end_at_the_bisector_for_any_number_of_steps() {
    let params = Params { disc_scale: 1.0, ..Params::default() };
    let middles = [Vec3::new(-0.2, 0.0, 0.06), Vec3::new(0.2, 0.1, -0.07)];
    let normal = Vec3::new(0.3, 0.1, 1.0);
    for behind in [1.0, 1e2, 1e4, 1e6, 1e8] {
        let mut cloud = Cloud::new(DVec3::ZERO);
        let origin = middles[0];
        let second = middles[1] - normal.normalize() * (middles[1] - origin).dot(normal.normalize());
        for (center, color) in [(origin, [1.0, 0.0, 0.0]), (second, [0.0, 1.0, 0.0])] {
            cloud.push(&Splat { color, ..disc(center, normal, 0.2, 0.5) });
        }
        cloud.push(&disc(Vec3::new(0.0, 50.0, -behind), Vec3::Z, 1e-3, 0.5));
        let scene = Scene::new(cloud, parallel(DVec3::Z * 3.0, 1.0, [200, 200]));
        let groups = by_turns(&scene.cloud, 1);
        let picture = resolve(&scene, &params, voronoi(&groups));
        let mut cells = [0, 0];
        for k in (0..200 * 200).filter(|&k| picture.disc[k] != u32::MAX) {
            let [x, y] = [(k % 200) as f32 - 99.5, (k / 200) as f32 - 99.5].map(|v| v / 200.0);
            let place = Vec3::new(x, -y, 3.0 - picture.image.depth[k]);
            let distances = [origin, second].map(|center| place.distance(center));
            let nearer = usize::from(distances[1] < distances[0]);
            cells[nearer] += 1;
            // The difference of distances grows by at most 2 a unit, and a pixel is 1/200 wide.
            if (distances[0] - distances[1]).abs() > 0.01 {
                assert_eq!(picture.disc[k], nearer as u32, "{behind}: pixel {k}");
                assert_eq!([0, 1].map(|c| picture.image.channels[c][k]), [[1.0, 0.0], [0.0, 1.0]][nearer]);
            }
        }
        assert!(cells.iter().all(|&pixels| pixels > 5000), "{cells:?}");
    }
}

/// Fig. 13: with few groups flaps of discs cover the middles of others; by Eq. 14 they do not.
#[test]
fn voronoi_depth_comes_nearer_to_all_discs_than_plain_depth() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    sphere(&mut cloud, Vec3::ZERO, 1.0, 3000, 0.5);
    cloud.color = cloud.normal.iter().map(|n| (*n * 0.5 + 0.5).to_array()).collect();
    let scene = Scene::new(cloud, camera(DVec3::new(0.0, 0.5, 3.0), [96, 72]));
    let params = Params::default();
    let reference = resolve(&scene, &params, Passes::TwoPlusOne);
    let few = [1, 2, 4].map(|count| by_turns(&scene.cloud, count));
    let many = minimum(&scene, &params);
    let error = |passes: Passes<'_>| {
        let picture = resolve(&scene, &params, passes);
        let planes = picture.image.channels.iter().zip(&reference.image.channels);
        let squares = planes.flat_map(|(a, b)| a.iter().zip(b)).map(|(a, b)| f64::from(a - b).powi(2));
        (squares.sum::<f64>() / (3.0 * 96.0 * 72.0)).sqrt()
    };
    for groups in &few {
        let [with, without] = [voronoi(groups), plain(groups)].map(error);
        println!("K = {}: RMSE {with:.2e} by Eq. 14, {without:.2e} by depth", groups.count());
        assert!(with < 0.6 * without, "{with} {without}");
    }
    assert!(error(voronoi(&many)) < 0.1 * error(voronoi(&few[0])));
}
