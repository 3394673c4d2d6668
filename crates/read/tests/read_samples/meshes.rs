//! Small files of OFF, PCD and glTF.

use super::VERTICES;
use base64::Engine as _;

/// A quad and a triangle with normals, colours and colours of faces. Ends with one digit.
pub(crate) fn off() -> Vec<u8> {
    let mut text = "CNOFF\n# two faces\n4 2 5\n".to_owned();
    for (i, [x, y, z]) in VERTICES.iter().enumerate() {
        text += &format!("{x} {y} {z} 0 0 2 {} 255 128 9\n", i * 10);
    }
    (text + "4 0 1 2 3 0.5 0.5 0.5\n3 0 2 3").into_bytes()
}

/// The header of [`pcd`].
pub(crate) fn pcd_header(data: &str) -> String {
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n\
         FIELDS x y z normal_x normal_y normal_z rgb intensity opacity ring histogram\n\
         SIZE 4 4 4 4 4 4 4 4 4 1 2\nTYPE F F F F F F U F F U I\nCOUNT 1 1 1 1 1 1 1 1 1 1 3\n\
         WIDTH 4\nHEIGHT 1\nPOINTS 4\nDATA {data}\n"
    )
}

/// Four points with all that is kept and two fields that are not. Text ends with one digit.
pub(crate) fn pcd(data: &str) -> Vec<u8> {
    let mut fields: Vec<Vec<Vec<u8>>> = vec![Vec::new(); 11];
    let mut lines = Vec::new();
    for i in 0..4u8 {
        let x = f32::from(i);
        let opacity = [0.0f32, 0.2, 0.4, 0.6][usize::from(i)];
        let floats = [x, 0.5 * x, -2.0 * x, 0.0, 0.0, 2.0];
        let rgb = [0x00ff_0000u32, 0x0000_8000, 0x0012_3456, 0][usize::from(i)];
        let histogram = [i16::from(i), -i16::from(i), 7];
        let words: Vec<String> = floats.iter().map(f32::to_string).collect();
        let [a, b, c] = histogram;
        lines.push(format!("{} {rgb} {} {opacity} {i} {a} {b} {c}", words.join(" "), 3.0 * x));
        floats.iter().enumerate().for_each(|(f, v)| fields[f].push(v.to_le_bytes().to_vec()));
        fields[6].push(rgb.to_le_bytes().to_vec());
        fields[7].push((3.0 * x).to_le_bytes().to_vec());
        fields[8].push(opacity.to_le_bytes().to_vec());
        fields[9].push(vec![i]);
        fields[10].push(histogram.iter().flat_map(|v| v.to_le_bytes()).collect());
    }
    let body = match data {
        "ascii" => lines.join("\n").into_bytes(),
        "binary" => (0..4).flat_map(|i| fields.iter().flat_map(move |f| f[i].clone())).collect(),
        _ => {
            let plain: Vec<u8> = fields.concat().concat();
            let packed = lzf(&plain);
            [&(packed.len() as u32).to_le_bytes()[..], &(plain.len() as u32).to_le_bytes(), &packed].concat()
        }
    };
    [pcd_header(data).into_bytes(), body].concat()
}

/// Literal bytes, and copies of runs.
fn lzf(plain: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut at = 0;
    while at < plain.len() {
        let run = if at == 0 { 0 } else { plain[at..].iter().take_while(|b| **b == plain[at - 1]).count().min(8) };
        if run > 2 {
            out.extend([((run - 2) as u8) << 5, 0]);
            at += run;
        } else {
            out.extend([0, plain[at]]);
            at += 1;
        }
    }
    out
}

/// A PNG or JPEG image of so many pixels a side: red left, green right, and blue below.
pub(crate) fn image(side: u32, format: image::ImageFormat) -> Vec<u8> {
    let color = |x: u32, y: u32| {
        if 2 * y >= side {
            [0, 0, 255]
        } else if 2 * x < side {
            [255, 0, 0]
        } else {
            [0, 255, 0]
        }
    };
    let pixels = image::RgbImage::from_fn(side, side, |x, y| image::Rgb(color(x, y)));
    let mut out = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut out, format).unwrap();
    out.into_inner()
}

