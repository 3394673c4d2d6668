//! Points of a hill as a scanner sweeps it: lines that lie three times as far apart as the points along them, by formula.

use std::fmt::Write as _;

/// Lines, and points of each.
const COUNT: [i32; 2] = [36, 90];
/// Distance of lines, and of points along them.
const STEP: [f64; 2] = [0.066, 0.022];

/// The text of the file: places, y up, bands of five points along each line, and the share of a shadow that each point receives, none at the first
/// line and all at the last.
pub(super) fn csv() -> String {
    let mut text = "x,y,z,band,shadow_coefficient\n".to_owned();
    for (i, j) in (0..COUNT[0]).flat_map(|i| (0..COUNT[1]).map(move |j| (i, j))) {
        let at = |k: i32, axis: usize| (f64::from(k) - 0.5 * f64::from(COUNT[axis] - 1)) * STEP[axis];
        let x = at(i, 0);
        let z = at(j, 1);
        let hill = 0.42 * (-3.0 * (x * x + z * z)).exp() + 0.05 * (5.0 * x).sin() * (6.0 * z).cos();
        let share = f64::from(i) / f64::from(COUNT[0] - 1);
        let _ = writeln!(text, "{x:.3},{hill:.4},{z:.3},{},{share:.3}", j / 5 % 2);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_in_the_assets_is_this_one() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/points/lines.csv");
        assert_eq!(std::fs::read_to_string(path).expect("an asset"), csv());
    }
}
