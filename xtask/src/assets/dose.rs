//! A dose in a head by formula: NRRD, raw, whole centigray.

/// Lattice points along each axis, their distance, and the first of them, mm.
const DIMS: [i32; 3] = [26, 30, 25];
const STEP: f64 = 8.0;
const FIRST: [f64; 3] = [-100.0, -138.0, -76.0];
/// Where the beams meet, mm, and where each comes from.
const MEET: [f64; 3] = [30.0, -20.0, 30.0];
const BEAMS: [[f64; 3]; 3] = [[1.0, 0.15, 0.45], [0.25, 1.0, 0.3], [0.35, -0.4, 1.0]];

/// The file.
pub(super) fn nrrd() -> Vec<u8> {
    let [x, y, z] = DIMS;
    let mut file = format!(
        "NRRD0004\n# Dose of three beams by formula, centigray; made for Organza, see CREDITS.md.\ntype: short\n\
         dimension: 3\nspace: right-anterior-superior\nsizes: {x} {y} {z}\nspace directions: (8,0,0) (0,8,0) (0,0,8)\n\
         space origin: (-100,-138,-76)\nendian: little\nencoding: raw\n\n"
    )
    .into_bytes();
    let places = (0..x * y * z).map(|i| [i % x, i / x % y, i / x / y]);
    file.extend(places.flat_map(|at| (dose(at).round() as i16).to_le_bytes()));
    file
}

/// Each beam is as wide as a Gaussian of 15 mm, and is taken up on its way.
fn dose(at: [i32; 3]) -> f64 {
    let from_middle: [f64; 3] = std::array::from_fn(|a| FIRST[a] + STEP * f64::from(at[a]) - MEET[a]);
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let beam = |from: [f64; 3]| {
        let along = dot(from, from_middle) / dot(from, from).sqrt();
        let aside_sq = dot(from_middle, from_middle) - along * along;
        2200.0 * (0.004 * along - aside_sq / 450.0).exp()
    };
    BEAMS.into_iter().map(beam).sum()
}
