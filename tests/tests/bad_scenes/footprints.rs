//! Footprints: lists, images and choices that are refused.

use super::{SCENE, parse, refused};
use image::{GrayImage, Luma};
use organza::scene::LoadOptions;

#[test]
fn lists_and_choices_are_checked() {
    let listed =
        |list: &str, expected: &str| refused("version = 1", &format!("version = 1\nfootprints = {list}"), expected);
    listed("[]", "expected 1 to 256 footprints, found 0");
    listed("[3, 9]", "2:18: expected a number from 1 to 8, found 9");
    listed("[\"leaf.png\"]", "expected a number or a table, found the text");
    listed("[{ cutoff = 3 }]", "2:15: expected one of `image` and `images`, found none");
    listed("[{ image = \"a.png\", images = \"b\" }]", "expected one of `image` and `images`, found both");
    listed("[{ image = \"a.png\", size = 3 }]", "unknown key `size`");
    listed("[{ image = \"a.png\", cutoff = 0.5 }]", "expected a number from 1 to 8, found 0.5");
    listed("[{ image = \"nowhere.png\" }]", "2:25: nowhere.png");
    listed("[{ images = \"nowhere\" }]", "\"nowhere\" cannot be listed");
    listed("[{ image = \"/etc/a.png\" }]", "lies outside the scene's root folder");
    let chosen = |choice: &str, expected: &str| {
        refused("material = \"glass\"", &format!("material = \"glass\"\nfootprint = {choice}"), expected);
    };
    chosen("-1", "`footprint`: expected an index below 3, found -1");
    chosen("0.5", "`footprint`: expected an index below 3, found 0.5");
    chosen("{ of = [0, 3] }", "`footprint`: expected an index below 3, found 3");
    chosen("{ of = [] }", "`of`: expected 1 to 256 footprints");
    chosen("{ of = [0, 1], turn = 10 }", "`turn` belongs to footprints that are images");
    chosen("{ of = [1], seed = 7 }", "`seed` is of what is chosen by chance, and there is one footprint and no turn");
    refused("opacity = 0.3", "footprint = 3", "`footprint`: expected an index below 3, found 3");
}

#[test]
fn images_are_read_and_refused_with_file_key_and_hint() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    GrayImage::from_pixel(4, 4, Luma([9])).save(path("grey.png")).unwrap();
    GrayImage::new(4, 4).save(path("black.png")).unwrap();
    GrayImage::from_pixel(4097, 1, Luma([9])).save(path("wide.png")).unwrap();
    for (name, bytes) in
        [("text.png", &b"no image"[..]), ("text", b"no image"), ("leaf.png.ply", b"ply\n"), ("leaf", b"\xff\xd8\xff")]
    {
        std::fs::write(path(name), bytes).unwrap();
    }
    std::fs::create_dir(path("none")).unwrap();
    std::fs::create_dir(path("some")).unwrap();
    std::fs::copy(path("grey.png"), path("some/b.png")).unwrap();
    std::fs::copy(path("grey.png"), path("some/a.PNG")).unwrap();
    let file = path("s.toml");
    let parsed = |list: &str, more: &str| {
        let text = SCENE.replacen("version = 1", &format!("version = 1\nfootprints = {list}"), 1);
        parse(
            &file,
            text.replacen("volume = \"b.nii\"", &format!("volume = \"b.nii\"\n{more}"), 1).as_bytes(),
            &LoadOptions::default(),
        )
    };
    for (list, more, expected, hint) in [
        ("[{ image = \"black.png\" }]", "", "black.png has no pixel above 0", "alpha"),
        ("[{ image = \"wide.png\" }]", "", "wide.png has 4097 x 1 pixels", "make it smaller"),
        ("[{ image = \"text.png\" }]", "", "text.png", ""),
        ("[{ image = \"text\" }]", "", "text: expected a PNG or OpenEXR image, found a text of a format", "as PNG"),
        (
            "[{ image = \"leaf.png.ply\" }]",
            "",
            "expected a PNG or OpenEXR image, found a file that is read as Ply",
            "as PNG",
        ),
        ("[{ image = \"leaf\" }]", "", "leaf: expected a PNG or OpenEXR image, found a JPEG image", "as PNG"),
        ("[{ images = \"none\" }]", "", "expected a folder with PNG or OpenEXR images, found none in \"none\"", ".png"),
        ("[{ image = \"s.toml\" }]", "", "s.toml", ""),
        ("[3, { image = \"grey.png\" }]", "footprint = 1", "a medium has no image as a footprint", "a formula"),
    ] {
        let error = parsed(list, more).expect_err(list);
        assert_eq!(error.exit_code(), 3, "{error}");
        assert!(error.to_string().contains(expected) && error.hint().contains(hint), "{error}\n{}", error.hint());
    }
    // The folder's images follow one another by name, whatever the case of their endings.
    let scene = parsed("[3, { images = \"some\" }, 2]", "").unwrap();
    assert_eq!(scene.footprints.layers().iter().map(|l| l.cutoff).collect::<Vec<_>>(), [3.0, 3.0, 3.0, 2.0]);
    let named: Vec<_> = scene.footprint_files.iter().map(|path| path.file_name().unwrap()).collect();
    assert_eq!(named, ["a.PNG", "b.png"]);
    assert!((0..4).map(|id| scene.footprints.image(id).is_some()).eq([false, true, true, false]));
    assert!(scene.files().ends_with(&scene.footprint_files));
}
