//! Meshes in memory with a texture are painted as those of files are.

use crate::read_samples::image;
use read::{
    Fault, Loaded, Notes, Painting, PaintingParts, ReadParams, Rgba, TextureImage, TexturePlaces, Textures, file,
    mesh_columns_in_memory, painting_of_parts, parts_of_painting, smoothed_in_memory, textured_in_memory,
};
use splat_core::glam::{DVec3, Vec2, Vec3};
use splat_core::{Association, MemoryAccount, Mesh, MeshColumn, Relative};
use std::path::{Path, PathBuf};

/// A roof of two squares that share an edge, and another place in the texture for each of its corners.
const ROOF: &str = "mtllib a.mtl\nusemtl a\nv 0 0 0\nv 1 0 0.5\nv 1 1 0.5\nv 0 1 0\nv 2 0 0\nv 2 1 0\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\nf 2/1 5/2 6/3\nf 2/1 6/3 3/4\n";
const POSITIONS: [[f32; 3]; 6] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.5], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
const TRIANGLES: [[u32; 3]; 4] = [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]];
const LOWER: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
const UPPER: [[f32; 2]; 3] = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// The mesh as readers have it.
fn roof() -> Mesh {
    let places = POSITIONS.map(|p| Vec3::from(p).as_dvec3());
    let Relative { origin, offsets } = Relative::from_positions(&places, Vec::new()).unwrap();
    Mesh { origin, position: offsets, triangles: TRIANGLES.to_vec(), ..Mesh::default() }
}

fn of_corners() -> TexturePlaces {
    TexturePlaces::Corners(vec![LOWER, UPPER, LOWER, UPPER])
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    folder
}

/// The mesh of the OBJ file, its texture and the path of that.
fn of_file(name: &str) -> (Mesh, PathBuf) {
    let folder = folder(name);
    let texture = folder.join("a.png");
    std::fs::write(&texture, image(8, image::ImageFormat::Png)).unwrap();
    std::fs::write(folder.join("a.mtl"), "newmtl a\nmap_Kd a.png\n").unwrap();
    std::fs::write(folder.join("a.obj"), ROOF).unwrap();
    match file(&folder.join("a.obj"), &ReadParams::default(), None).unwrap() {
        (Loaded::Mesh(mesh), _) => (mesh, texture),
        other => panic!("{other:?}"),
    }
}

/// The mesh as it is painted, with what there is to say.
fn painted(mesh: Mesh, places: &TexturePlaces, image: TextureImage) -> (Mesh, Notes) {
    match textured_in_memory("roof", mesh, places, image, &ReadParams::default()).unwrap() {
        (Loaded::Mesh(mesh), notes) => (mesh, notes),
        other => panic!("{other:?}"),
    }
}

fn texels(path: &Path) -> TextureImage {
    let rgba = image::open(path).unwrap().into_rgba8();
    let size = [rgba.width(), rgba.height()];
    TextureImage::Texels { size, rgba: Rgba::Srgb(rgba.as_raw().as_chunks().0.to_vec()) }
}

#[test]
fn a_texture_in_memory_paints_as_that_of_a_file() {
    let (of_file, texture) = of_file("textured");
    assert!(of_file.triangles.len() > 16 && !of_file.color.is_empty());
    for image in [TextureImage::File(texture.clone()), texels(&texture)] {
        let (mesh, notes) = painted(roof(), &of_corners(), image);
        assert_eq!(mesh, of_file);
        assert!(notes.remarks[0].starts_with("textures became colours of vertices"), "{notes:?}");
    }
}

