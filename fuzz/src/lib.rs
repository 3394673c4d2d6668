//! What the fuzz targets do with their bytes: read them as a file, as one with those beside it, a scene with its data, damage of a
//! checkpoint or a cache, a transfer function or a formula. Whatever they are, it ends, in an error or in something valid, within the
//! memory that was allowed.
#![forbid(unsafe_code)]

/// Right sums for pages of E57, which would tell nearly all damage before anything else is looked at.
#[path = "../../crates/read/tests/read_samples/e57.rs"]
#[allow(dead_code, reason = "the sample itself is a seed already")]
mod e57;

use convert::{Cache, SurfelParams, raw_to_surfels};
use field::ExpressionField;
use organza::{Progress, RenderOptions};
use organza_scene::{LoadOptions, Scene};
use read::{Loaded, ReadParams, panic_is_input_error};
use sha2::{Digest, Sha256};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{
    Environment, FootprintImage, Framing, HeightImage, Layers, LightShape, MemoryAccount, RadianceImage, RawPoints,
    ScalarField, Slide,
};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::sync::{Arc, LazyLock, Once};
use std::time::Duration;

/// Bytes that a file and what is made of it may each take.
const MEMORY: u64 = 64 << 20;

/// Time after which a scene is interrupted: most of the mutated ones ask for more than a fuzzer can wait for.
const PATIENCE: Duration = Duration::from_millis(500);

/// Samples of a drawn scene along a side.
const SIDE: u32 = 8;

/// Folder of this process for the files that lie beside others, and for those that only exist on disk.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/files").join(std::process::id().to_string());
    fs::create_dir_all(&folder).expect("a folder for files");
    folder
});

/// Writes a file of [`FOLDER`].
fn write(name: &str, content: &[u8]) -> PathBuf {
    let path = FOLDER.join(name);
    fs::write(&path, content).expect("a file can be written");
    path
}

/// What a file and what is made of it may take.
fn params() -> ReadParams {
    // Levels of detail are looked at where there are some.
    let most_points = Some(16);
    ReadParams { memory: MemoryAccount::new(MEMORY), most_points, ranges: true, ..ReadParams::default() }
}

/// Reads bytes as the command reads a file of this name.
pub fn read(name: &str, data: &[u8]) {
    // The decoder of LAZ panics on some damage; its reader makes an error of that. The fuzzer would stop at it.
    static CAUGHT: Once = Once::new();
    CAUGHT.call_once(|| {
        let stop = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !panic_is_input_error() {
                stop(info);
            }
        }));
    });
    if let Ok((loaded, _)) = read::bytes(name, data, &params(), None) {
        check(&loaded);
    }
}

/// Reads a table of labels as text.
pub fn read_labels(data: &[u8]) {
    if let Ok(table) = read::label_rows_of_bytes("a.ctbl", data, &params()) {
        let is_label = |row: &read::LabelRow| (0.0..=1.0).contains(&row.opacity) && row.color.iter().all(|c| (0.0..=1.0).contains(c));
        assert!(!table.rows.is_empty() && table.rows.iter().all(is_label), "a table that was read is valid");
        assert!(table.rows.windows(2).all(|pair| pair[0].number < pair[1].number), "numbers rise");
    }
}

/// Stops the fuzzer where a reader gave something that is not valid.
fn check(loaded: &Loaded) {
    let valid = match loaded {
        Loaded::Mesh(mesh) => mesh.validate(),
        Loaded::Points(points) => points.validate(),
        // Voxels may be NaN, which draws nothing.
        Loaded::Grid(grid) => convert::gaps_of_value(grid, 0.0).as_ref().unwrap_or(grid).validate(),
        Loaded::Image(image) => image.validate(),
        _ => panic!("a kind that is not checked"),
    };
    valid.expect("what was read is valid");
}

/// Reads what comes before the first zero byte as the file of this name, with what follows as the file `b` beside it.
pub fn read_pair(name: &str, data: &[u8]) {
    let (first, second) = cut(data);
    write("b", second);
    read_on_disk(name, first);
}

/// Reads an OBJ file, its materials `b` and its image `c`, a zero byte behind each of the first two.
pub fn read_painted(data: &[u8]) {
    let (model, rest) = cut(data);
    let (materials, image) = cut(rest);
    write("b", materials);
    write("c", image);
    read_on_disk("a.obj", model);
}

