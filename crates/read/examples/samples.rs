//! `cargo run -p organza-read --example samples -- FOLDER`: writes a small file of each format and kind into `FOLDER/FEATURE/`, as seeds of
//! fuzzing.
#![allow(clippy::unwrap_used, reason = "what is made in memory is well formed")]

#[path = "../tests/every_sample.rs"]
mod every_sample;
#[path = "../tests/read_samples/mod.rs"]
mod read_samples;

use std::path::Path;

/// The feature whose reader reads a file of this name.
fn feature(name: &str) -> &str {
    match name.strip_suffix(".gz").unwrap_or(name).rsplit_once('.').unwrap().1 {
        "csv" => "xyz",
        "glb" => "gltf",
        "laz" => "las",
        "mha" => "metaimage",
        "nii" => "nifti",
        "tif" => "tiff",
        "vtp" | "vtu" => "vti",
        extension => extension,
    }
}

fn main() -> std::io::Result<()> {
    let Some(folder) = std::env::args_os().nth(1) else {
        return Err(std::io::Error::other("usage: samples FOLDER"));
    };
    let textured = every_sample::textured().into_iter().map(|(name, content, _)| (name, content));
    let square = ("text.gltf", read_samples::square_gltf());
    let files = every_sample::samples().into_iter().chain(every_sample::text_samples());
    let files = files.chain(every_sample::bodies()).chain(textured).chain([square]);
    for (name, content) in files {
        let folder = Path::new(&folder).join(feature(name));
        std::fs::create_dir_all(&folder)?;
        std::fs::write(folder.join(name), content)?;
    }
    Ok(())
}
