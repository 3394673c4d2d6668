//! Small files of 3D Gaussians in the formats of the web: SOG, `.ksplat` and glTF, by the formulas of their documentation.

use super::gaussians::{CONSTANT, Trained, largest};
use super::glb;
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::f64::consts::SQRT_2;
use std::io::Write;

/// Gaussians of a row of images.
const WIDTH: usize = 4;

/// An archive whose files are stored as they are.
pub(crate) fn zip(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    archive(files, false)
}

/// An archive whose files are stored as they are, or packed by deflate.
pub(crate) fn archive(files: &[(String, Vec<u8>)], is_packed: bool) -> Vec<u8> {
    let mut out = Vec::new();
    let mut directory = Vec::new();
    for (name, content) in files {
        let mut sum = flate2::Crc::new();
        sum.update(content);
        let mut encoder = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::best());
        encoder.write_all(content).unwrap();
        let packed = encoder.finish().unwrap();
        let stored = if is_packed { &packed } else { content };
        let mut facts = vec![20, 0, 0, 0, if is_packed { 8 } else { 0 }, 0, 0, 0, 0x21, 0];
        facts.extend(sum.sum().to_le_bytes());
        facts.extend([stored.len() as u32, content.len() as u32].map(u32::to_le_bytes).as_flattened());
        facts.extend((name.len() as u16).to_le_bytes());
        facts.extend([0, 0]);
        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&facts);
        directory.extend([0; 10]);
        directory.extend((out.len() as u32).to_le_bytes());
        directory.extend(name.as_bytes());
        out.extend(b"PK\x03\x04");
        out.extend(&facts);
        out.extend(name.as_bytes());
        out.extend(stored);
    }
    let start = out.len() as u32;
    out.extend(&directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend([files.len() as u16; 2].map(u16::to_le_bytes).as_flattened());
    out.extend((directory.len() as u32).to_le_bytes());
    out.extend(start.to_le_bytes());
    out.extend([0, 0]);
    out
}

/// A WebP image without losses of pixels of four bytes.
pub(crate) fn webp(pixels: &[[u8; 4]], width: usize) -> Vec<u8> {
    let mut padded = pixels.to_vec();
    padded.resize(pixels.len().div_ceil(width) * width, [0, 0, 0, 255]);
    let mut out = Vec::new();
    let height = padded.len() / width;
    let encoder = WebPEncoder::new_lossless(&mut out);
    encoder.write_image(padded.as_flattened(), width as u32, height as u32, ExtendedColorType::Rgba8).unwrap();
    out
}

fn folded(v: f64) -> f64 {
    v.signum() * (1.0 + v.abs()).ln()
}

/// The byte of the nearest of 256 even steps between two numbers.
fn step(v: f64, low: f64, high: f64) -> u8 {
    (255.0 * (v - low) / (high - low)).round().clamp(0.0, 255.0) as u8
}

fn list(numbers: impl Iterator<Item = f64>) -> String {
    format!("[{}]", numbers.map(|v| format!("{v:?}")).collect::<Vec<_>>().join(","))
}

fn even(low: f64, high: f64) -> String {
    list((0..256).map(|k| low + (high - low) * f64::from(k) / 255.0))
}

