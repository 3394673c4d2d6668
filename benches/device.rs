//! The device that benchmarks run on.

use splat_shaders::{Choice, Executor, Validation};

/// The device that `ORGANZA_ADAPTER` names in part, else the first real GPU, by the executor that `ORGANZA_EXECUTOR` names: `ash`,
/// the default, or `wgpu`. None, with a line said, where there is none.
pub fn device() -> Option<Box<dyn Executor>> {
    let choice = std::env::var("ORGANZA_ADAPTER").map_or(Choice::Gpu, Choice::Named);
    let wgpu = std::env::var("ORGANZA_EXECUTOR").is_ok_and(|name| name == "wgpu");
    let backend = if wgpu { gpu_wgpu::backend() } else { gpu_ash::backend() };
    match backend.open(&choice, Validation::Off) {
        Ok(device) => {
            let adapter = device.adapter();
            let whose = if adapter.kind.is_gpu() { "" } else { ": NO GPU, all times are the processor's" };
            println!("{} by {}, {}{whose}", adapter.name, backend.name(), adapter.driver);
            Some(device)
        }
        Err(e) => {
            println!("skipped: {e}; ORGANZA_ADAPTER names a device, a software driver too");
            None
        }
    }
}
