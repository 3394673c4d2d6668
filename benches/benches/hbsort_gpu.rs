//! The order of splats on a device, portable kernels and those by subgroups in one run.
//!
//! Times are the device's own, least of several runs, the ways in turn. `-- N` runs one number of splats.
#![allow(missing_docs, reason = "a benchmark")]

use hbsort::Params;
use hbsort::gpu::{Capacities, Recorded, record};
use organza_benches::{TABLE_1, device, outdoor_cloud};
use splat_shaders::{DeviceError, Executor, Lanes, Ready, Run};

/// Runs of each way that count.
const RUNS: usize = 7;

/// Milliseconds of the passes whose kernel's name begins with one of these.
fn milliseconds(run: &Run, names: &[&str]) -> f64 {
    let counts = run.passes.iter().filter(|p| names.iter().any(|name| p.kernel.starts_with(name)));
    counts.map(|p| p.nanoseconds).sum::<f64>() * 1e-6
}

/// A way ready to run, with the least times that it took: of scatters, of all passes of the sort, of everything.
struct Way {
    lanes: Lanes,
    ready: Box<dyn Ready>,
    least: [f64; 3],
}

impl Way {
    fn run(&mut self, inputs: &[(splat_shaders::BufferId, &[u8])]) -> Result<Run, DeviceError> {
        let run = self.ready.run(inputs)?;
        let took = [&["radix_scatter"][..], &["radix", "scan"], &[""]].map(|names| milliseconds(&run, names));
        for (least, took) in self.least.iter_mut().zip(took) {
            *least = least.min(took);
        }
        Ok(run)
    }
}

fn measure(device: &mut dyn Executor, splats: usize) -> Result<(), Box<dyn std::error::Error>> {
    let (cloud, camera) = outdoor_cloud(splats);
    let params = Params { exact: true, ..Params::default() };
    let recorded = record(Capacities { splats: splats as u32, kept: splats as u32 });
    let uploads = recorded.uploads(&cloud, None, &camera, &params)?;
    let inputs = recorded.inputs(&uploads);
    let mut kinds = vec![Lanes::Portable, Lanes::for_adapter(device.adapter())];
    kinds.dedup();
    let mut ways = Vec::new();
    for lanes in kinds {
        let ready = device.prepare(&recorded.recording.by(lanes))?;
        ways.push(Way { lanes, ready, least: [f64::INFINITY; 3] });
    }
    let mut kept = 0;
    for run in 0..=RUNS {
        for way in &mut ways {
            let done = way.run(&inputs)?;
            kept = keys(&recorded, &done);
            // The first run pays for what drivers put off.
            if run == 0 {
                way.least = [f64::INFINITY; 3];
            }
        }
    }
    for Way { lanes, least: [scatters, sort, whole], .. } in &ways {
        let rate = kept as f64 / sort * 1e-3;
        println!(
            "{splats} splats, {kept} kept, {lanes:?}: scatters {scatters:.3} ms, sort {sort:.3} ms ({rate:.1} M keys/s), \
             with culling {whole:.3} ms"
        );
    }
    Ok(())
}

/// How many splats were sorted.
fn keys(recorded: &Recorded, run: &Run) -> u32 {
    run.bytes(recorded.state).first_chunk().map_or(0, |kept| u32::from_ne_bytes(*kept))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let only: Option<usize> = std::env::args().skip(1).find_map(|a| a.parse().ok());
    let Some(mut device) = device() else { return Ok(()) };
    for splats in TABLE_1.into_iter().filter(|n| only.is_none_or(|only| only == *n)) {
        measure(&mut *device, splats)?;
    }
    Ok(())
}
