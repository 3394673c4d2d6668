//! Textures that are kept beside a mesh, divided later, or not decoded.

use crate::read_samples::{glb, square, square_json};
use image::{ImageFormat, Rgba, RgbaImage};
use read::{Loaded, Notes, Painting, ReadParams, Textures, bytes};
use splat_core::Mesh;
use splat_core::glam::Vec2;
use splat_core::srgb::decoded;

const FACTOR: [f64; 3] = [1.0, 0.5, 1.0];

/// A file of the square with this image, bilinear between its texels; `mode` is the alphaMode.
fn file_of(image: &RgbaImage, mode: &str) -> Vec<u8> {
    let mut png = std::io::Cursor::new(Vec::new());
    image.write_to(&mut png, ImageFormat::Png).unwrap();
    let png = png.into_inner();
    let json = square_json("", png.len()).replace(r#""magFilter":9728"#, r#""magFilter":9729"#);
    glb(&json.replace(r#""materials":[{"#, &format!(r#""materials":[{{"alphaMode":"{mode}","#)), &square(&png))
}

fn params(textures: Textures) -> ReadParams {
    ReadParams { textures, ..ReadParams::default() }
}

fn kept(content: &[u8]) -> (Mesh, Painting, Notes) {
    match bytes("a.glb", content, &params(Textures::Kept), None).unwrap() {
        (Loaded::Painted(mesh, painting), notes) => (mesh, painting, notes),
        other => panic!("{other:?}"),
    }
}

fn plain(content: &[u8], textures: Textures) -> (Mesh, Notes) {
    match bytes("a.glb", content, &params(textures), None).unwrap() {
        (Loaded::Mesh(mesh), notes) => (mesh, notes),
        other => panic!("{other:?}"),
    }
}

fn noise(columns: u32, rows: u32) -> RgbaImage {
    let mut state = 3u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    RgbaImage::from_fn(columns, rows, |_, _| Rgba([next(), next(), next(), 255]))
}

/// Light of one size of an image, row by row.
struct Light {
    columns: usize,
    rows: usize,
    texels: Vec<[f64; 3]>,
}

impl Light {
    fn of(image: &RgbaImage) -> Self {
        let texel = |p: &Rgba<u8>| [0, 1, 2].map(|c| decoded(f64::from(p.0[c]) / 255.0));
        Self {
            columns: image.width() as usize,
            rows: image.height() as usize,
            texels: image.pixels().map(texel).collect(),
        }
    }

    /// Means of two by two texels; both sides are even.
    fn half(&self) -> Self {
        let columns = self.columns / 2;
        let rows = self.rows / 2;
        let mean = |k: usize| {
            let first = 2 * (k / columns) * self.columns + 2 * (k % columns);
            let four = [first, first + 1, first + self.columns, first + self.columns + 1];
            [0, 1, 2].map(|c| four.iter().map(|i| self.texels[*i][c]).sum::<f64>() / 4.0)
        };
        Self { columns, rows, texels: (0..columns * rows).map(mean).collect() }
    }

    /// Bilinear light at a place within the image, of which the border goes on.
    fn at(&self, u: f64, v: f64, channel: usize) -> f64 {
        let x = u * self.columns as f64 - 0.5;
        let y = v * self.rows as f64 - 0.5;
        let texel = |i: f64, j: f64| {
            let i = i.clamp(0.0, self.columns as f64 - 1.0) as usize;
            let j = j.clamp(0.0, self.rows as f64 - 1.0) as usize;
            self.texels[j * self.columns + i][channel]
        };
        let row = |j: f64| texel(x.floor(), j) * (1.0 - (x - x.floor())) + texel(x.floor() + 1.0, j) * (x - x.floor());
        row(y.floor()) * (1.0 - (y - y.floor())) + row(y.floor() + 1.0) * (y - y.floor())
    }
}

#[test]
fn a_part_of_a_triangle_has_the_mean_of_its_texture() {
    let image = noise(32, 16);
    let (mesh, painting, notes) = kept(&file_of(&image, "OPAQUE"));
    assert_eq!((mesh.triangles.len(), mesh.position.len(), mesh.color.len()), (2, 4, 4));
    assert!(notes.remarks.is_empty(), "{:?}", notes.remarks);
    let mut levels = vec![Light::of(&image)];
    (0..4).for_each(|k| levels.push(levels[k].half()));
    // Places of the corners in the image.
    let corners = [[0.0, 1.0], [1.0, 1.0], [0.0, 0.0], [1.0, 0.0]];
    let mut worst = 0.0f64;
    for triangle in &mesh.triangles {
        assert!((painting.texels(triangle) - 256.0).abs() < 1e-9);
        for share in [1e-4, 1.0 / 256.0, 1.0 / 100.0, 1.0 / 16.0, 1.0 / 7.0, 1.0] {
            let level = (0.5 * libm::log2(256.0 * share)).max(0.0);
            let low = level.floor() as usize;
            for [first, second] in [[0.2, 0.3], [0.61, 0.05], [0.0, 0.0], [0.35, 0.65]] {
                let mut colors = [[0.0; 3]];
                let mut weights = [Vec2::new(first, second)].into_iter();
                painting.colors(triangle, share, &mut weights, &mut colors);
                let [w1, w2] = [first, second].map(f64::from);
                let [u, v] = [0, 1].map(|a| {
                    let [a0, a1, a2] = triangle.map(|v| corners[v as usize][a]);
                    a0 * (1.0 - w1 - w2) + a1 * w1 + a2 * w2
                });
                for c in 0..3 {
                    let [fine, coarse] = [low, (low + 1).min(4)].map(|l| levels[l].at(u, v, c));
                    let expected = FACTOR[c] * (fine + (coarse - fine) * (level - low as f64));
                    worst = worst.max((expected - f64::from(colors[0][c])).abs());
                }
            }
        }
    }
    assert!(worst < 1e-5, "{worst}");
}

#[test]
fn an_even_texture_is_exact_everywhere() {
    for texel in [[1, 2, 3, 255], [200, 100, 50, 255], [255, 254, 0, 255]] {
        let (mesh, painting, _) = kept(&file_of(&RgbaImage::from_pixel(13, 6, Rgba(texel)), "OPAQUE"));
        let light = [0, 1, 2].map(|c| splat_core::srgb::linear_from_srgb(f64::from(texel[c]) / 255.0));
        let expected = [light[0], 0.5 * light[1], light[2]];
        for share in [1e-6, 0.01, 0.3, 1.0] {
            let weights = || (0..50).map(|k| Vec2::new(0.011 * k as f32, 0.3 - 0.005 * k as f32));
            let mut colors = vec![[0.0; 3]; 50];
            painting.colors(&mesh.triangles[0], share, &mut weights(), &mut colors);
            assert!(colors.iter().all(|color| *color == expected), "{share}: {colors:?}");
        }
        let (divided, _) = painting.divided(&mesh, 0.3, &ReadParams::default(), None).unwrap();
        assert!(divided.color.iter().all(|color| *color == expected));
    }
}

#[test]
fn what_is_divided_later_is_what_is_divided_at_once_by_any_number_of_threads() {
    let content = file_of(&noise(16, 8), "OPAQUE");
    let (expected, notes) = plain(&content, Textures::Divided);
    for threads in [1, 3] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let (mesh, painting, _) = kept(&content);
            let (found, found_notes) = painting.divided(&mesh, 0.0, &ReadParams::default(), None).unwrap();
            assert_eq!((found, found_notes.remarks), (expected.clone(), notes.remarks.clone()));
            // A square of side 2 whose texels are 1/8 and 1/4.
            let (coarse, _) = painting.divided(&mesh, 0.6, &ReadParams::default(), None).unwrap();
            assert!(coarse.triangles.len() > 2 && 4 * coarse.triangles.len() < expected.triangles.len());
        });
    }
}

