//! What the fuzz targets do with their bytes: read them as a file, a scene, a transfer function or a formula. Whatever they
//! are, it ends, in an error or in something valid, within the memory that was allowed.
#![forbid(unsafe_code)]

/// Right sums for pages of E57, which would tell nearly all damage before anything else is looked at.
#[path = "../../crates/convert/tests/read_samples/e57.rs"]
#[allow(dead_code, reason = "the sample itself is a seed already")]
mod e57;

use convert::ExpressionField;
use convert::read::{Loaded, ReadParams, bytes, panic_is_input_error};
use organza_scene::LoadOptions;
use splat_core::glam::DVec3;
use splat_core::{MemoryAccount, ScalarField};
use std::path::Path;
use std::sync::Once;

/// Bytes that a file and what is made of it may each take.
const MEMORY: u64 = 64 << 20;

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
    // Levels of detail are looked at where there are some.
    let most_points = Some(16);
    let params = ReadParams { memory: MemoryAccount::new(MEMORY), most_points, ranges: true, ..ReadParams::default() };
    let Ok((loaded, _)) = bytes(name, data, &params, None) else { return };
    let valid = match &loaded {
        Loaded::Mesh(mesh) => mesh.validate(),
        Loaded::Points(points) => points.validate(),
        // Voxels may be NaN, which draws nothing.
        Loaded::Grid(grid) => convert::gaps_of_value(grid, 0.0).as_ref().unwrap_or(grid).validate(),
        Loaded::Image(image) => image.validate(),
        _ => panic!("a kind that is not checked"),
    };
    valid.expect("what was read is valid");
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
