//! The frontier: settings that nothing more accurate comes near in time.
//!
//! Settings are visited from the most accurate on. A setting is on the frontier if it is faster than the last setting there, by
//! more than the uncertainty of times. Errors that agree to two digits count as equal, and so do errors of random settings that
//! differ by no more than their noise. Errors within the limit's uncertainty count as 0, the most accurate. The first setting in
//! the report's order represents all that are nearly as fast; so the scene's setting represents knobs that change nothing.
//!
//! A setting's time is the least of its repeats: other work of the machine adds to a repeat and never takes from it. Errors
//! are the same in every run, so a frontier changes with the times alone. The settings that decide it are repeated until it
//! has held for some rounds.

/// Ratio of times that counts as different.
pub const TOLD_APART: f64 = 1.1;

/// Ratio of times within which more repeats may change which is the faster. What is slower than something more accurate by
/// this is not repeated; what is slower than the fastest of equal errors by this does not stand for them.
const NEAR: f64 = 1.25;

/// A setting that may be on the frontier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// The caller's identifier of the setting.
    pub id: usize,
    /// Its error, at least 0.
    pub error: f64,
    /// Half of the 95 % interval of the error; 0 of what is not random.
    pub half_width: f64,
    /// Least of its times, seconds.
    pub seconds: f64,
}

/// Ids of the frontier, from the most accurate to the fastest.
pub fn frontier(candidates: &[Candidate]) -> Vec<usize> {
    let mut last = f64::INFINITY;
    let mut on_it = Vec::new();
    for equal in alike(&sorted(candidates)) {
        let fastest = equal.iter().map(|c| c.seconds).fold(f64::INFINITY, f64::min);
        if fastest * TOLD_APART < last || on_it.is_empty() {
            last = fastest;
            on_it.extend(equal.iter().filter(|c| c.seconds <= fastest * NEAR).map(|c| c.id).min());
        }
    }
    on_it
}

/// Runs of candidates whose errors cannot be told from that of the first of their run, of a list by rising error.
fn alike(sorted: &[Candidate]) -> Vec<&[Candidate]> {
    let mut runs = Vec::new();
    let mut rest = sorted;
    while let Some(first) = rest.first() {
        let length = rest.iter().take_while(|candidate| is_equal(first, candidate)).count();
        let (run, behind) = rest.split_at(length);
        runs.push(run);
        rest = behind;
    }
    runs
}

/// Whether two errors are equal to two digits, or differ by less than the 95 % interval of their difference.
fn is_equal(a: &Candidate, b: &Candidate) -> bool {
    two_digits(a.error) == two_digits(b.error) || (a.error - b.error).abs() < a.half_width.hypot(b.half_width)
}

/// Exponent and two digits of an error; those of 0 are below all others.
fn two_digits(error: f64) -> (i32, i64) {
    if error == 0.0 {
        return (i32::MIN, 0);
    }
    let exponent = error.log10().floor() as i32;
    (exponent, (error / 10f64.powi(exponent - 1)).round() as i64)
}

/// The rule that ends the repeats of the frontier's settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Hold {
    /// Rounds for which it has to stay the same.
    pub calm: usize,
    /// Most rounds.
    pub most: usize,
}

/// Repeats the settings that may be on the frontier, one round after the other, until it has held.
///
/// `again` draws the setting of an id once more and gives the seconds that took.
///
/// # Errors
/// Those of `again`.
pub fn hold<E>(
    candidates: &mut [Candidate],
    rounds: Hold,
    mut again: impl FnMut(usize) -> Result<f64, E>,
) -> Result<Vec<usize>, E> {
    let mut on_it = frontier(candidates);
    let mut calm = 0;
    for _ in 0..rounds.most {
        if calm == rounds.calm || on_it.is_empty() {
            break;
        }
        for id in contenders(candidates) {
            let seconds = again(id)?;
            candidates.iter_mut().filter(|c| c.id == id).for_each(|c| c.seconds = c.seconds.min(seconds));
        }
        let now = frontier(candidates);
        calm = if now == on_it { calm + 1 } else { 0 };
        on_it = now;
    }
    Ok(on_it)
}

/// Ids of those that something more accurate is not faster than by far.
fn contenders(candidates: &[Candidate]) -> Vec<usize> {
    let mut fastest = f64::INFINITY;
    let mut ids = Vec::new();
    for c in sorted(candidates) {
        if c.seconds < NEAR * fastest {
            ids.push(c.id);
        }
        fastest = fastest.min(c.seconds);
    }
    ids
}

fn sorted(candidates: &[Candidate]) -> Vec<Candidate> {
    let usable = candidates.iter().filter(|c| c.seconds > 0.0 && c.error >= 0.0 && c.error.is_finite());
    let mut sorted: Vec<Candidate> = usable.copied().collect();
    sorted.sort_by_key(|c| (two_digits(c.error), c.id));
    sorted
}

#[cfg(test)]
mod tests {
    use super::*;
    use splat_core::rng::unit;
    use std::convert::Infallible;

    fn candidate(id: usize, error: f64, seconds: f64) -> Candidate {
        Candidate { id, error, half_width: 0.0, seconds }
    }

