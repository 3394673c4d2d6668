//! How much each key of a track counts at a time between two of them.

use crate::animation::raw::Blend;

/// The first key that counts at a frame, which may be between two, and the weights of it and of those after it; `frames` increase.
pub(crate) fn weights(frames: &[f64], frame: f64, blend: Blend) -> (usize, Vec<f64>) {
    let after = frames.partition_point(|f| *f <= frame);
    if after == 0 || after == frames.len() || frames[after - 1] == frame {
        return (after.saturating_sub(1), vec![1.0]);
    }
    let a = after - 1;
    let b = after;
    let length = frames[b] - frames[a];
    let t = (frame - frames[a]) / length;
    if blend == Blend::Linear {
        return (a, vec![1.0 - t, t]);
    }
    // The cubic with these values and slopes at both ends; slopes are differences of the keys around.
    let first = a.saturating_sub(1);
    let mut weights = vec![0.0; (b + 2).min(frames.len()) - first];
    let t2 = t * t;
    let t3 = t * t * t;
    weights[a - first] += 2.0 * t3 - 3.0 * t2 + 1.0;
    weights[b - first] += 3.0 * t2 - 2.0 * t3;
    for (key, basis) in [(a, t3 - 2.0 * t2 + t), (b, t3 - t2)] {
        let low = key.saturating_sub(1);
        let high = (key + 1).min(frames.len() - 1);
        let slope = basis * length / (frames[high] - frames[low]);
        weights[high - first] += slope;
        weights[low - first] -= slope;
    }
    (first, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(frames: &[f64], values: &[f64], frame: f64, blend: Blend) -> f64 {
        let (first, weights) = weights(frames, frame, blend);
        weights.iter().zip(&values[first..]).map(|(w, v)| w * v).sum()
    }

    #[test]
    fn both_blends_pass_the_keys_and_hold_outside() {
        let frames = [2.0, 5.0, 6.0, 20.0];
        let values = [1.0, -3.0, 8.0, 4.0];
        for blend in [Blend::Linear, Blend::Smooth] {
            for (f, v) in frames.iter().zip(values) {
                assert_eq!(at(&frames, &values, *f, blend), v);
            }
            assert_eq!([at(&frames, &values, 0.0, blend), at(&frames, &values, 99.0, blend)], [1.0, 4.0]);
            assert_eq!(at(&[7.0], &[3.0], 1.0, blend), 3.0);
        }
        assert_eq!(at(&frames, &values, 3.0, Blend::Linear), 1.0 - 4.0 / 3.0);
    }

    #[test]
    fn smooth_follows_a_line_exactly_and_has_no_corners() {
        let frames = [0.0, 10.0, 15.0, 40.0];
        let line = frames.map(|f| 3.0 * f - 7.0);
        for f in 0..=40 {
            assert!((at(&frames, &line, f.into(), Blend::Smooth) - (3.0 * f64::from(f) - 7.0)).abs() < 1e-12);
        }
        let values = [0.0, 5.0, -2.0, 1.0];
        for key in [10.0, 15.0] {
            let slope = |side: f64| {
                (at(&frames, &values, key + side, Blend::Smooth) - at(&frames, &values, key, Blend::Smooth)) / side
            };
            assert!((slope(1e-6) - slope(-1e-6)).abs() < 1e-4, "{key}");
        }
    }
}
