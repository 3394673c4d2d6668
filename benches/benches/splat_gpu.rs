//! Compositing of translucent splats on a device at 600x500, by tiles and by its rasterizer: the same footprints, order and
//! colours, made by the processor and uploaded.
//!
//! Least of several runs each, alternating. Milliseconds of the device's clock, copies of images not counted; `run` is the wall
//! time of a run with uploads and what is read back. `-- N` runs one number of points.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use organza_benches::{Frame, TABLE_1, device};
use splat_core::raster::FoldInput;
use splat_core::raster::gpu::draw::{self, Precision};
use splat_core::raster::gpu::{Capacities, Recorded, record};
use splat_core::{Accumulator, Error};
use splat_shaders::{DeviceError, Executor, Ready};
use std::time::Instant;

/// Runs each way this often.
const REPEATS: usize = 5;

type Way = (&'static str, fn(Capacities) -> Result<Recorded, Error>);

const WAYS: [Way; 3] = [
    ("tiles", record),
    ("drawn", |room| draw::record(room, Precision::Single)),
    ("drawn, halves", |room| draw::record(room, Precision::Half)),
];

fn main() {
    let only: Option<usize> = std::env::args().skip(1).find_map(|a| a.parse().ok());
    let Some(mut device) = device() else { return };
    for n in TABLE_1.into_iter().filter(|n| only.is_none_or(|only| only == *n)) {
        for (name, mut frame) in [("outdoor", Frame::outdoor(n)), ("3x3 pixels", Frame::small_splats(n))] {
            frame.project();
            frame.with_input(|input, empty| {
                println!("{name} {n}: {} ordered, {} in view", input.order.len(), input.projected.visible());
                rows(&mut *device, input, empty);
            });
        }
    }
}

/// One way, ready to run, and its best so far.
struct Row {
    name: &'static str,
    recorded: Recorded,
    ready: Box<dyn Ready>,
    best_run: f64,
    /// Sum over all passes, then each kernel.
    best: (f64, Vec<(&'static str, f64)>),
}

fn rows(device: &mut dyn Executor, input: &FoldInput<'_>, empty: &Accumulator) {
    let mut rows = Vec::new();
    for (name, record) in WAYS {
        match row(device, input, empty, name, record) {
            Ok(row) => rows.push(row),
            Err(e) => println!("{name:>16} {e}"),
        }
    }
    for _ in 0..REPEATS {
        for row in &mut rows {
            row.run(input, empty);
        }
    }
    for Row { name, best_run, best: (sum, kernels), .. } in rows {
        let shares: Vec<String> = kernels.iter().map(|(kernel, ms)| format!("{kernel} {ms:.2}")).collect();
        println!("{name:>16} {sum:9.2} of the device, run {best_run:9.2}: {}", shares.join(", "));
    }
}

/// Ready with room for all tile entries, which a first try counts.
fn row(
    device: &mut dyn Executor,
    input: &FoldInput<'_>,
    empty: &Accumulator,
    name: &'static str,
    record: fn(Capacities) -> Result<Recorded, Error>,
) -> Result<Row, DeviceError> {
    let made = |device: &mut dyn Executor, entries| {
        let recorded = record(input.capacities(empty, entries)).expect("a size that is recorded");
        let ready = device.prepare(&recorded.recording)?;
        Ok::<_, DeviceError>(Row { name, recorded, ready, best_run: f64::INFINITY, best: (f64::INFINITY, Vec::new()) })
    };
    let mut first = made(device, 1)?;
    match first.run(input, empty) {
        Some(needed) => {
            drop(first);
            made(device, needed)
        }
        None => Ok(first),
    }
}

impl Row {
    /// Runs once; the entries that there was no room for.
    fn run(&mut self, input: &FoldInput<'_>, empty: &Accumulator) -> Option<u32> {
        let uploads = self.recorded.uploads(input, empty).expect("room for all splats");
        let start = Instant::now();
        let run = self.ready.run(&self.recorded.inputs(&uploads)).expect("a device that is there");
        let took = start.elapsed().as_secs_f64() * 1e3;
        let mut image = empty.clone();
        let read = [self.recorded.state, self.recorded.planes].map(|buffer| run.bytes(buffer));
        match self.recorded.finish(read, &mut image) {
            Err(Error::Overflow { needed, .. }) => return u32::try_from(needed).ok(),
            finished => drop(finished.expect("what the recording gives")),
        }
        let mut kernels: Vec<(&'static str, f64)> = Vec::new();
        for pass in &run.passes {
            match kernels.iter_mut().find(|(kernel, _)| *kernel == pass.kernel) {
                Some((_, ms)) => *ms += pass.nanoseconds * 1e-6,
                None => kernels.push((pass.kernel, pass.nanoseconds * 1e-6)),
            }
        }
        let sum: f64 = kernels.iter().map(|(_, ms)| ms).sum();
        if sum < self.best.0 {
            self.best = (sum, kernels);
        }
        self.best_run = self.best_run.min(took);
        None
    }
}