/// The files of a scene of SOG of version 1 or 2.
pub(crate) fn sog_files(gaussians: &[Trained], degree: usize, version: u32) -> Vec<(String, Vec<u8>)> {
    let places = |k: usize| gaussians.iter().map(move |t| folded(t.position[k]));
    let low = [0, 1, 2].map(|k| places(k).fold(f64::MAX, f64::min));
    let high = [0, 1, 2].map(|k| places(k).fold(f64::MIN, f64::max));
    let whole = |t: &Trained, k: usize| {
        let range = high[k] - low[k];
        if range > 0.0 { (65535.0 * (folded(t.position[k]) - low[k]) / range).round() as u16 } else { 0 }
    };
    let part = |b: usize| -> Vec<[u8; 4]> {
        let pixel = |t: &Trained| {
            let [x, y, z] = [0, 1, 2].map(|k| whole(t, k).to_le_bytes()[b]);
            [x, y, z, 255]
        };
        gaussians.iter().map(pixel).collect()
    };
    let scales: Vec<[u8; 4]> = gaussians
        .iter()
        .map(|t| {
            let [x, y, z] = t.scale.map(|s| step(s, -4.0, -1.0));
            [x, y, z, 255]
        })
        .collect();
    let quats: Vec<[u8; 4]> = gaussians
        .iter()
        .map(|t| {
            let k = largest(&t.rotation);
            let sign = t.rotation[k].signum();
            let rest =
                (0..4).filter(|j| *j != k).map(|j| (255.0 * (0.5 + sign * t.rotation[j] / SQRT_2)).round() as u8);
            let rest: Vec<u8> = rest.collect();
            [rest[0], rest[1], rest[2], 252 + k as u8]
        })
        .collect();
    let logit = |o: f64| (o / (1.0 - o)).ln();
    let colors: Vec<[u8; 4]> = gaussians
        .iter()
        .map(|t| {
            let [r, g, b] = t.harmonics[0].map(|c| step(c, -0.5, 0.5));
            let opacity = if version == 1 { step(logit(t.opacity), -4.0, 4.0) } else { step(t.opacity, 0.0, 1.0) };
            [r, g, b, opacity]
        })
        .collect();
    let mut files = vec![
        ("means_l.webp", webp(&part(0), WIDTH)),
        ("means_u.webp", webp(&part(1), WIDTH)),
        ("scales.webp", webp(&scales, WIDTH)),
        ("quats.webp", webp(&quats, WIDTH)),
        ("sh0.webp", webp(&colors, WIDTH)),
    ];
    let others = (degree + 1).pow(2) - 1;
    let range = |name: &str, n: usize, low: f64, high: f64| match version {
        1 if n == 1 => format!("\"mins\":{low:?},\"maxs\":{high:?},"),
        1 if name == "sh0" => {
            format!("\"mins\":[{low:?},{low:?},{low:?},-4.0],\"maxs\":[{high:?},{high:?},{high:?},4.0],")
        }
        1 => format!("\"mins\":{},\"maxs\":{},", list([low; 3].into_iter()), list([high; 3].into_iter())),
        _ => format!("\"codebook\":{},", even(low, high)),
    };
    let mut more = String::new();
    if others > 0 {
        // A row of the palette for each Gaussian, the last first.
        let n = gaussians.len();
        let width = 64 * others;
        let mut palette = vec![[0, 0, 0, 255]; width * n.div_ceil(64)];
        let mut labels = Vec::new();
        for (i, t) in gaussians.iter().enumerate() {
            let row = n - 1 - i;
            let [low, high] = (row as u16).to_le_bytes();
            labels.push([low, high, 0, 255]);
            for (k, h) in t.harmonics[1..].iter().enumerate() {
                let [r, g, b] = h.map(|c| step(c, -0.5, 0.5));
                palette[row / 64 * width + row % 64 * others + k] = [r, g, b, 255];
            }
        }
        files.extend([("shN_centroids.webp", webp(&palette, width)), ("shN_labels.webp", webp(&labels, WIDTH))]);
        let facts = if version == 1 { String::new() } else { format!("\"count\":{n},\"bands\":{degree},") };
        let range = range("shN", 1, -0.5, 0.5);
        more = format!(",\"shN\":{{{facts}{range}\"files\":[\"shN_centroids.webp\",\"shN_labels.webp\"]}}");
    }
    let n = gaussians.len();
    let [head, shape] = match version {
        1 => [String::new(), format!("\"shape\":[{n},3],")],
        _ => [format!("\"version\":2,\"count\":{n},"), String::new()],
    };
    let bounds = format!("\"mins\":{},\"maxs\":{}", list(low.into_iter()), list(high.into_iter()));
    let json = format!(
        "{{{head}\"means\":{{{shape}{bounds},\"files\":[\"means_l.webp\",\"means_u.webp\"]}},\
         \"scales\":{{{}\"files\":[\"scales.webp\"]}},\"quats\":{{\"files\":[\"quats.webp\"]}},\
         \"sh0\":{{{}\"files\":[\"sh0.webp\"]}}{more}}}",
        range("scales", 3, -4.0, -1.0),
        range("sh0", 3, -0.5, 0.5),
    );
    let described = ("meta.json".to_owned(), json.into_bytes());
    [described].into_iter().chain(files.into_iter().map(|(name, content)| (name.to_owned(), content))).collect()
}

