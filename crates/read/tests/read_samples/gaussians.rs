//! Small files of 3D Gaussians of every kind, written from the same numbers, and how far what is read of them may be off.

use super::load;
use read::Loaded;
use splat_core::RawPoints;
use splat_core::glam::{DMat3, DQuat};
use std::f64::consts::SQRT_2;

/// The constant of the harmonic of degree 0.
pub(crate) const CONSTANT: f64 = 0.282_094_791_773_878_14;

/// One Gaussian as its trainer has it.
#[derive(Debug, Clone)]
pub(crate) struct Trained {
    pub(crate) position: [f64; 3],
    /// Natural logarithms of deviations.
    pub(crate) scale: [f64; 3],
    /// Unit quaternion, w first, w ≥ 0.
    pub(crate) rotation: [f64; 4],
    pub(crate) opacity: f64,
    /// The constant first.
    pub(crate) harmonics: Vec<[f64; 3]>,
}

/// Gaussian `i` of a degree; numbers that look like chance.
pub(crate) fn trained(i: usize, degree: usize) -> Trained {
    let number = |k: usize| ((i * 7919 + k * 104_729) % 1009) as f64 / 1009.0;
    let raw = [1.0, 2.0, 3.0, 4.0].map(|k| number(k as usize + 20) - 0.5);
    let length = raw.iter().map(|v| v * v).sum::<f64>().sqrt() * if raw[0] < 0.0 { -1.0 } else { 1.0 };
    Trained {
        position: [0, 1, 2].map(|k| 8.0 * number(k) - 4.0),
        scale: [3, 4, 5].map(|k| -4.0 + 3.0 * number(k)),
        rotation: raw.map(|v| v / length),
        opacity: 0.1 + 0.8 * number(6),
        harmonics: (0..(degree + 1).pow(2)).map(|k| [30, 31, 32].map(|c| number(c + 3 * k) - 0.5)).collect(),
    }
}

/// Properties of a trained file.
fn names(degree: usize) -> Vec<String> {
    let rest = 3 * ((degree + 1).pow(2) - 1);
    let fixed = "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2".split(' ').map(str::to_owned);
    let last = "opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split(' ').map(str::to_owned);
    fixed.chain((0..rest).map(|k| format!("f_rest_{k}"))).chain(last).collect()
}

fn numbers(t: &Trained) -> Vec<f64> {
    let logit = (t.opacity / (1.0 - t.opacity)).ln();
    let rest = (0..3).flat_map(|c| t.harmonics[1..].iter().map(move |h| h[c]));
    let mut numbers = [&t.position[..], &[0.0; 3], &t.harmonics[0]].concat();
    numbers.extend(rest);
    numbers.push(logit);
    numbers.extend(t.scale.iter().chain(&t.rotation));
    numbers
}

/// As the trainer writes it: `encoding` is `ascii` or `binary_little_endian`.
pub(crate) fn trained_ply(gaussians: &[Trained], degree: usize, encoding: &str) -> Vec<u8> {
    let mut text = format!("ply\nformat {encoding} 1.0\nelement vertex {}\n", gaussians.len());
    names(degree).iter().for_each(|name| text += &format!("property float {name}\n"));
    let mut out = (text + "end_header\n").into_bytes();
    for t in gaussians {
        let numbers = numbers(t);
        if encoding == "ascii" {
            let line: Vec<String> = numbers.iter().map(|v| (*v as f32).to_string()).collect();
            out.extend((line.join(" ") + "\n").into_bytes());
        } else {
            numbers.iter().for_each(|v| out.extend((*v as f32).to_le_bytes()));
        }
    }
    out
}

fn whole(share: f64, bits: u32) -> u32 {
    let most = f64::from((1u32 << bits) - 1);
    (share * most).round().clamp(0.0, most) as u32
}

fn range(gaussians: &[Trained], numbers: impl Fn(&Trained) -> [f64; 3]) -> [[f64; 3]; 2] {
    gaussians.iter().map(numbers).fold([[f64::MAX; 3], [f64::MIN; 3]], |[low, high], v| {
        [[0, 1, 2].map(|k| low[k].min(v[k])), [0, 1, 2].map(|k| high[k].max(v[k]))]
    })
}

fn shares(v: [f64; 3], [low, high]: [[f64; 3]; 2]) -> [f64; 3] {
    [0, 1, 2].map(|k| if high[k] > low[k] { (v[k] - low[k]) / (high[k] - low[k]) } else { 0.0 })
}

fn triple(v: [f64; 3]) -> u32 {
    whole(v[0], 11) << 21 | whole(v[1], 10) << 11 | whole(v[2], 11)
}