/// Reads a file of DICOM with another one beside it, a half of the bytes each.
pub fn read_slices(data: &[u8]) {
    let folder = FOLDER.join("slices");
    fs::create_dir_all(&folder).expect("a folder for slices");
    let (first, second) = data.split_at(data.len() / 2);
    write("slices/b.dcm", second);
    read_on_disk("slices/a.dcm", first);
}

/// The bytes before and behind the first zero byte, which no header in text has.
fn cut(data: &[u8]) -> (&[u8], &[u8]) {
    let end = data.iter().position(|byte| *byte == 0).unwrap_or(data.len());
    (&data[..end], data.get(end + 1..).unwrap_or_default())
}

/// Reads a file that may name others of [`FOLDER`].
fn read_on_disk(name: &str, data: &[u8]) {
    let path = write(name, data);
    if let Ok((loaded, _)) = read::file(&path, &params(), None) {
        check(&loaded);
    }
}

/// Reads bytes as an image of radiance, of numbers and of coverage, and makes of each what a scene makes of it.
pub fn image(data: &[u8]) {
    let read = |params: ReadParams| match read::bytes("a", data, &params, None) {
        Ok((Loaded::Image(image), _)) => Some(image),
        _ => None,
    };
    if let Some(image) = read(params()) {
        shine(&image);
    }
    if let Some(heights) = read(ReadParams { is_data: true, ..params() }) {
        drop(HeightImage::new(&heights));
    }
    if let Some(image) = read(ReadParams { is_coverage: true, ..params() }) {
        let coverage: Vec<f32> = image.pixels.iter().map(|pixel| pixel[0]).collect();
        drop(FootprintImage::new(image.size, &coverage));
    }
}

/// Makes an environment and slides of an image.
fn shine(image: &RadianceImage) {
    drop(Environment::new(image, 0.25, 1.0));
    let sun = LightShape::Directional { direction: DVec3::NEG_Z };
    drop(Slide::new(image, &sun, &Framing { up: DVec3::Y, width: Some(2.0), center: DVec3::ZERO }));
}

/// Draws what comes before the first zero byte as a scene in TOML, with what follows as the file `b` beside it.
pub fn draw(data: &[u8]) {
    let (text, file) = cut(data);
    let options = LoadOptions { sandbox: true, memory: MemoryAccount::new(MEMORY), ..LoadOptions::default() };
    // Looked at first: most scenes are refused for their text alone.
    let path = FOLDER.join("scene.toml");
    if organza_scene::parse(&path, text, &options).is_err() {
        return;
    }
    write("b", file);
    let Ok(mut scene) = organza_scene::parse(&path, text, &options) else { return };
    scene.camera.size = [SIDE; 2];
    render(&scene, None);
}

/// Renders a scene, which is interrupted after [`PATIENCE`]; refusals are words that are made too.
fn render(scene: &Scene, checkpoint: Option<PathBuf>) -> Option<Layers> {
    let options = RenderOptions { max_memory: MEMORY, checkpoint, ..RenderOptions::default() };
    let progress = Progress::new();
    let (done, waits) = mpsc::channel();
    let rendered = std::thread::scope(|scope| {
        let progress = &progress;
        scope.spawn(move || {
            if waits.recv_timeout(PATIENCE).is_err() {
                progress.cancel();
            }
        });
        let rendered = organza::render(scene, &options, progress);
        done.send(()).ok();
        rendered
    });
    rendered.map_err(|e| e.to_string()).ok().map(|render| render.layers)
}

/// Bytes before the tag of a checkpoint's scene, that tag, and the checksum at its end.
const BEFORE_TAG: usize = 8;
const TAG: usize = 32;
const CHECKSUM: usize = 4;

/// A scene in sets, small and of the layers that a checkpoint keeps.
const SETS: &str = r#"version = 1
[camera]
position = [0, 0, 4]
target = [0, 0, 0]
size = [8, 8]
[[object]]
name = "fog"
medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.5 }
[render]
technique = "particles"
layers = ["depth", "object"]
[render.particles]
repeat_level = 3
"#;

/// Goes on from a checkpoint that is damaged behind its tag, with a right checksum, which would tell all damage.
pub fn damaged_checkpoint(data: &[u8]) {
    static SCENE: LazyLock<Scene> = LazyLock::new(|| {
        organza_scene::parse(&FOLDER.join("sets.toml"), SETS.as_bytes(), &LoadOptions::default()).expect("a scene")
    });
    static WHOLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let path = FOLDER.join("whole");
        render(&SCENE, Some(path.clone())).expect("a scene of some points is drawn");
        fs::read(path).expect("a checkpoint is written")
    });
    let end = WHOLE.len() - CHECKSUM;
    let mut bytes = damaged(&WHOLE, BEFORE_TAG + TAG..end, data);
    let sum = crc32(&bytes[..end]);
    bytes[end..].copy_from_slice(&sum.to_le_bytes());
    render(&SCENE, Some(write("sums", &bytes)));
}