#[test]
fn opacities_are_those_of_vertices_where_colours_are_kept() {
    let mut image = noise(8, 8);
    image.enumerate_pixels_mut().filter(|(x, ..)| *x < 4).for_each(|(_, _, p)| p.0[3] = 0);
    let (mesh, painting, notes) = kept(&file_of(&image, "MASK"));
    // Half of the square, within half a texel of its eight.
    assert!((mesh.area() - 2.0).abs() <= 0.25, "{}", mesh.area());
    assert!((mesh.color.len(), mesh.opacity.len()) == (mesh.position.len(), 0));
    assert!(notes.remarks[0].starts_with("textures became opacities of vertices: 2 triangles"), "{:?}", notes.remarks);
    let sum: f64 = mesh.triangles.iter().map(|t| painting.texels(t)).sum();
    assert!((sum - 16.0 * mesh.area()).abs() < 1e-3, "{sum}");
    let (mesh, _, _) = kept(&file_of(&image, "BLEND"));
    let (divided, _) = plain(&file_of(&image, "BLEND"), Textures::Divided);
    assert!((mesh.area() - divided.area()).abs() < 1e-5 && mesh.triangles.len() < divided.triangles.len());
    assert_eq!(mesh.opacity.len(), mesh.position.len());
    // Clear texels lend no colour to what lies beside them: every size of the image is red.
    let mut image = RgbaImage::from_pixel(8, 8, Rgba([255, 0, 0, 255]));
    image.enumerate_pixels_mut().filter(|(x, ..)| *x < 3).for_each(|(_, _, p)| p.0 = [0, 255, 0, 0]);
    let (mesh, painting, _) = kept(&file_of(&image, "MASK"));
    for triangle in &mesh.triangles {
        let mut colors = [[0.0; 3]];
        painting.colors(triangle, 1.0, &mut [Vec2::splat(1.0 / 3.0)].into_iter(), &mut colors);
        assert!(colors[0][0] > colors[0][1], "{colors:?}");
    }
}

