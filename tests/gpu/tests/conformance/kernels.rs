//! Each kernel that stands by itself against a few lines of plain code.

use gpu_conformance::{adapter, bytes, open, words};
use splat_core::rng;
use splat_shaders::{DeviceError, Groups, Recording, Validation, kernels};

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
        let run = device.run(&r, &[(scan, &bytes(&[n, 77])), (numbers, &bytes(&given))]).unwrap();
        let mut before = 0;
        let expected: Vec<u32> = given.iter().map(|v| (before, before += v).0).collect();
        assert_eq!(words(run.bytes(scan)), [n, before], "{n}");
        assert_eq!(words(run.bytes(numbers))[..n as usize], expected, "{n}");
        assert!(run.passes.len() == 3 && run.passes.iter().all(|p| p.nanoseconds > 0.0), "{:?}", run.passes);
    }
    assert_eq!(device.take_messages(), [""; 0]);
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
