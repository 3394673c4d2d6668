//! Silence means something only if faults are heard: the adapter is a real one, and validation speaks.

use gpu_ash::{AdapterKind, Choice, Device, DeviceError, Validation, adapters};
use gpu_conformance::{bytes, open_ash as open};
use splat_shaders::{Groups, Recording, kernels};

#[test]
fn the_adapter_is_the_one_that_was_asked_for() {
    let device = open().unwrap();
    let name = &device.adapter().name;
    match std::env::var("ORGANZA_ADAPTER") {
        Ok(part) => assert!(name.contains(&part), "{name}"),
        Err(_) => assert_eq!(device.adapter().kind, AdapterKind::Software, "{name}"),
    }
    assert!(device.adapter().binding_bytes >= 1 << 27, "Vulkan's least");
    assert!(adapters().unwrap().contains(device.adapter()));
    let refused = Device::open(&Choice::Named("no such adapter".to_owned()), Validation::Off);
    assert!(matches!(refused, Err(DeviceError::NoDevice { .. })));
}

#[test]
fn the_canary_sings() {
    // More workgroups across than a device takes: the layer must say so, or it is not there.
    let mut device = open().unwrap();
    let mut r = Recording::default();
    let [scan, numbers] = [r.input("scan", 8), r.input("numbers", 8)];
    let sums = r.scratch("sums", 8);
    r.dispatch(&kernels::SCAN_REDUCE, Groups::Direct([u32::MAX, 1, 1]), &[scan, numbers, sums], &[]);
    // Recorded, never run.
    drop(device.prepare(&r).unwrap());
    let said = device.take_messages();
    assert!(said.iter().any(|m| m.contains("VUID-vkCmdDispatch-groupCountX-00386")), "{said:?}");
}

#[test]
fn a_missing_barrier_is_heard() {
    let mut device = open().unwrap();
    let recording = hbsort::gpu::record(hbsort::gpu::Capacities { splats: 100, kept: 100 }).recording;
    drop(device.prepare(&recording).unwrap());
    assert_eq!(device.take_messages(), [""; 0]);
    drop(device.prepare_without_barriers(&recording).unwrap());
    let said = device.take_messages();
    assert!(said.iter().any(|m| m.contains("SYNC-HAZARD-READ-AFTER-WRITE")), "{said:?}");
}

#[test]
fn a_write_beyond_a_buffer_is_heard() {
    if std::env::var("ORGANZA_VALIDATION").as_deref() != Ok("gpu-assisted") {
        return;
    }
    let mut device = open().unwrap();
    let mut r = Recording::default();
    let [scan, numbers] = [r.input("scan", 8), r.input("numbers", 4 * 5000)];
    // Room for one sum of five.
    let sums = r.scratch("sums", 4);
    r.dispatch(&kernels::SCAN_REDUCE, Groups::cover(5), &[scan, numbers, sums], &[]);
    device.run(&r, &[(scan, &bytes(&[5000, 0]))]).unwrap();
    let said = device.take_messages();
    assert!(said.iter().any(|m| m.contains("out of bounds")), "{said:?}");
}
