//! The recorded ensemble, without a device: what it is, and what it refuses.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use pbsr::gpu::{Capacities, record};

const ROOM: Capacities = Capacities { size: [200, 100], objects: 2, levels: 2, of_set: 5000, particles: 9000 };

#[test]
fn it_is_as_kept_in_text() {
    let found = record(ROOM).unwrap().recording.to_string();
    assert_eq!(found, include_str!("recording.txt"), "now:\n{found}");
}

#[test]
fn it_is_without_fault_for_any_room() {
    for (levels, of_set) in [(0, 0), (1, 0), (3, 1), (2, 70_000_000)] {
        let room = Capacities { levels, of_set, ..ROOM };
        record(room).unwrap().recording.check().unwrap();
    }
    assert!(record(Capacities { size: [0, 4], ..ROOM }).is_err());
    assert!(record(Capacities { size: [4, 40_000], ..ROOM }).is_err());
}