pub(crate) fn largest(rotation: &[f64; 4]) -> usize {
    (0..4).max_by(|a, b| rotation[*a].abs().total_cmp(&rotation[*b].abs())).unwrap()
}

/// As PlayCanvas packs it, with bounds of colours and an element of other coefficients where the degree has some.
pub(crate) fn packed_ply(gaussians: &[Trained], degree: usize) -> Vec<u8> {
    let bounds = ["x", "y", "z", "scale_x", "scale_y", "scale_z", "r", "g", "b"];
    let chunk = bounds.chunks(3).flat_map(|axes| ["min", "max"].map(|end| (end, axes)));
    let chunk: Vec<String> = chunk.flat_map(|(end, axes)| axes.iter().map(move |a| format!("{end}_{a}"))).collect();
    let mut text = format!("ply\nformat binary_little_endian 1.0\nelement chunk {}\n", gaussians.len().div_ceil(256));
    chunk.iter().for_each(|name| text += &format!("property float {name}\n"));
    text += &format!("element vertex {}\n", gaussians.len());
    ["position", "rotation", "scale", "color"].iter().for_each(|n| text += &format!("property uint packed_{n}\n"));
    let rest = 3 * ((degree + 1).pow(2) - 1);
    if rest > 0 {
        text += &format!("element sh {}\n", gaussians.len());
        (0..rest).for_each(|k| text += &format!("property uchar f_rest_{k}\n"));
    }
    let mut out = (text + "end_header\n").into_bytes();
    let color = |t: &Trained| t.harmonics[0].map(|c| 0.5 + CONSTANT * c);
    let ranges = |part: &[Trained]| [range(part, |t| t.position), range(part, |t| t.scale), range(part, color)];
    for part in gaussians.chunks(256) {
        for v in ranges(part).as_flattened().as_flattened() {
            out.extend((*v as f32).to_le_bytes());
        }
    }
    for part in gaussians.chunks(256) {
        let [place, scale, colors] = ranges(part);
        for t in part {
            let k = largest(&t.rotation);
            let sign = t.rotation[k].signum();
            let turn = (0..4)
                .filter(|j| *j != k)
                .fold(k as u32, |word, j| word << 10 | whole(t.rotation[j] * sign / SQRT_2 + 0.5, 10));
            let [r, g, b] = shares(color(t), colors).map(|c| whole(c, 8));
            let color = r << 24 | g << 16 | b << 8 | whole(t.opacity, 8);
            let words = [triple(shares(t.position, place)), turn, triple(shares(t.scale, scale)), color];
            words.iter().for_each(|word| out.extend(word.to_le_bytes()));
        }
    }
    for t in gaussians {
        let rest = (0..3).flat_map(|c| t.harmonics[1..].iter().map(move |h| h[c]));
        out.extend(rest.map(|v| ((v / 8.0 + 0.5) * 256.0).floor().clamp(0.0, 255.0) as u8));
    }
    out
}

fn byte(v: f64) -> u8 {
    v.round().clamp(0.0, 255.0) as u8
}

/// `.splat`, which keeps the constant alone.
pub(crate) fn splat(gaussians: &[Trained]) -> Vec<u8> {
    let mut out = Vec::new();
    for t in gaussians {
        t.position.iter().copied().chain(t.scale.map(f64::exp)).for_each(|v| out.extend((v as f32).to_le_bytes()));
        out.extend(t.harmonics[0].map(|c| byte(255.0 * (0.5 + CONSTANT * c))));
        out.push(byte(255.0 * t.opacity));
        out.extend(t.rotation.map(|v| byte(128.0 * v + 128.0)));
    }
    out
}

fn spz_header(gaussians: &[Trained], degree: usize, version: u32) -> Vec<u8> {
    let mut out = b"NGSP".to_vec();
    out.extend(version.to_le_bytes());
    out.extend((gaussians.len() as u32).to_le_bytes());
    out.extend([degree as u8, 12, 0, 0]);
    out
}

/// SPZ of version 1 to 3 before gzip, with 12 bits behind the point.
pub(crate) fn spz(gaussians: &[Trained], degree: usize, version: u32) -> Vec<u8> {
    let mut out = spz_header(gaussians, degree, version);
    spz_parts(gaussians, version).into_iter().for_each(|part| out.extend(part));
    out
}

/// SPZ of version 4, each part as one block that is packed by nothing but the form of Zstandard.
pub(crate) fn spz_4(gaussians: &[Trained], degree: usize) -> Vec<u8> {
    let mut out = spz_header(gaussians, degree, 4);
    let parts: Vec<Vec<u8>> = spz_parts(gaussians, 4).into_iter().filter(|part| !part.is_empty()).collect();
    out[15] = parts.len() as u8;
    out.extend(32u32.to_le_bytes());
    out.extend([0; 12]);
    let packed: Vec<Vec<u8>> = parts.iter().map(|part| zstd(part)).collect();
    for (part, packed) in parts.iter().zip(&packed) {
        out.extend((packed.len() as u64).to_le_bytes());
        out.extend((part.len() as u64).to_le_bytes());
    }
    packed.into_iter().for_each(|part| out.extend(part));
    out
}

