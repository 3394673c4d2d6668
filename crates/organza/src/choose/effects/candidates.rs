//! Effects before the tolerance is spent on them, and the spending.

use super::Row;
use crate::plan::{Bound, Effect};

/// An effect before it is decided.
#[derive(Debug)]
pub(super) struct Candidate {
    /// The light or object that it is of; empty for the scene.
    pub(super) label: String,
    /// What decides.
    pub(super) choice: Choice,
    /// Those of one group stay or go together; `None` for one that stays or goes alone.
    pub(super) group: Option<usize>,
    /// Whether no technique of the scene has it.
    pub(super) is_missing: bool,
}

/// What decides about an effect.
#[derive(Debug)]
pub(super) enum Choice {
    /// Nothing in the scene causes an effect of this kind.
    Absent { reason: String },
    /// The scene, or what it has, decides.
    Settled { is_on: bool, reason: String, bound: Bound },
    /// The bound decides.
    Open { bound: Bound, on: String, off: String },
}

impl Candidate {
    /// One that stays or goes alone.
    pub(super) fn new(label: &str, choice: Choice) -> Self {
        Self { label: label.to_owned(), choice, group: None, is_missing: false }
    }

    /// The one of a kind that the scene has no cause for.
    pub(super) fn absent(reason: &str) -> Self {
        Self::new("", Choice::Absent { reason: reason.to_owned() })
    }

    /// Where the scene, or what it has, decides that it is left out, and nothing changes.
    pub(super) fn off(label: &str, reason: &str) -> Self {
        Self::new(label, Choice::Settled { is_on: false, reason: reason.to_owned(), bound: Bound::Nothing })
    }

    /// Where what the scene has calls for it.
    pub(super) fn on(label: &str, reason: String) -> Self {
        Self::new(label, Choice::Settled { is_on: true, reason, bound: Bound::Unknown })
    }

    /// Where the scene switches it.
    pub(super) fn switched(label: &str, is_on: bool, without: &str, bound: Bound) -> Self {
        let reason = if is_on { "it is switched on".to_owned() } else { format!("it is switched off: {without}") };
        Self::new(label, Choice::Settled { is_on, reason, bound })
    }

    /// The effect, once it is decided.
    pub(super) fn told(&self, row: &Row, is_on: bool) -> Effect {
        const UNKNOWN: &str = "; no bound is known";
        let is_absent = matches!(self.choice, Choice::Absent { .. });
        let (reason, bound) = match &self.choice {
            Choice::Absent { reason } => (reason.clone(), Bound::Nothing),
            Choice::Settled { reason, bound, .. } => (reason.clone(), *bound),
            Choice::Open { bound: Bound::Unknown, on, .. } => (on.clone() + UNKNOWN, Bound::Unknown),
            Choice::Open { bound, on, off } => (if is_on { on.clone() } else { off.clone() }, *bound),
        };
        let name = if is_absent { row.kind.word().to_owned() } else { row.kind.name(&self.label) };
        let is_lacking = is_on && self.is_missing;
        let kind = Some(row.kind);
        let label = self.label.clone();
        Effect { name, kind, label, what: row.what, called_for: is_on, reason, bound, is_lacking, is_absent }
    }
}

/// What was decided about the effects of a kind.
#[derive(Debug)]
pub(super) struct Spent {
    /// Whether each of them is on.
    pub(super) is_on: Vec<bool>,
    /// Sum of the bounds of those that are left out.
    pub(super) bound: f64,
}

/// Effects that stay or go together.
struct Bundle {
    members: Vec<usize>,
    bound: f64,
    is_open: bool,
}

/// Decides about all effects of a kind: those that are left out change no displayed pixel by more than `allowance` together. The least bounds go
/// first; equal ones go together or not at all, so that the order of a file decides nothing.
pub(super) fn spend(candidates: &[Candidate], allowance: f64) -> Spent {
    let mut is_on = vec![true; candidates.len()];
    let mut bundles: Vec<(Option<usize>, Bundle)> = Vec::new();
    for (place, candidate) in candidates.iter().enumerate() {
        let open = match &candidate.choice {
            Choice::Absent { .. } => {
                is_on[place] = false;
                continue;
            }
            Choice::Settled { is_on: settled, .. } => {
                is_on[place] = *settled;
                // What is off has no part in its group.
                if !settled {
                    continue;
                }
                None
            }
            Choice::Open { bound, .. } => bound.number(),
        };
        let known = bundles.iter_mut().find(|(group, _)| group.is_some() && *group == candidate.group);
        let bundle = match known {
            Some((_, bundle)) => bundle,
            None => {
                bundles.push((candidate.group, Bundle { members: Vec::new(), bound: 0.0, is_open: true }));
                &mut bundles.last_mut().expect("invariant: one was added").1
            }
        };
        bundle.members.push(place);
        bundle.bound += open.unwrap_or(0.0);
        bundle.is_open &= open.is_some();
    }
    let mut open: Vec<Bundle> = bundles.into_iter().map(|(_, bundle)| bundle).filter(|bundle| bundle.is_open).collect();
    open.sort_by(|a, b| a.bound.total_cmp(&b.bound));
    let mut spent = 0.0;
    for equal in open.chunk_by(|a, b| a.bound == b.bound) {
        let bound: f64 = equal.iter().map(|bundle| bundle.bound).sum();
        if spent + bound > allowance {
            break;
        }
        spent += bound;
        equal.iter().flat_map(|bundle| &bundle.members).for_each(|place| is_on[*place] = false);
    }
    Spent { is_on, bound: spent }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(bound: f64, group: Option<usize>) -> Candidate {
        let choice = Choice::Open { bound: Bound::at_most(bound), on: String::new(), off: String::new() };
        Candidate { group, ..Candidate::new("", choice) }
    }

    #[test]
    fn the_least_bounds_go_first_and_equal_ones_together() {
        let spent = spend(&[open(0.3, None), open(0.1, None), open(0.3, None)], 0.5);
        assert_eq!((spent.is_on, spent.bound), (vec![true, false, true], 0.1));
    }

    #[test]
    fn a_group_goes_as_a_whole_and_stays_where_one_of_it_does() {
        assert_eq!(spend(&[open(0.3, Some(1)), open(0.1, Some(1)), open(0.2, None)], 0.5).is_on, [true, true, false]);
        assert_eq!(spend(&[open(0.3, Some(1)), open(0.1, Some(1))], 0.5).is_on, [false, false]);
        let forced = Candidate { group: Some(1), ..Candidate::switched("", true, "", Bound::Nothing) };
        assert_eq!(spend(&[open(0.1, Some(1)), forced], 0.5).is_on, [true, true]);
    }

    #[test]
    fn what_has_no_bound_stays() {
        let choice = Choice::Open { bound: Bound::Unknown, on: String::new(), off: String::new() };
        assert_eq!(spend(&[Candidate::new("", choice)], 1.0).is_on, [true]);
    }
}
