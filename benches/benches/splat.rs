//! Sort, project and fold translucent splats at 600x500: the outdoor camera, and random splats of 3x3 pixels.
//!
//! A plain table of minima: other work on the machine only ever adds time. The second number of each part is the time of
//! all threads on processors, which other work adds less to. `-- N` runs one number of points. `cargo xtask papers --times` takes the
//! means by the clock.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use organza_benches::{Frame, TABLE_1, processor_ms, record};
use std::time::Instant;

/// Runs each part this often.
const REPEATS: usize = 15;

fn main() {
    let only: Option<usize> = std::env::args().skip(1).find_map(|a| a.parse().ok());
    println!(
        "{:>24} {:>9} {:>9} {:>9} {:>9} {:>12} {:>12}",
        "ms", "sort", "project", "fold", "sum", "fragments", "Mfragments/s"
    );
    for n in TABLE_1.into_iter().filter(|n| only.is_none_or(|only| only == *n)) {
        row(&format!("outdoor {n}"), &mut Frame::outdoor(n));
        row(&format!("3x3 pixels {n}"), &mut Frame::small_splats(n));
    }
    if only.is_none() {
        growth();
    }
}

/// How the sum grows when the points double.
fn growth() {
    let mut before = None;
    for n in [1_000_000, 2_000_000, 4_000_000, 8_000_000, 16_000_000] {
        let mut frame = Frame::small_splats(n);
        let [wall, busy] = row(&format!("3x3 pixels {n}"), &mut frame);
        let ratio = before.replace([wall, busy]).map_or(String::new(), |b: [f64; 2]| {
            format!("{:.2} of the half as many, {:.2} of their processor time", wall / b[0], busy / b[1])
        });
        println!("{:>24} {:.1} bytes a point. {ratio}", "", frame.bytes_a_point());
    }
}

fn row(name: &str, frame: &mut Frame) -> [f64; 2] {
    let mut best = [[f64::INFINITY; 2]; 3];
    let mut clock = [const { Vec::new() }; 3];
    let mut fragments = 0;
    for _ in 0..REPEATS {
        let steps: [&mut dyn FnMut(&mut Frame); 3] =
            [&mut |f| f.sort(), &mut |f| f.project(), &mut |f| fragments = f.fold().fragments];
        for (k, (step, best)) in steps.into_iter().zip(&mut best).enumerate() {
            let start = Instant::now();
            let busy = processor_ms();
            step(frame);
            clock[k].push(start.elapsed().as_secs_f64() * 1e3);
            best[0] = best[0].min(clock[k][clock[k].len() - 1]);
            best[1] = best[1].min(processor_ms() - busy);
        }
    }
    for (step, ms) in ["sort", "project", "fold"].iter().zip(&clock) {
        record(&format!("splat/{name}/{step}"), ms, frame.splats());
    }
    let sum = [0, 1].map(|k| best.iter().map(|b| b[k]).sum::<f64>());
    let rate = fragments as f64 / best[2][0] * 1e-3;
    let cell = |b: [f64; 2]| format!("{:.1} {:.0}", b[0], b[1]);
    let [sort, project, fold] = best.map(cell);
    println!("{name:>24} {sort:>10} {project:>10} {fold:>10} {:>10} {fragments:12} {rate:9.0}", cell(sum));
    sum
}