#[test]
fn a_painting_taken_apart_is_made_again_of_its_parts() {
    let (_, texture) = of_file("textured-parts");
    let params = ReadParams { textures: Textures::Kept, ..ReadParams::default() };
    let tinted = Mesh { color: vec![[1.0, 0.5, 0.25]; 6], opacity: vec![0.5; 6], ..roof() };
    let half = Rgba::Linear((0..64).map(|i| [1.0, 0.1, 0.0, if i % 8 < 4 { 1.0 } else { 0.0 }]).collect());
    let images = [texels(&texture), TextureImage::File(texture), TextureImage::Texels { size: [8, 8], rgba: half }];
    for image in images {
        for mesh in [roof(), tinted.clone()] {
            let (loaded, _) = textured_in_memory("roof", mesh, &of_corners(), image.clone(), &params).unwrap();
            let Loaded::Painted(mesh, painting) = loaded else { panic!("no painting") };
            let parts = parts_of_painting(&painting).expect("a painting of one texture");
            assert_eq!(parts.places.len(), mesh.position.len());
            assert_eq!(painting_of_parts("roof", parts, &params).unwrap(), painting);
        }
    }
}

/// Opacities of a texture whose opposite borders differ: places on a border that rounding leads beyond it would have those of the other side.
#[test]
fn triangles_are_divided_alike_whichever_corner_comes_first() {
    let params = ReadParams { textures: Textures::Kept, ..ReadParams::default() };
    let texel = |i: usize| [200, 0, 0, if i / 8 >= 4 && i % 8 >= 4 { 128 } else { 255 }];
    let image = TextureImage::Texels { size: [8, 8], rgba: Rgba::Srgb((0..64).map(texel).collect()) };
    let turned = |turn: usize| {
        let rolled = |corners: [u32; 3]| [0, 1, 2].map(|k| corners[(k + turn) % 3]);
        let places = [LOWER, UPPER, LOWER, UPPER].map(|places| [0, 1, 2].map(|k| places[(k + turn) % 3]));
        let mesh = Mesh { triangles: TRIANGLES.map(rolled).to_vec(), ..roof() };
        let places = TexturePlaces::Corners(places.to_vec());
        let (loaded, _) = textured_in_memory("roof", mesh, &places, image.clone(), &params).unwrap();
        let Loaded::Painted(mesh, _) = loaded else { panic!("no painting") };
        let corners = |t: &[u32; 3]| {
            let mut corners = t.map(|v| mesh.position[v as usize].to_array().map(|x| (x * 1e5).round() as i64));
            corners.sort_unstable();
            corners
        };
        let mut triangles: Vec<_> = mesh.triangles.iter().map(corners).collect();
        triangles.sort_unstable();
        triangles
    };
    let first = turned(0);
    assert!(first.len() > 100, "{}", first.len());
    assert!(first == turned(1) && first == turned(2), "{} {} {}", first.len(), turned(1).len(), turned(2).len());
}

#[test]
fn parts_that_make_no_painting_are_refused() {
    let parts = PaintingParts {
        places: vec![[0.0; 2]; 3],
        tint: vec![[1.0; 4]; 2],
        size: [1, 1],
        rgba: Rgba::Srgb(vec![[255; 4]]),
        stated_triangles: 1,
    };
    let said = |parts| painting_of_parts("roof", parts, &ReadParams::default()).unwrap_err().to_string();
    assert!(said(parts.clone()).contains("a tint of each vertex, 3"), "{}", said(parts.clone()));
    assert!(said(PaintingParts { size: [2, 1], tint: Vec::new(), ..parts }).contains("2 texels"));
}

