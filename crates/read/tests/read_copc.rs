//! COPC is read by levels of detail where fewer points are wanted than it has.
#![cfg(feature = "las")]

use crate::read_samples::copc::copc;
use read::{Loaded, Notes, ReadError, ReadParams, bytes};
use splat_core::RawPoints;

const LEVELS: [i32; 4] = [5, 20, 60, 200];

fn at_most(content: &[u8], most_points: Option<u64>) -> Result<(RawPoints, Notes), ReadError> {
    match bytes("a.copc.laz", content, &ReadParams { most_points, ..ReadParams::default() }, None)? {
        (Loaded::Points(points), notes) => Ok((points, notes)),
        other => panic!("not points: {other:?}"),
    }
}

#[test]
fn whole_levels_are_read_as_far_as_they_fit() {
    let content = copc(&LEVELS);
    let (all, notes) = at_most(&content, None).unwrap();
    assert_eq!((all.len(), notes.remarks.len()), (285, 0));
    let steps = |points: &RawPoints| points.lattice.as_ref().unwrap().steps.clone();
    for (most, read, points) in [(0, 1, 5), (24, 1, 5), (25, 2, 25), (84, 2, 25), (85, 3, 85), (284, 3, 85)] {
        let (some, notes) = at_most(&content, Some(most)).unwrap();
        // The chunks of the sample lie in the order of their levels.
        assert_eq!(steps(&some), steps(&all)[..points], "{most}");
        let said =
            format!("COPC, {read} of 4 levels of detail: {points} of 285 points, as at most {most} are asked for");
        assert_eq!(notes.remarks, [said]);
    }
    for most in [285, u64::MAX] {
        assert_eq!(at_most(&content, Some(most)).unwrap().0, all);
    }
}

#[test]
fn a_hierarchy_that_lies_is_refused() {
    let content = copc(&LEVELS);
    let page = content.len() - 32 * 5;
    let round = [&(page as u64).to_le_bytes()[..], &128i32.to_le_bytes()].concat();
    for (at, bytes, expected) in [
        // The record: where the first page begins, and its length.
        (375 + 54 + 40, &[0xff; 8][..], "expected pages of the hierarchy within the file"),
        (375 + 54 + 48, &[33, 0], "expected pages of the hierarchy within the file"),
        // The first entry: its level, its chunk, its points.
        (page, &[53], "expected entries of level 0 to 52 with points, found level 53, 5 points"),
        (page, &[0xff; 4], "expected entries of level 0 to 52 with points, found level -1, 5 points"),
        (page + 16, &[1], "expected chunks of 25 points where the hierarchy of COPC says, found 20"),
        (page + 28, &[6], "expected chunks of 26 points where the hierarchy of COPC says, found 25"),
        (
            page + 28,
            &[0xfe, 0xff, 0xff, 0xff],
            "expected entries of level 0 to 52 with points, found level 0, -2 points",
        ),
        // The last entry of the first page leads back to it, without an end.
        (page + 32 * 3 + 16, &round, "expected pages of the hierarchy within the file"),
    ] {
        let mut lies = content.clone();
        lies[at..at + bytes.len()].copy_from_slice(bytes);
        let error = at_most(&lies, Some(30)).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}