/// A scene of SOG in an archive.
pub(crate) fn sog(gaussians: &[Trained], degree: usize) -> Vec<u8> {
    zip(&sog_files(gaussians, degree, 2))
}

fn half(v: f64) -> [u8; 2] {
    half::f16::from_f64(v).to_le_bytes()
}

/// `.ksplat` at a level of compression: two sections where there are two Gaussians or more, with buckets of three, and one that is not full
/// behind them.
pub(crate) fn ksplat(gaussians: &[Trained], degree: usize, level: u16) -> Vec<u8> {
    const CAPACITY: usize = 3;
    const SIZE: f64 = 10.0;
    let (first, second) = gaussians.split_at(gaussians.len().div_ceil(2));
    let sections: Vec<&[Trained]> = [first, second].into_iter().filter(|section| !section.is_empty()).collect();
    let mut out = vec![0; 4096];
    out[1] = 1;
    out[4..8].copy_from_slice(&(sections.len() as u32).to_le_bytes());
    out[16..20].copy_from_slice(&(gaussians.len() as u32).to_le_bytes());
    out[20..22].copy_from_slice(&level.to_le_bytes());
    out[36..40].copy_from_slice(&(-0.75f32).to_le_bytes());
    out[40..44].copy_from_slice(&0.75f32.to_le_bytes());
    let mut data = Vec::new();
    for section in sections {
        let full = section.len() / CAPACITY;
        let rest = section.len() % CAPACITY;
        let partial = usize::from(rest > 0);
        let mut head = vec![0u8; 1024];
        let words = [section.len(), section.len(), CAPACITY, full + partial].map(|n| (n as u32).to_le_bytes());
        head[..16].copy_from_slice(words.as_flattened());
        head[16..20].copy_from_slice(&(SIZE as f32).to_le_bytes());
        head[20] = 12;
        head[24..28].copy_from_slice(&32767u32.to_le_bytes());
        head[32..36].copy_from_slice(&(full as u32).to_le_bytes());
        head[36..40].copy_from_slice(&(partial as u32).to_le_bytes());
        head[40] = degree as u8;
        out.extend(head);
        if rest > 0 {
            data.extend((rest as u32).to_le_bytes());
        }
        let middle = |bucket: usize| [0, 1, 2].map(|k| 0.25 * (bucket + k) as f64);
        (0..full + partial).for_each(|b| data.extend(middle(b).map(|v| (v as f32).to_le_bytes()).as_flattened()));
        for (i, t) in section.iter().enumerate() {
            let place = middle(i / CAPACITY);
            if level == 0 {
                let numbers = t.position.into_iter().chain(t.scale.map(f64::exp)).chain(t.rotation);
                numbers.for_each(|v| data.extend((v as f32).to_le_bytes()));
            } else {
                let whole = [0, 1, 2].map(|k| ((t.position[k] - place[k]) / (SIZE / 2.0) * 32767.0).round() + 32767.0);
                data.extend(whole.map(|v| (v as u16).to_le_bytes()).as_flattened());
                t.scale.map(f64::exp).into_iter().chain(t.rotation).for_each(|v| data.extend(half(v)));
            }
            data.extend(t.harmonics[0].map(|c| (255.0 * (0.5 + CONSTANT * c)).round() as u8));
            data.push((255.0 * t.opacity).round() as u8);
            let degrees = [1..4, 4..9].into_iter().take(degree);
            for v in
                degrees.flat_map(|band| (0..3).flat_map(move |c| t.harmonics[band.clone()].iter().map(move |h| h[c])))
            {
                match level {
                    0 => data.extend((v as f32).to_le_bytes()),
                    1 => data.extend(half(v)),
                    _ => data.push((255.0 * (v + 0.75) / 1.5).round() as u8),
                }
            }
        }
    }
    out.extend(data);
    out
}