/// A frame of Zstandard (RFC 8878) of one segment, whose size has four bytes, with one raw block, the last.
fn zstd(content: &[u8]) -> Vec<u8> {
    let mut out = vec![0x28, 0xb5, 0x2f, 0xfd, 0xa0];
    out.extend((content.len() as u32).to_le_bytes());
    out.extend(&((content.len() as u32) << 3 | 1).to_le_bytes()[..3]);
    out.extend(content);
    out
}

/// Places, opacities, colours, deviations, rotations and harmonics of SPZ.
fn spz_parts(gaussians: &[Trained], version: u32) -> [Vec<u8>; 6] {
    let mut places = Vec::new();
    for v in gaussians.iter().flat_map(|t| t.position) {
        match version {
            1 => places.extend(half::f16::from_f64(v).to_le_bytes()),
            _ => places.extend(&((v * 4096.0).round() as i32).to_le_bytes()[..3]),
        }
    }
    let opacities = gaussians.iter().map(|t| byte(255.0 * t.opacity)).collect();
    let colors = gaussians.iter().flat_map(|t| t.harmonics[0].map(|c| byte(255.0 * (0.15 * c + 0.5)))).collect();
    let scales = gaussians.iter().flat_map(|t| t.scale.map(|s| byte(16.0 * (s + 10.0)))).collect();
    let mut out = Vec::new();
    for t in gaussians {
        let [w, x, y, z] = t.rotation;
        if version <= 2 {
            out.extend([x, y, z].map(|v| byte(127.5 * (v + 1.0))));
            continue;
        }
        let xyzw = [x, y, z, w];
        let k = largest(&xyzw);
        let word = (0..4).filter(|j| *j != k).fold(k as u32, |word, j| {
            let v = xyzw[j] * xyzw[k].signum();
            word << 10 | u32::from(v < 0.0) << 9 | whole(v.abs() * SQRT_2, 9)
        });
        out.extend(word.to_le_bytes());
    }
    let others = gaussians.iter().flat_map(|t| t.harmonics[1..].as_flattened()).map(|v| byte(128.0 * v + 128.0));
    [places, opacities, colors, scales, out, others.collect()]
}

/// The points of a file that is right.
pub(crate) fn points(name: &str, content: &[u8]) -> RawPoints {
    match load(name, content).unwrap() {
        Loaded::Points(points) => points,
        other => panic!("{other:?}"),
    }
}

/// How far numbers may be off.
pub(crate) struct Steps {
    pub(crate) place: f64,
    /// Of the logarithm of a deviation.
    pub(crate) scale: f64,
    /// Of an axis of unit length.
    pub(crate) turn: f64,
    pub(crate) opacity: f64,
    pub(crate) constant: f64,
    pub(crate) others: f64,
}

pub(crate) const EXACT: Steps =
    Steps { place: 1e-6, scale: 1e-6, turn: 1e-6, opacity: 1e-6, constant: 1e-6, others: 1e-6 };

/// Compares what was read with what was written.
pub(crate) fn agree(name: &str, found: &RawPoints, written: &[Trained], degree: usize, steps: &Steps) {
    found.validate().unwrap();
    let g = &found.gaussians;
    assert_eq!((found.len(), usize::from(g.degree)), (written.len(), degree), "{name}");
    for (i, t) in written.iter().enumerate() {
        let near = |what: &str, a: f64, b: f64, step: f64| assert!((a - b).abs() <= step, "{name} {i} {what}: {a} {b}");
        let place = found.exact_position(i);
        (0..3).for_each(|k| near("place", place[k], t.position[k], steps.place));
        near("opacity", f64::from(g.opacity[i]), t.opacity, steps.opacity);
        let [w, x, y, z] = t.rotation;
        let turned = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w));
        for k in 0..3 {
            let axis = g.axes[i][k].as_dvec3();
            near("scale", axis.length().ln(), t.scale[k], steps.scale);
            near("turn", axis.normalize().distance(turned.col(k)), 0.0, steps.turn);
        }
        for (k, (found, given)) in g.harmonics[i * g.terms()..].iter().zip(&t.harmonics[..g.terms()]).enumerate() {
            let step = if k == 0 { steps.constant } else { steps.others };
            (0..3).for_each(|c| near(&format!("harmonic {k}"), f64::from(found[c]), given[c], step));
        }
    }
}
