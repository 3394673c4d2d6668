//! Each kernel that stands by itself against a few lines of plain code.

use gpu_conformance::{Device, adapter, bytes, open, words};
use splat_core::rng;
use splat_shaders::layouts::{Scan, SortState};
use splat_shaders::radix::{SORT_BLOCK, Scanned, SortPass, sort_pass};
use splat_shaders::{DeviceError, Groups, Lanes, Recording, SubgroupOps, Validation, kernels};

#[test]
fn a_scan_is_the_sum_of_what_comes_before() {
    let mut device = open().unwrap();
    for n in [0u32, 1, 4, 255, 256, 1023, 1024, 1025, 4096, 300_000] {
        let mut r = Recording::default();
        let scan = r.input("scan", 8);
        let numbers = r.input("numbers", 4 * u64::from(n));
        let blocks = n.div_ceil(1024);
        let sums = r.scratch("sums", 4 * u64::from(blocks));
        // More workgroups than blocks: the surplus has nothing to do.
        let groups = Groups::cover(blocks + 3);
        r.dispatch(&kernels::SCAN_REDUCE, groups, &[scan, numbers, sums], &[]);
        r.dispatch(&kernels::SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
        r.dispatch(&kernels::SCAN_APPLY, groups, &[scan, numbers, sums], &[]);
        r.read(scan);
        r.read(numbers);

        let given: Vec<u32> = (0..n).map(|i| (rng::unit_f32(5, 0, i.into(), 0) * 9.0) as u32).collect();
        for lanes in device.lanes() {
            let run = device.run(&r.by(lanes), &[(scan, &bytes(&[n, 77])), (numbers, &bytes(&given))]).unwrap();
            let mut before = 0;
            let expected: Vec<u32> = given.iter().map(|v| (before, before += v).0).collect();
            assert_eq!(words(run.bytes(scan)), [n, before], "{n} {lanes:?}");
            assert_eq!(words(run.bytes(numbers))[..n as usize], expected, "{n} {lanes:?}");
            assert!(run.passes.len() == 3 && run.passes.iter().all(|p| p.nanoseconds > 0.0), "{:?}", run.passes);
            let by_subgroups = run.passes.iter().filter(|p| p.kernel.ends_with("_subgroup")).count();
            assert_eq!(by_subgroups, if lanes == Lanes::Subgroup { 3 } else { 0 });
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

/// Keys and companions after a pass of the sort by the bits from `shift` on; at fault where the digits are not scanned.
fn sorted(device: &mut Device, lanes: Lanes, keys: &[u32], shift: u32, scans: bool) -> [Vec<u32>; 2] {
    let n = keys.len() as u32;
    let mut r = Recording::default();
    let [state, scan] = [r.input("sort", size_of::<SortState>() as u64), r.input("scan", size_of::<Scan>() as u64)];
    let from = ["keys", "companions"].map(|name| r.input(name, 4 * u64::from(n)));
    let to = ["sorted", "their companions"].map(|name| r.scratch(name, 4 * u64::from(n)));
    let digits = Scanned::digits(&mut r, scan, n);
    if scans {
        sort_pass(&mut r, SortPass { shift, state, from, to, digits });
    } else {
        let groups = Groups::cover(n.div_ceil(SORT_BLOCK));
        r.dispatch(&kernels::RADIX_HISTOGRAM, groups, &[state, from[0], digits.numbers], &[shift]);
        let scattered = [state, from[0], from[1], digits.numbers, to[0], to[1]];
        r.dispatch(&kernels::RADIX_SCATTER, groups, &scattered, &[shift]);
    }
    to.iter().for_each(|buffer| r.read(*buffer));
    let of_sort = SortState::for_entries(n);
    let of_scan = Scan::of_digits(n);
    let companions: Vec<u32> = (0..n).map(|i| i ^ 0x5555).collect();
    let inputs = [
        (state, bytemuck::bytes_of(&of_sort)),
        (scan, bytemuck::bytes_of(&of_scan)),
        (from[0], &bytes(keys)),
        (from[1], &bytes(&companions)),
    ];
    let run = device.run(&r.by(lanes), &inputs).unwrap();
    to.map(|buffer| words(run.bytes(buffer))[..n as usize].to_vec())
}

#[test]
fn a_pass_of_the_sort_is_stable_for_any_keys() {
    let mut device = open().unwrap();
    let ways = device.lanes();
    let word = |i: u32, k| rng::bits(8, 0, i.into(), k) as u32;
    type Keys = fn(&dyn Fn(u32, u64) -> u32, u32) -> u32;
    let kinds: [(&str, Keys); 4] = [
        ("random", |word, i| word(i, 0)),
        ("few digits", |word, i| (word(i, 1) % 3) * 0x55_0055),
        ("one", |_, _| 0xffff_ffff),
        ("in order", |_, i| i * 0x1_0001),
    ];
    for n in [1u32, 31, 255, 256, 257, 2047, 2048, 2049, 9000] {
        for (name, keys) in kinds {
            let given: Vec<u32> = (0..n).map(|i| keys(&word, i)).collect();
            for (shift, lanes) in [0, 16, 24].into_iter().flat_map(|s| ways.iter().map(move |l| (s, *l))) {
                let mut places: Vec<u32> = (0..n).collect();
                places.sort_by_key(|i| given[*i as usize] >> shift & 255);
                let expected = [
                    places.iter().map(|i| given[*i as usize]).collect::<Vec<_>>(),
                    places.iter().map(|i| i ^ 0x5555).collect(),
                ];
                assert_eq!(sorted(&mut device, lanes, &given, shift, true), expected, "{n} {name} {shift} {lanes:?}");
                // By other digits, or without the scan, it is another order.
                if name == "random" && n == 2048 {
                    assert_ne!(sorted(&mut device, lanes, &given, shift ^ 8, true), expected, "{lanes:?}");
                    assert_ne!(sorted(&mut device, lanes, &given, shift, false), expected, "{lanes:?}");
                }
            }
        }
    }
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn what_a_device_cannot_do_across_subgroups_is_refused_by_name() {
    let device = open().unwrap();
    let mut r = Recording::default();
    let [scan, sums] = [r.input("scan", 8), r.input("sums", 8)];
    r.dispatch(&kernels::SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
    let mut without = device.adapter().clone();
    without.subgroup_ops = SubgroupOps::NONE;
    let refused = without.accept(&r.by(Lanes::Subgroup));
    assert_eq!(refused, Err(DeviceError::Lacking { kernel: "scan_spine_subgroup", what: "sums of subgroups" }));
    assert_eq!(
        (without.accept(&r.by(Lanes::for_adapter(&without))), Lanes::for_adapter(&without)),
        (Ok(()), Lanes::Portable)
    );
    // Lavapipe has them by either executor, as wide as its vectors.
    assert_eq!(device.lanes(), [Lanes::Portable, Lanes::Subgroup]);
    if let Ok(bits) = std::env::var("LP_NATIVE_VECTOR_WIDTH") {
        assert_eq!(device.adapter().subgroup, bits.parse::<u32>().unwrap() / 32);
    }
}

#[test]
fn a_prepared_recording_runs_again() {
    let mut device = open().unwrap();
    let mut r = Recording::default();
    let [scan, sums] = [r.input("scan", 8), r.input("sums", 8)];
    r.dispatch(&kernels::SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
    r.read(sums);
    let mut prepared = device.prepare(&r).unwrap();
    assert_eq!(words(prepared.run(&[]).unwrap().bytes(sums)), [0, 0]);
    let run = prepared.run(&[(scan, &bytes(&[2000, 0])), (sums, &bytes(&[5, 6]))]).unwrap();
    assert_eq!(words(run.bytes(sums)), [0, 5]);
    // What is not given stays as it was.
    let run = prepared.run(&[(sums, &bytes(&[8]))]).unwrap();
    assert_eq!(words(run.bytes(sums)), [0, 8]);
    assert!(prepared.run(&[(sums, &[0; 12])]).is_err() && prepared.run(&[(sums, &[0; 3])]).is_err());
    assert_eq!(device.take_messages(), [""; 0]);
}

#[test]
fn a_device_that_is_lost_says_so_and_another_can_be_opened() {
    let mut r = Recording::default();
    let [scan, sums] = [r.input("scan", 8), r.input("sums", 8)];
    r.dispatch(&kernels::SCAN_SPINE, Groups::cover(1), &[scan, sums], &[]);
    r.read(sums);
    let inputs = [(scan, &bytes(&[2000, 0])[..]), (sums, &bytes(&[5, 6])[..])];
    macro_rules! lost {
        ($executor:ident) => {
            let mut device = $executor::Device::open(&adapter(), Validation::Off).unwrap();
            let mut prepared = device.prepare(&r).unwrap();
            assert_eq!(words(prepared.run(&inputs).unwrap().bytes(sums)), [0, 5]);
            device.loss()();
            assert_eq!(prepared.run(&inputs), Err(DeviceError::Lost));
            assert_eq!(device.run(&r, &inputs), Err(DeviceError::Lost));
            let mut fresh = $executor::Device::open(&adapter(), Validation::Off).unwrap();
            assert_eq!(words(fresh.run(&r, &inputs).unwrap().bytes(sums)), [0, 5]);
        };
    }
    lost!(gpu_ash);
    lost!(gpu_wgpu);
}
