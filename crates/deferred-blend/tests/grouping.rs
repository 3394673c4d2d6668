//! Grouping.

use deferred_blend::{Error, grouping::Groups};

#[test]
fn groups_told_from_outside_are_checked() {
    let groups = Groups::new(2, vec![0, 1, 1]).expect("below the count");
    assert_eq!((groups.count(), groups.of()), (2, [0, 1, 1].as_slice()));
    assert!(matches!(Groups::new(0, vec![]), Err(Error::Parameter { .. })));
    assert!(matches!(Groups::new(257, vec![]), Err(Error::Parameter { .. })));
    assert!(matches!(Groups::new(2, vec![0, 2]), Err(Error::Parameter { .. })));
}