#[test]
fn a_kept_texture_in_memory_is_that_of_a_file() {
    let (_, texture) = of_file("textured-kept");
    let params = ReadParams { textures: Textures::Kept, ..ReadParams::default() };
    let (found, _) = file(&texture.with_file_name("a.obj"), &params, None).unwrap();
    assert!(matches!(&found, Loaded::Painted(mesh, _) if mesh.triangles.len() == 4), "{found:?}");
    let rgba = image::open(&texture).unwrap().into_rgba8();
    let linear = rgba.pixels().map(|p| {
        let [r, g, b] = [0, 1, 2].map(|c| splat_core::srgb::linear_from_srgb(f64::from(p.0[c]) / 255.0));
        [r, g, b, f32::from(p.0[3]) / 255.0]
    });
    let linear: Vec<[f32; 4]> = linear.collect();
    let Loaded::Painted(of_file, expected) = found else { panic!("no painting") };
    let in_memory = |image: TextureImage| match textured_in_memory("roof", roof(), &of_corners(), image, &params) {
        Ok((Loaded::Painted(mesh, painting), _)) => (mesh, painting),
        other => panic!("{other:?}"),
    };
    let colors_of = |painting: &Painting, share: f64| {
        let mut colors = vec![[0.0; 3]; 4];
        let mut weights = (0..4).map(|k| Vec2::splat(0.1 * k as f32));
        painting.colors(&of_file.triangles[1], share, &mut weights, &mut colors);
        colors
    };
    for share in [1e-3, 0.1, 1.0] {
        let expected = colors_of(&expected, share);
        for image in [TextureImage::File(texture.clone()), texels(&texture)] {
            let (mesh, painting) = in_memory(image);
            assert_eq!(mesh, of_file);
            assert_eq!(colors_of(&painting, share), expected);
        }
        let image = TextureImage::Texels { size: [rgba.width(), rgba.height()], rgba: Rgba::Linear(linear.clone()) };
        let (_, painting) = in_memory(image);
        assert_eq!(colors_of(&painting, share), expected);
    }
}

#[test]
fn vertices_that_a_seam_parts_are_shaded_as_one() {
    let (of_file, texture) = of_file("textured-seam");
    // Each corner has a vertex of its own.
    let whole = roof();
    let position = whole.triangles.iter().flatten().map(|v| whole.position[*v as usize]).collect();
    let triangles = (0..4).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let parted = Mesh { position, triangles, ..roof() };
    let places = TexturePlaces::Vertices([LOWER, UPPER, LOWER, UPPER].concat());
    let image = TextureImage::File(texture);
    let (mesh, _) = painted(parted, &places, image);
    let corners = |mesh: &Mesh| {
        let of_vertex = |v: u32| (mesh.position[v as usize], mesh.normal[v as usize], mesh.color[v as usize]);
        mesh.triangles.iter().map(|t| t.map(of_vertex)).collect::<Vec<_>>()
    };
    assert_eq!(corners(&mesh)[..4], corners(&of_file)[..4]);
}

/// A strip around the y axis, whose last column of vertices lies where its first does, but for rounding.
fn barrel() -> Mesh {
    let sides = 24;
    let place = |k: u32| {
        let turn = f64::from(k) / f64::from(sides) * std::f64::consts::TAU;
        [0.0, 1.0].map(|y| DVec3::new(libm::cos(turn), y, libm::sin(turn)).as_vec3())
    };
    let triangles = (0..sides).flat_map(|k| [[2 * k, 2 * k + 1, 2 * k + 2], [2 * k + 1, 2 * k + 3, 2 * k + 2]]);
    let triangles = triangles.collect();
    Mesh { position: (0..=sides).flat_map(place).collect(), triangles, ..Mesh::default() }
}

#[test]
fn the_seam_of_a_closed_surface_is_no_edge_however_its_places_are_rounded() {
    let barrel = barrel();
    let last = barrel.position.len() - 2;
    assert_ne!(barrel.position[0], barrel.position[last], "rounding parts them");
    let params = ReadParams::default();
    let plain = smoothed_in_memory("barrel", barrel.clone(), &params).unwrap();
    assert_eq!((&plain.position, &plain.triangles), (&barrel.position, &barrel.triangles));
    let image = TextureImage::Texels { size: [1, 1], rgba: Rgba::Linear(vec![[0.5; 4]]) };
    let places = TexturePlaces::Vertices(vec![[0.5; 2]; barrel.position.len()]);
    let (textured, _) = painted(barrel.clone(), &places, image);
    for mesh in [plain, textured] {
        let normal = mesh.normal[0];
        assert_eq!(normal, mesh.normal[last]);
        assert!(normal.abs().distance(Vec3::X) < 0.01, "{normal}");
    }
    // What has normals, or no vertices at one place, stays as it is.
    let open = Mesh { triangles: vec![[0, 1, 2]], position: barrel.position[..4].to_vec(), ..Mesh::default() };
    let lit = Mesh { normal: vec![Vec3::Y; barrel.position.len()], ..barrel };
    for mesh in [open, lit] {
        assert_eq!(smoothed_in_memory("barrel", mesh.clone(), &params).unwrap(), mesh);
    }
}

