//! Depths at which kinds of things that are composited in turns change places.

use std::ops::Range;

/// Most cuts, in times of what is asked for: beyond it depths are cut evenly.
const MOST: usize = 4;

/// Which kinds are somewhere, a bit each.
type Present = u32;

/// Depths, rising, that part things of up to 32 `kinds` so that these can be composited in turns: each span of depths has a kind, from 0.
/// Where one kind is alone it is not cut; where several lie at the same depths these are cut into `pieces` intervals, all together.
///
/// ```
/// // Fog from 0 to 10, with a pane of another kind in it.
/// assert_eq!(splat_core::turns(&[(0, [0.0, 10.0]), (1, [4.0, 4.5])], 2, 1), [4.0, 4.5]);
/// ```
pub fn turns(spans: &[(usize, [f32; 2])], kinds: usize, pieces: usize) -> Vec<f32> {
    let cuts = cuts(&stretches(spans, kinds), pieces);
    match cuts[..] {
        [near, .., far] if cuts.len() > MOST * pieces => {
            (0..=pieces).map(|k| near + (far - near) * (k as f32 / pieces as f32)).collect()
        }
        _ => cuts,
    }
}

/// Stretches of depth, near to far, in which the same kinds are present; those where none is are left out.
fn stretches(spans: &[(usize, [f32; 2])], kinds: usize) -> Vec<(Range<f32>, Present)> {
    let mut events: Vec<(f32, usize, i64)> =
        spans.iter().flat_map(|(t, [near, far])| [(*near, *t, 1), (*far, *t, -1)]).collect();
    events.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut open = vec![0i64; kinds];
    let mut stretches: Vec<(Range<f32>, Present)> = Vec::new();
    for (k, (depth, kind, change)) in events.iter().enumerate() {
        open[*kind] += change;
        let present = open.iter().enumerate().fold(0, |bits, (t, n)| bits | Present::from(*n > 0) << t);
        let Some((next, ..)) = events.get(k + 1) else { break };
        if present == 0 || next <= depth {
            continue;
        }
        match stretches.last_mut() {
            Some((range, same)) if *same == present && range.end == *depth => range.end = *next,
            _ => stretches.push((*depth..*next, present)),
        }
    }
    stretches
}

/// Depths at which kinds change, and those between that cut what several share into `pieces` intervals, all together.
fn cuts(stretches: &[(Range<f32>, Present)], pieces: usize) -> Vec<f32> {
    let is_shared = |present: Present| present.count_ones() > 1;
    let length = |range: &Range<f32>| range.end - range.start;
    let shared: f32 = stretches.iter().filter(|s| is_shared(s.1)).map(|s| length(&s.0)).sum();
    let step = shared / pieces as f32;
    let mut cuts: Vec<f32> = Vec::new();
    let mut last = None;
    for (range, present) in stretches {
        if last.is_some_and(|last| last != *present) || is_shared(*present) {
            cuts.push(range.start);
        }
        if is_shared(*present) {
            let parts = (length(range) / step).ceil().max(1.0);
            cuts.extend((1..parts as usize).map(|k| range.start + length(range) * (k as f32 / parts)));
            cuts.push(range.end);
        }
        last = Some(*present);
    }
    cuts.dedup();
    cuts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_that_lie_apart_are_cut_once() {
        let apart = stretches(&[(0, [1.0, 2.0]), (0, [1.5, 3.0]), (1, [4.0, 5.0]), (0, [6.0, 7.0])], 2);
        assert_eq!(apart, [(1.0..3.0, 1), (4.0..5.0, 2), (6.0..7.0, 1)]);
        assert_eq!(cuts(&apart, 16), [4.0, 6.0]);
    }

    #[test]
    fn what_kinds_share_is_cut_into_as_many_parts() {
        let shared = stretches(&[(0, [0.0, 10.0]), (1, [4.0, 8.0])], 2);
        assert_eq!(shared, [(0.0..4.0, 1), (4.0..8.0, 3), (8.0..10.0, 1)]);
        assert_eq!(cuts(&shared, 4), [4.0, 5.0, 6.0, 7.0, 8.0]);
        // A pane across the view is thinner than a range.
        let pane = stretches(&[(0, [0.0, 10.0]), (1, [4.0, 4.001])], 2);
        assert_eq!(cuts(&pane, 1), [4.0, 4.001]);
    }
}