/// The bytes with those of `part` changed by `damage`, over and over.
fn damaged(bytes: &[u8], part: Range<usize>, damage: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes[part].iter_mut().zip(damage.iter().cycle()).for_each(|(byte, change)| *byte ^= change);
    bytes
}

/// CRC-32 (IEEE 802.3).
fn crc32(bytes: &[u8]) -> u32 {
    static TABLE: LazyLock<[u32; 256]> = LazyLock::new(|| {
        let step = |c: u32| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 };
        std::array::from_fn(|byte| (0..8).fold(byte as u32, |c, _| step(c)))
    });
    !bytes.iter().fold(!0, |crc, byte| crc >> 8 ^ TABLE[((crc ^ u32::from(*byte)) & 255) as usize])
}

/// Bytes of a file of the cache before the hash of its content, and that hash.
const BEFORE_HASH: usize = 48;
const HASH: usize = 32;

/// Makes surfels from a file of the cache whose content is damaged, with a right hash, which would tell all damage.
pub fn damaged_cache(data: &[u8]) {
    static POINTS: LazyLock<RawPoints> = LazyLock::new(|| {
        let position = (0..20u8).map(|i| Vec3::new(f32::from(i % 5), f32::from(i % 3), f32::from(i / 5))).collect();
        RawPoints { position, ..RawPoints::default() }
    });
    static FILE: LazyLock<(PathBuf, Vec<u8>)> = LazyLock::new(|| {
        surfels(&POINTS);
        let kept = fs::read_dir(FOLDER.join("cache")).expect("a folder").next().expect("a file").expect("its name");
        (kept.path(), fs::read(kept.path()).expect("what was kept is there"))
    });
    let (path, whole) = &*FILE;
    let mut bytes = damaged(whole, BEFORE_HASH + HASH..whole.len(), data);
    let hash = Sha256::digest(&bytes[BEFORE_HASH + HASH..]);
    bytes[BEFORE_HASH..BEFORE_HASH + HASH].copy_from_slice(&hash);
    fs::write(path, &bytes).expect("a file can be written");
    surfels(&POINTS);
}

/// Makes surfels with the help of the cache in [`FOLDER`].
fn surfels(points: &RawPoints) {
    let mut params = SurfelParams::default();
    params.splat.cache = Some(Arc::new(Cache::new(FOLDER.join("cache"), MEMORY)));
    // A right hash vouches for sizes: surfels of made-up ones may be too small or too large for single precision.
    drop(raw_to_surfels(points, &params, None));
}

/// Reads bytes as a file of E57 whose pages have the right sums.
pub fn scans(data: &[u8]) {
    read("a.e57", &e57::summed(data.to_vec()));
}

/// Checks bytes as a scene file of this name. The data that it names is not there.
pub fn scene(name: &str, data: &[u8]) {
    // A refusal is words: they are made too.
    let refused = organza_scene::parse(&Path::new("/nowhere/scenes").join(name), data, &LoadOptions::default());
    drop(refused.map_err(|e| e.to_string()));
}

/// Checks bytes as the transfer function of the volume of a scene.
pub fn transfer(data: &[u8]) {
    let before = b"version = 1\ncamera = \"auto\"\n[[object]]\nname = \"a\"\nvolume = \"a.nrrd\"\ntransfer = ";
    scene("scene.toml", &[before, data].concat());
}

/// Parses bytes as a formula, and asks it for all that a field can be asked for.
pub fn expression(data: &[u8]) {
    let Ok(text) = std::str::from_utf8(data) else { return };
    let Ok(field) = ExpressionField::parse(text) else { return };
    let places = [DVec3::ZERO, DVec3::new(0.3, -7.0, 1e6), DVec3::splat(-1e300)];
    let mut found = [(0.0, DVec3::ZERO); 3];
    field.value_gradients(&places, &mut found);
    for p in places {
        field.value(p);
        field.hessian(p);
        if let Some((low, high)) = field.bound(p, 1.0) {
            let value = field.value(p);
            assert!(value.is_nan() || low <= value && value <= high, "{value} at {p} outside {low} to {high}");
        }
    }
}
