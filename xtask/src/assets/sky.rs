//! A sky by formula, as a Radiance HDR image: nobody's photograph, so nobody's terms.
//!
//! Radiance by the direction (x, y, z), y up: a dome that brightens from the zenith to the horizon, a glow and a disc of the sun, a ground
//! that fades into the haze of the horizon. It imitates no measured sky.

/// Width and height, pixels.
const SIZE: [usize; 2] = [256, 128];
/// Towards the sun, a unit vector.
const SUN: [f64; 3] = [0.48, 0.6, 0.64];
/// Cosine of the angle that the sun's disc fills, 2 degrees, and its radiance.
const RIM: f64 = 0.999_39;
const DISC: [f64; 3] = [1900.0, 1700.0, 1400.0];

/// The file's bytes.
pub(super) fn hdr() -> Vec<u8> {
    let [width, height] = SIZE;
    let mut out = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for y in 0..height {
        let row: Vec<[u8; 4]> = (0..width).map(|x| packed(radiance(direction(x, y)))).collect();
        out.extend([2, 2, (width >> 8) as u8, (width & 255) as u8]);
        (0..4).for_each(|channel| pack(&row.iter().map(|pixel| pixel[channel]).collect::<Vec<u8>>(), &mut out));
    }
    out
}

/// The middle of a pixel: rows from +Y down, each from −Z over +X.
fn direction(x: usize, y: usize) -> [f64; 3] {
    let polar = std::f64::consts::PI * (y as f64 + 0.5) / SIZE[1] as f64;
    let turn = std::f64::consts::TAU * (x as f64 + 0.5) / SIZE[0] as f64;
    [turn.sin() * polar.sin(), polar.cos(), -turn.cos() * polar.sin()]
}

fn radiance(d: [f64; 3]) -> [f64; 3] {
    let toward = (0..3).map(|c| d[c] * SUN[c]).sum::<f64>();
    if toward > RIM {
        return DISC;
    }
    let mix = |a: [f64; 3], b: [f64; 3], t: f64| -> [f64; 3] { std::array::from_fn(|c| a[c] + t * (b[c] - a[c])) };
    let horizon = [0.75, 0.85, 0.95];
    if d[1] < 0.0 {
        return mix(horizon, [0.16, 0.14, 0.11], (-12.0 * d[1]).min(1.0));
    }
    let dome = mix(horizon, [0.16, 0.33, 0.8], 1.0 - (1.0 - d[1]).powi(4));
    let glow = toward.max(0.0).powi(64);
    std::array::from_fn(|c| dome[c] + glow * [2.0, 1.6, 1.1][c])
}

/// Three mantissas with the exponent of the largest, 2^(e − 136).
fn packed(radiance: [f64; 3]) -> [u8; 4] {
    let largest = radiance.iter().fold(0.0f64, |most, v| most.max(*v));
    let mut e = 1;
    let unit = |e: i32| 2.0f64.powi(e - 136);
    while largest / unit(e) >= 255.5 {
        e += 1;
    }
    let [r, g, b] = radiance.map(|v| (v / unit(e)).round() as u8);
    [r, g, b, e as u8]
}

/// One channel of a scanline: runs of at least four, and what lies between them.
fn pack(values: &[u8], out: &mut Vec<u8>) {
    let run = |at: usize| values[at..].iter().take(127).take_while(|v| **v == values[at]).count();
    let mut at = 0;
    while at < values.len() {
        let same = run(at);
        if same >= 4 {
            out.extend([128 + same as u8, values[at]]);
            at += same;
            continue;
        }
        let end = (at + 1..values.len().min(at + 128)).find(|k| run(*k) >= 4).unwrap_or(values.len().min(at + 128));
        out.push((end - at) as u8);
        out.extend(&values[at..end]);
        at = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_file_is_what_the_formula_gives() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/environment/sky.hdr");
        assert!(std::fs::read(path).expect("an asset of the repository") == hdr(), "cargo xtask assets sky writes it");
    }
}