#[test]
fn what_is_cut_out_keeps_the_area_of_its_texels() {
    // Every fourth texel, far finer than a 1600th of the diagonal; then stripes of one texel in eight.
    let fine = |image: RgbaImage| {
        let (mesh, _, _) = kept(&file_of(&image, "MASK"));
        mesh.area() / 4.0
    };
    let clear = |is_clear: bool| Rgba([200, 100, 50, if is_clear { 100 } else { 255 }]);
    let quarter = fine(RgbaImage::from_fn(2048, 2048, |x, y| clear(x.max(y) >= 256 || x % 2 + y % 2 > 0)));
    assert!((64.0 * quarter - 0.25).abs() < 0.01, "{quarter}");
    // Opacities between texels are interpolated: a stripe is as wide as its texel where the cutoff lies halfway.
    let empty = |is_empty: bool| Rgba([200, 100, 50, if is_empty { 0 } else { 255 }]);
    let stripes = fine(RgbaImage::from_fn(64, 64, |x, _| empty(x % 8 > 0)));
    assert!((stripes - 0.125).abs() < 0.01, "{stripes}");
}

#[test]
fn an_image_that_is_not_decoded_is_named_with_its_size() {
    let mut content = file_of(&noise(32, 16), "OPAQUE");
    let (mesh, notes) = plain(&content, Textures::Undecoded);
    assert_eq!((mesh.triangles.len(), mesh.color.len()), (2, 4));
    assert_eq!(notes.remarks, ["image 0 is a texture of 32 x 16 texels with opacities"]);
    // Its texels are damaged, which nobody looks at.
    let at = content.windows(4).position(|w| w == b"IDAT").unwrap();
    content[at + 40] ^= 0xff;
    assert_eq!(plain(&content, Textures::Undecoded), (mesh, notes));
    assert!(bytes("a.glb", &content, &params(Textures::Kept), None).is_err());
}

#[test]
fn a_mesh_without_textures_is_none_with_kept_ones() {
    let content = crate::read_samples::plain_glb();
    assert_eq!(plain(&content, Textures::Kept), plain(&content, Textures::Divided));
}