/// A file of glTF that shows Gaussians as the attributes of `KHR_gaussian_splatting`.
pub(crate) fn gaussian_glb(gaussians: &[Trained], degree: usize) -> Vec<u8> {
    gaussian_glb_with(gaussians, degree, "\"colorSpace\":\"srgb_rec709_display\"", f64::exp, "")
}

/// The same with other keys of the extension, another form of deviations and other keys of the node.
pub(crate) fn gaussian_glb_with(
    gaussians: &[Trained],
    degree: usize,
    keys: &str,
    deviation: fn(f64) -> f64,
    node: &str,
) -> Vec<u8> {
    let flat = |numbers: &dyn Fn(&Trained) -> Vec<f64>| -> Vec<u8> {
        gaussians.iter().flat_map(numbers).flat_map(|v| (v as f32).to_le_bytes()).collect()
    };
    let mut attributes = vec![
        ("POSITION".to_owned(), "VEC3", flat(&|t| t.position.to_vec())),
        (
            "KHR_gaussian_splatting:ROTATION".to_owned(),
            "VEC4",
            flat(&|t| {
                let [w, x, y, z] = t.rotation;
                vec![x, y, z, w]
            }),
        ),
        ("KHR_gaussian_splatting:SCALE".to_owned(), "VEC3", flat(&|t| t.scale.map(deviation).to_vec())),
        ("KHR_gaussian_splatting:OPACITY".to_owned(), "SCALAR", flat(&|t| vec![t.opacity])),
    ];
    for band in 0..=degree {
        for k in 0..2 * band + 1 {
            let name = format!("KHR_gaussian_splatting:SH_DEGREE_{band}_COEF_{k}");
            attributes.push((name, "VEC3", flat(&|t| t.harmonics[band * band + k].to_vec())));
        }
    }
    let mut binary = Vec::new();
    let mut views = Vec::new();
    let mut accessors = Vec::new();
    let mut names = Vec::new();
    for (i, (name, shape, content)) in attributes.into_iter().enumerate() {
        views.push(format!("{{\"buffer\":0,\"byteOffset\":{},\"byteLength\":{}}}", binary.len(), content.len()));
        let count = gaussians.len();
        accessors.push(format!("{{\"bufferView\":{i},\"componentType\":5126,\"count\":{count},\"type\":\"{shape}\"}}"));
        names.push(format!("\"{name}\":{i}"));
        binary.extend(content);
    }
    let json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"extensionsUsed\":[\"KHR_gaussian_splatting\"],\"scenes\":[{{\"nodes\":[0]}}],\
         \"nodes\":[{{{node}\"mesh\":0}}],\"meshes\":[{{\"primitives\":[{{\"mode\":0,\"attributes\":{{{}}},\
         \"extensions\":{{\"KHR_gaussian_splatting\":{{\"kernel\":\"ellipse\",{keys}}}}}}}]}}],\"accessors\":[{}],\
         \"bufferViews\":[{}],\"buffers\":[{{\"byteLength\":{}}}]}}",
        names.join(","),
        accessors.join(","),
        views.join(","),
        binary.len()
    );
    glb(&json, &binary)
}

/// A file of glTF around one of SPZ, by the extension within `KHR_gaussian_splatting` or by the draft before it.
pub(crate) fn spz_glb(content: &[u8], is_nested: bool) -> Vec<u8> {
    let extension = if is_nested {
        "\"KHR_gaussian_splatting\":{\"extensions\":{\"KHR_gaussian_splatting_compression_spz_2\":{\"bufferView\":0}}}"
    } else {
        "\"KHR_spz_gaussian_splats_compression\":{\"bufferView\":0}"
    };
    let json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"extensionsRequired\":[\"KHR_gaussian_splatting\"],\"scenes\":[{{\"nodes\":[0]}}],\
         \"nodes\":[{{\"mesh\":0}}],\"meshes\":[{{\"primitives\":[{{\"mode\":0,\"attributes\":{{\"POSITION\":0}},\
         \"extensions\":{{{extension}}}}}]}}],\"accessors\":[{{\"componentType\":5126,\"count\":1,\"type\":\"VEC3\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":{0}}}],\"buffers\":[{{\"byteLength\":{0}}}]}}",
        content.len()
    );
    glb(&json, content)
}
