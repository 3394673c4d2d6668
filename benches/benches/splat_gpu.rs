//! Compositing of translucent splats on a device at 600x500: the footprints, order and colours are made by the processor and
//! uploaded.
//!
//! Least of several runs. Milliseconds of the device's clock; `run` is the wall time of a run with uploads and what is read
//! back. `-- N` runs one number of points.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use organza_benches::{Frame, TABLE_1, device};
use splat_core::raster::FoldInput;
use splat_core::raster::gpu::{Recorded, record};
use splat_core::{Accumulator, Error};
use splat_shaders::{DeviceError, Executor, Lanes, Overflow, Ready};
use std::time::Instant;

/// Runs that count.
const REPEATS: usize = 5;

fn main() {
    let only: Option<usize> = std::env::args().skip(1).find_map(|a| a.parse().ok());
    let Some(mut device) = device() else { return };
    for n in TABLE_1.into_iter().filter(|n| only.is_none_or(|only| only == *n)) {
        for (name, mut frame) in [("outdoor", Frame::outdoor(n)), ("3x3 pixels", Frame::small_splats(n))] {
            frame.project();
            frame.with_input(|input, empty| {
                println!("{name} {n}: {} ordered, {} in view", input.order.len(), input.projected.visible());
                if let Err(e) = measure(&mut *device, input, empty) {
                    println!("{e}");
                }
            });
        }
    }
}

/// Least times so far, milliseconds.
struct Best {
    run: f64,
    /// Sum over all passes, then each kernel.
    passes: (f64, Vec<(&'static str, f64)>),
}

fn measure(device: &mut dyn Executor, input: &FoldInput<'_>, empty: &Accumulator) -> Result<(), DeviceError> {
    let mut best = Best { run: f64::INFINITY, passes: (f64::INFINITY, Vec::new()) };
    let (recorded, mut ready) = ready(device, input, empty)?;
    for _ in 0..REPEATS {
        best.run(&recorded, &mut *ready, input, empty);
    }
    let Best { run, passes: (sum, kernels) } = best;
    let shares: Vec<String> = kernels.iter().map(|(kernel, ms)| format!("{kernel} {ms:.2}")).collect();
    println!("{sum:9.2} of the device, run {run:9.2}: {}", shares.join(", "));
    Ok(())
}

/// Ready, as pictures are made on this device, with room for all tile entries, which a first run counts.
fn ready(
    device: &mut dyn Executor,
    input: &FoldInput<'_>,
    empty: &Accumulator,
) -> Result<(Recorded, Box<dyn Ready>), DeviceError> {
    let lanes = Lanes::for_adapter(device.adapter());
    let mut made = |entries| {
        let recorded = record(input.capacities(empty, entries)).expect("a size that is recorded");
        let ready = device.prepare(&recorded.recording.by(lanes))?;
        Ok::<_, DeviceError>((recorded, ready))
    };
    let (recorded, mut first) = made(1)?;
    let uploads = recorded.uploads(input, empty).expect("room for all splats");
    let run = first.run(&recorded.inputs(&uploads))?;
    match recorded.counts(run.bytes(recorded.state)) {
        Err(Error::Overflow(Overflow { needed, .. })) => {
            drop(first);
            made(u32::try_from(needed).expect("entries that a device can count"))
        }
        counted => {
            counted.expect("what the recording gives");
            Ok((recorded, first))
        }
    }
}

impl Best {
    fn run(&mut self, recorded: &Recorded, ready: &mut dyn Ready, input: &FoldInput<'_>, empty: &Accumulator) {
        let uploads = recorded.uploads(input, empty).expect("room for all splats");
        let start = Instant::now();
        let run = ready.run(&recorded.inputs(&uploads)).expect("a device that is there");
        self.run = self.run.min(start.elapsed().as_secs_f64() * 1e3);
        let mut image = empty.clone();
        let read = [recorded.state, recorded.planes].map(|buffer| run.bytes(buffer));
        recorded.finish(read, &mut image).expect("room for all tile entries");
        let mut kernels: Vec<(&'static str, f64)> = Vec::new();
        for pass in &run.passes {
            match kernels.iter_mut().find(|(kernel, _)| *kernel == pass.kernel) {
                Some((_, ms)) => *ms += pass.nanoseconds * 1e-6,
                None => kernels.push((pass.kernel, pass.nanoseconds * 1e-6)),
            }
        }
        let sum: f64 = kernels.iter().map(|(_, ms)| ms).sum();
        if sum < self.passes.0 {
            self.passes = (sum, kernels);
        }
    }
}
