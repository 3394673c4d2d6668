//! The recorded sort, without a device: what it is, and what it refuses.

use crate::common::{camera, outdoor};
use hbsort::gpu::{Capacities, record};
use hbsort::{Error, Params};
use splat_core::glam::DVec3;
use splat_shaders::Overflow;

const ROOM: Capacities = Capacities { splats: 100_000, kept: 60_000 };

#[test]
fn it_is_as_kept_in_text() {
    let found = record(ROOM).recording.to_string();
    assert_eq!(found, include_str!("recording.txt"), "now:\n{found}");
}

#[test]
fn it_is_without_fault_for_any_room() {
    for splats in [0, 1, 1023, 1024, 1025, 5_000_000, 100_000_000] {
        for kept in [0, 1, 2048, splats] {
            record(Capacities { splats, kept }).recording.check().unwrap();
        }
    }
}

#[test]
fn too_little_room_says_how_much() {
    let cloud = outdoor(2000, DVec3::ZERO);
    let small = record(Capacities { splats: 1999, kept: 100 });
    let params = Params::default();
    let refused = small.uploads(&cloud, None, &camera(DVec3::ZERO), &params);
    assert_eq!(refused, Err(Error::Overflow(Overflow { what: "splats", needed: 2000, had: 1999 })));
    // What a device reads back when 101 splats are in the view.
    let mut state = [0u8; 48];
    state[0] = 101;
    let order = small.order([&state, &[0; 400], &[0; 400]], &cloud, None, &params);
    assert_eq!(order, Err(Error::Overflow(Overflow { what: "splats in the view", needed: 101, had: 100 })));
}

#[test]
fn bytes_that_no_run_gave_are_refused() {
    let cloud = outdoor(2000, DVec3::ZERO);
    let recorded = record(ROOM);
    let mut state = [0u8; 48];
    state[0] = 3;
    let order = |reads| recorded.order(reads, &cloud, None, &Params::default()).unwrap_err();
    let read_back = |what, expected, found| Error::ReadBack { what, expected, found };
    assert_eq!(order([&[], &[], &[]]), read_back("state", 48, 0));
    assert_eq!(order([&state, &[0; 8], &[0; 12]]), read_back("keys", 12, 8));
    assert_eq!(order([&state, &[0; 12], &[0; 8]]), read_back("places", 12, 8));
    assert_eq!(order([&state, &[0; 12], &[255; 12]]), read_back("places", 2000, u64::from(u32::MAX)));
}