/// A GLB of a description and bytes.
pub(crate) fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let padded = |bytes: &[u8], with: u8| {
        let mut out = bytes.to_vec();
        out.resize(bytes.len().next_multiple_of(4), with);
        out
    };
    let chunks = [(b"JSON", padded(json.as_bytes(), b' ')), (b"BIN\0", padded(binary, 0))];
    let length = 12 + chunks.iter().map(|(_, c)| 8 + c.len()).sum::<usize>();
    let mut out = [&b"glTF"[..], &2u32.to_le_bytes(), &(length as u32).to_le_bytes()].concat();
    for (kind, chunk) in chunks {
        out.extend((chunk.len() as u32).to_le_bytes());
        out.extend(kind);
        out.extend(chunk);
    }
    out
}

/// Bytes of a square in the plane z = 0: places, normals, texture coordinates, colours as bytes, indices of a strip; then
/// the image.
pub(crate) fn square(image: &[u8]) -> Vec<u8> {
    let corners = [[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let mut out = Vec::new();
    corners.iter().for_each(|[x, y]| [*x, *y, 0.0].iter().for_each(|v| out.extend(v.to_le_bytes())));
    (0..4).for_each(|_| [0.0f32, 0.0, 1.0].iter().for_each(|v| out.extend(v.to_le_bytes())));
    corners.iter().for_each(|[x, y]| [*x, 1.0 - *y].iter().for_each(|v| out.extend(v.to_le_bytes())));
    out.extend([255u8; 16]);
    (0..4u16).for_each(|i| out.extend(i.to_le_bytes()));
    out.extend(image);
    out
}

/// The description of [`square`]: a strip below two nodes, painted with the image.
pub(crate) fn square_json(buffer: &str, image: usize) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
"nodes":[{{"children":[1],"translation":[10,0,0]}},{{"mesh":0,"scale":[2,2,2],"rotation":[0,0,0.70710678,0.70710678]}}],
"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2,"COLOR_0":3}},"indices":4,"material":0,"mode":5}}]}}],
"materials":[{{"pbrMetallicRoughness":{{"baseColorFactor":[1,0.5,1,1],"baseColorTexture":{{"index":0}},"metallicFactor":0}}}}],
"textures":[{{"source":0,"sampler":0}}],"samplers":[{{"magFilter":9728}}],"images":[{{"bufferView":5,"mimeType":"image/png"}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},{{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"}},
{{"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"}},{{"bufferView":3,"componentType":5121,"count":4,"type":"VEC4","normalized":true}},
{{"bufferView":4,"componentType":5123,"count":4,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":48}},{{"buffer":0,"byteOffset":96,"byteLength":32}},
{{"buffer":0,"byteOffset":128,"byteLength":16}},{{"buffer":0,"byteOffset":144,"byteLength":8}},{{"buffer":0,"byteOffset":152,"byteLength":{image}}}],
"buffers":[{{"byteLength":{}{buffer}}}]}}"#,
        152 + image
    )
}

/// The square as one file, with a PNG or a JPEG image.
pub(crate) fn square_glb(format: image::ImageFormat) -> Vec<u8> {
    let image = image(4, format);
    glb(&square_json("", image.len()), &square(&image))
}

/// The same without an image.
pub(crate) fn plain_glb() -> Vec<u8> {
    let json = square_json("", 0);
    let (before, rest) = json.split_once(r#","baseColorTexture":{"index":0}"#).unwrap();
    let (between, rest) = rest.split_once(r#""textures""#).unwrap();
    let (_, after) = rest.split_once(r#""accessors""#).unwrap();
    glb(&format!(r#"{before}{between}"accessors"{after}"#), &square(&[]))
}

/// The same as text, its bytes in base64.
pub(crate) fn square_gltf() -> Vec<u8> {
    let image = image(4, image::ImageFormat::Png);
    let encoded = base64::engine::general_purpose::STANDARD.encode(square(&image));
    square_json(&format!(r#","uri":"data:application/octet-stream;base64,{encoded}""#), image.len()).into_bytes()
}