    #[test]
    fn only_what_is_faster_than_all_that_is_better() {
        let candidates = [
            candidate(0, 1e-4, 10.0),
            candidate(1, 2e-4, 9.5),
            candidate(2, 1e-3, 4.0),
            candidate(3, 2e-3, 5.0),
            candidate(4, 1e-2, 1.0),
        ];
        assert_eq!(frontier(&candidates), [0, 2, 4]);
        assert_eq!(contenders(&candidates), [0, 1, 2, 4], "5 s are hopeless beside 4 s, 9.5 s beside 10 s are not");
        assert_eq!(frontier(&[]), [0usize; 0]);
        assert_eq!(frontier(&[candidate(1, 1e-4, 2.0), candidate(7, 0.0, 1.0)]), [7], "exact and faster");
        assert_eq!(frontier(&[candidate(1, 1e-4, 0.5), candidate(7, 0.0, 1.0), candidate(8, 0.0, 0.9)]), [7, 1]);
        assert_eq!(frontier(&[candidate(7, f64::NAN, 1.0)]), [0usize; 0]);
    }

    #[test]
    fn of_equal_errors_the_first_stands_for_those_nearly_as_fast() {
        let slow = candidate(0, 1e-4, 10.0);
        let equal = [candidate(1, 2.01e-3, 5.2), candidate(2, 2.04e-3, 5.0), candidate(3, 1.98e-3, 4.9)];
        assert_eq!(frontier(&[slow, equal[0], equal[1], equal[2]]), [0, 1]);
        assert_eq!(frontier(&[slow, candidate(1, 2.01e-3, 6.5), equal[1], equal[2]]), [0, 2]);
        // What follows has to be faster than the fastest of them.
        assert_eq!(frontier(&[slow, equal[0], equal[2], candidate(4, 1e-2, 4.5)]), [0, 1]);
        assert_eq!([9.94e-3, 9.96e-3, 0.01, 1.0].map(two_digits), [(-3, 99), (-3, 100), (-2, 10), (0, 10)]);
    }

    #[test]
    fn errors_that_differ_by_their_noise_count_as_one() {
        let noisy = |id, error, seconds| Candidate { half_width: 2e-4, ..candidate(id, error, seconds) };
        let candidates = [noisy(0, 2.61e-3, 5.0), noisy(1, 2.4e-3, 9.0), noisy(2, 2.53e-3, 1.0)];
        assert_eq!(frontier(&candidates), [2], "2.4, 2.53 and 2.61 are equal, and the third takes a fifth of the time");
        // 2.75e-3 is 3.5e-4 from the most accurate, whose difference is known within 2.8e-4.
        let [first, second, third] = candidates;
        assert_eq!(frontier(&[first, second, third, noisy(3, 2.75e-3, 0.5)]), [2, 3]);
        // The same errors without noise differ.
        let exact = candidates.map(|c| Candidate { half_width: 0.0, ..c });
        assert_eq!(frontier(&exact), [1, 2]);
    }

    #[test]
    fn repeats_end_when_the_frontier_held() {
        let candidates = || vec![candidate(0, 1e-4, 2.0), candidate(1, 1e-3, 1.9), candidate(2, 1e-2, 3.0)];
        let rounds = Hold { calm: 3, most: 9 };
        let mut calls = Vec::new();
        let same = hold(&mut candidates(), rounds, |id| {
            calls.push(id);
            Ok::<_, Infallible>(2.0)
        });
        assert_eq!((same, calls), (Ok(vec![0]), vec![0, 1, 0, 1, 0, 1]), "the third is hopeless");
        // A time that was disturbed is found out, and the count begins anew.
        let mut round = 0;
        let found = hold(&mut candidates(), rounds, |id| {
            round += usize::from(id == 0);
            Ok::<_, Infallible>(if id == 1 && round == 2 { 1.0 } else { 2.0 })
        });
        assert_eq!((found, round), (Ok(vec![0, 1]), 5));
        assert_eq!(hold(&mut [], rounds, |_| Ok::<_, Infallible>(1.0)), Ok(vec![]));
    }

    /// One repeat of one of forty settings like those of a report: many near one time (their knob is cheap), the rest spread
    /// over a decade. A third of the repeats is disturbed.
    fn seconds(run: u64, id: usize, repeat: u64) -> f64 {
        let undisturbed = if id.is_multiple_of(2) { 1.0 } else { 10f64.powf(-0.5 + unit(11, 0, id as u64, 1)) };
        let u = |k| unit(run, repeat, id as u64, k);
        let disturbed = if u(0) < 0.33 { 1.0 + 0.35 * u(1) } else { 1.0 };
        undisturbed * disturbed * (1.0 + 0.04 * u(2))
    }

    fn rerun(run: u64) -> Vec<usize> {
        let least = |id| (0..5).map(|r| seconds(run, id, r)).fold(f64::INFINITY, f64::min);
        let error = |id| 10f64.powf(-4.0 + 2.5 * unit(11, 0, id as u64, 0));
        let mut candidates: Vec<_> = (0..40).map(|id| candidate(id, error(id), least(id))).collect();
        let mut repeat = 5;
        let again = |id| {
            repeat += 1;
            Ok::<_, Infallible>(seconds(run, id, repeat))
        };
        hold(&mut candidates, Hold { calm: 8, most: 20 }, again).unwrap()
    }

    #[test]
    fn a_rerun_gives_the_same_frontier_in_nine_of_ten_points() {
        let mut same = 0;
        let mut total = 0;
        let mut thin = usize::MAX;
        for pair in 0..100 {
            let a = rerun(2 * pair);
            let b = rerun(2 * pair + 1);
            same += a.iter().filter(|id| b.contains(id)).count();
            total += a.len().max(b.len());
            thin = thin.min(a.len());
        }
        assert!(same as f64 >= 0.9 * f64::from(total as u32), "{same} of {total}");
        assert!(thin >= 2, "a frontier of {thin} points proves nothing");
    }
}
