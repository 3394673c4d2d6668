//! What the benchmarks share: the splats of the outdoor scene, thinned or repeated to a given number.
#![allow(
    clippy::missing_panics_doc,
    clippy::expect_used,
    reason = "a benchmark without its scene has nothing to measure"
)]

mod device;
mod dragon;
mod frame;
mod head;
mod record;

pub use device::device;
pub use dragon::{disc_scale, dragon, mean_degree, overlap_graph};
pub use frame::Frame;
pub use head::HeadLike;
pub use record::record;

use organza::{Context, Files, Loaded, Progress, RenderOptions, load, scene};
use splat_core::{Camera, Cloud, glam::Vec3, rng};
use std::path::Path;
use std::sync::OnceLock;

/// Numbers of points of Gunjee 2007, Table 1: dragon, cloud, outdoor scene.
pub const TABLE_1: [usize; 3] = [437_645, 624_614, 1_841_320];

/// The outdoor scene, loaded once.
pub fn outdoor() -> &'static Loaded {
    static SCENE: OnceLock<Loaded> = OnceLock::new();
    SCENE.get_or_init(|| {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/outdoor.toml");
        let scene = scene::load(&file, &scene::LoadOptions::default()).expect("scenes/outdoor.toml");
        let context =
            Context { files: &Files::default(), options: &RenderOptions::default(), progress: &Progress::new() };
        load(&scene, context).expect("the data of scenes/outdoor.toml")
    })
}

/// `n` splats with the places, sizes and attributes of the outdoor scene, and its camera.
///
/// Fewer than it has: every k-th in canonical order. More: each several times, moved within its radius. Radii and
/// cross-sections follow so that covered areas and optical depths stay.
pub fn outdoor_cloud(n: usize) -> (Cloud, Camera) {
    let scene = outdoor();
    let have = scene.cloud.len();
    let source = |i: usize| (i as u128 * have as u128 / n as u128) as u32;
    let ids: Vec<u32> = (0..n).map(source).collect();
    let mut cloud = scene.cloud.gather(&ids);
    let share = have as f32 / n as f32;
    for i in 0..n {
        if i > 0 && ids[i] == ids[i - 1] {
            let jitter = Vec3::from_array([0, 1, 2].map(|k| rng::unit_f32(1, 1, i as u64, k) - 0.5));
            cloud.position[i] += jitter * cloud.radius[i];
        }
        cloud.radius[i] *= share.sqrt();
        cloud.cross_section[i] *= share;
    }
    cloud.canonicalize();
    (cloud, scene.camera)
}

/// Time that all threads of this process have spent on processors, milliseconds; 0 where the system does not tell.
pub fn processor_ms() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let spent = |task: std::fs::DirEntry| -> Option<f64> {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split(' ').next()?.parse().ok()
    };
    tasks.flatten().filter_map(spent).sum::<f64>() * 1e-6
}