#[test]
fn linear_texels_colours_and_columns_are_kept() {
    let image = TextureImage::Texels { size: [1, 1], rgba: Rgba::Linear(vec![[2.0, 0.5, 0.25, 0.5]]) };
    let column = MeshColumn { name: "heat".into(), association: Association::Vertex, values: vec![1.0; 6] };
    let mesh = Mesh { color: vec![[0.5, 1.0, 1.0]; 6], opacity: vec![0.5; 6], columns: vec![column], ..roof() };
    let (mesh, _) = painted(mesh, &of_corners(), image);
    mesh.validate().unwrap();
    assert!(mesh.color.iter().all(|color| *color == [1.0, 0.5, 0.25]));
    assert!(mesh.opacity.iter().all(|opacity| *opacity == 0.25));
    assert_eq!(mesh.columns[0].values, vec![1.0; mesh.position.len()]);
    let unused = |columns: &[&str]| {
        let columns = columns.iter().map(|name| (*name).to_owned()).collect();
        mesh_columns_in_memory("roof", &mesh, &ReadParams { columns, ..ReadParams::default() })
    };
    assert_eq!(unused(&[]).unwrap().unused, ["heat"]);
    assert!(unused(&["heat"]).unwrap().unused.is_empty());
    assert!(unused(&["cold"]).unwrap_err().expected.contains("heat"));
}

#[test]
fn wrong_textures_are_refused_by_name() {
    let white = |size: [u32; 2], count: usize| TextureImage::Texels { size, rgba: Rgba::Srgb(vec![[255; 4]; count]) };
    let wrong = |texel: [f32; 4]| TextureImage::Texels { size: [1, 1], rgba: Rgba::Linear(vec![texel]) };
    let few = TexturePlaces::Vertices(vec![[0.0; 2]; 5]);
    let mut infinite = vec![[0.0; 2]; 6];
    infinite[4][1] = f32::NAN;
    let infinite = TexturePlaces::Vertices(infinite);
    let folder = folder("textured-wrong");
    std::fs::write(folder.join("text.png"), "no image").unwrap();
    let cases = [
        (of_corners(), white([2, 2], 3), "roof: expected 4 texels, found 3"),
        (of_corners(), white([0, 0], 0), "1 to 65536 pixels a side"),
        (of_corners(), wrong([-1.0, 0.0, 0.0, 1.0]), "found others in row 0, column 0"),
        (of_corners(), wrong([0.0, 0.0, 0.0, 2.0]), "opacities from 0 to 1"),
        (few, white([1, 1], 1), "expected texture coordinates of each vertex, 6, found 5"),
        (infinite, white([1, 1], 1), "found 0, NaN at corner 1 of face 2"),
        (of_corners(), TextureImage::File(folder.join("text.png")), "text.png: expected a whole PNG or JPEG image"),
    ];
    for (places, image, said) in cases {
        let error = textured_in_memory("roof", roof(), &places, image, &ReadParams::default()).unwrap_err();
        assert!(error.fault == Fault::Input && error.to_string().contains(said), "{error}");
    }
    let missing = TextureImage::File(folder.join("nothing.png"));
    let error = textured_in_memory("roof", roof(), &of_corners(), missing, &ReadParams::default()).unwrap_err();
    assert!(error.is_missing_file() && error.file.ends_with("nothing.png"), "{error}");
    let params = ReadParams { memory: MemoryAccount::new(64), ..ReadParams::default() };
    let error = textured_in_memory("roof", roof(), &of_corners(), white([8, 8], 64), &params).unwrap_err();
    assert_eq!(error.fault, Fault::Limit);
}
