//! Scene files that are wrong: every one is refused with its place, a reason and exit code 3, and none panics.

mod footprints;
mod points;
mod seen;

use organza::Error;
use organza::scene::{self, LoadOptions, MAX_SCENE_BYTES, Override, Scene};
use std::path::Path;

const SCENE: &str = r#"version = 1
[camera]
position = [0, 1, 4]
target = [0, 0, 0]
size = [8, 6]
[[light]]
kind = "point"
position = [2, 4, 1]
intensity = [20, 20, 20]
[[object]]
name = "a"
mesh = "a.ply"
material = "glass"
[[object]]
name = "b"
volume = "b.nii"
transfer = [{ value = 0, color = [1, 1, 1], extinction = 0 }, { value = 9, color = [1, 0, 0], extinction = 2.5 }]
[material.glass]
opacity = 0.3
[render]
points = { slice_thickness = "auto" }
"#;

/// As the command sees it, which knows an exit code for every error.
fn parse(file: &Path, bytes: &[u8], options: &LoadOptions) -> Result<Scene, Error> {
    Ok(scene::parse(file, bytes, options)?)
}

fn try_toml(text: &str) -> Result<Scene, Error> {
    parse(Path::new("s.toml"), text.as_bytes(), &LoadOptions::default())
}

/// The error of a scene in which `from` was replaced by `to`, as `line:column: message`, and its hint.
fn refusal(from: &str, to: &str) -> (String, String) {
    assert!(SCENE.contains(from), "{from}");
    let error = try_toml(&SCENE.replacen(from, to, 1)).expect_err(to);
    assert_eq!(error.exit_code(), 3, "{to}: {error}");
    let text = error.to_string();
    (text.strip_prefix("s.toml:").unwrap_or(&text).to_owned(), error.hint().to_owned())
}

#[track_caller]
fn refused(from: &str, to: &str, expected: &str) {
    let (message, _) = refusal(from, to);
    assert!(message.contains(expected), "{to}\n  expected: {expected}\n  found:    {message}");
}

#[test]
fn the_scene_itself_is_accepted() {
    let scene = try_toml(SCENE).unwrap();
    assert_eq!(scene.objects.len(), 2);
    assert_eq!(scene.objects[0].material, 1);
    assert_eq!(scene.materials[1].opacity, 0.3);
}

#[test]
fn bi23_unknown_keys_suggest_the_nearest() {
    let cases = [
        ("[camera]\n", "[camera]\npositon = [1,2,3]\n", "3:1: unknown key `positon`", "did you mean `position`?"),
        ("mesh = ", "mehs = ", "12:1: unknown key `mehs`", "did you mean `mesh`?"),
        ("opacity = 0.3", "opactiy = 0.3", "19:1: unknown key `opactiy`", "did you mean `opacity`?"),
        ("slice_thickness", "slice", "21:12: unknown key `slice`", "did you mean `slice_thickness`?"),
        ("slice_thickness", "shadow", "21:12: unknown key `shadow`", "it is `render.shadow` now"),
        (
            "position = [2",
            "radius = 1\nposition = [2",
            "8:1: unknown key `radius`",
            "known here: name, position, intensity, shadow, shadow_cells",
        ),
        ("[render]", "[rendr]", "20:2: unknown key `rendr`", "did you mean `render`?"),
    ];
    for (from, to, message, hint) in cases {
        assert_eq!(refusal(from, to), (message.to_owned(), hint.to_owned()));
    }
}

#[test]
fn cells_of_a_shadow_map_that_is_not_made_are_refused_or_named() {
    let light = "shadow = false\nshadow_cells = 64\nposition = [2";
    let (message, hint) = refusal("position = [2", light);
    assert_eq!(message, "9:16: `shadow_cells` beside `shadow = false`: this light has no shadow map");
    assert_eq!(hint, "leave one of them out");
    refused(
        "position = [2",
        "shadow_cells = 0\nposition = [2",
        "8:16: `shadow_cells`: expected a whole number from 1 to 16384, found 0",
    );
}

#[test]
fn bi24_wrong_types_have_a_place() {
    refused("[0, 1, 4]", "[0, 1]", "3:12: expected a list of length 3, found 2");
    refused("[0, 1, 4]", "[0, 1, 4, 5]", "3:22: expected a list of length 3, found 4 values");
    refused("[0, 1, 4]", "[0, \"1\", 4]", "3:16: expected a number, found the text \"1\"");
    refused("[0, 1, 4]", "7", "3:12: expected a list of length 3, found the number 7");
    refused("[0, 1, 4]", "1979-05-27", "3:12: expected a number, text, list or table, found the date 1979-05-27");
    refused("version = 1", "version = \"1\"", "1:11: expected a whole number from 0 to 4294967295");
    refused("version = 1", "version = 1.0", "1:11: expected a whole number from 0 to 4294967295, found the number 1");
    refused("version = 1", "version = 2", "1:11: `version`: expected 1, found 2");
    refused("name = \"a\"", "name = 5", "11:8: expected a text in quotes, found the number 5");
    refused("\"auto\"", "true", "21:30: expected a number or \"auto\", found true");
    refused("\"auto\"", "\"atuo\"", "21:30: expected a number or \"auto\", found the text \"atuo\"");
    refused("kind = \"point\"", "kind = \"pont\"", "7:8: expected one of \"point\", \"directional\"");
    refused("kind = \"point\"\n", "", "6:1: expected a key `kind`");
    refused("kind = \"point\"", "kind = 3", "7:8: expected one of \"point\"");
    refused("[render]", "[[render]]", "20:1: expected a table, found a list of 1 value");
    refused("[camera]\n", "camera = [[0, 1, 4], [0, 0, 0]]\n[material.x]\n", "2:10: expected a table, found a list");
}

#[test]
fn bi24_missing_and_duplicate_keys_have_a_place() {
    refused("version = 1\n", "", "1:1: expected a key `version` here, found none");
    refused("target = [0, 0, 0]\n", "", "2:1: expected a key `target` here, found none");
    refused("intensity = [20, 20, 20]\n", "", "6:1: expected a key `intensity` here, found none");
    refused("target = [0, 0, 0]", "target = [0, 0, 0]\ntarget = [1, 0, 0]", "5:1: not TOML: duplicate key");
    refused("[render]", "[camera]\n[render]", "20:2: not TOML: duplicate key");
    let json = br#"{"version": 1, "version": 1}"#;
    let error = parse(Path::new("s.json"), json, &LoadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "s.json:1:16: duplicate key `version`, first at line 1, column 2");
}

#[test]
fn bi24_x5_numbers_that_are_not_finite_are_refused_everywhere() {
    for number in ["nan", "inf", "-inf", "+nan", "1e999"] {
        for from in ["[0, 1, 4]", "[2, 4, 1]", "[20, 20, 20]", "0.3", "2.5", "\"auto\""] {
            let to = if from.starts_with('[') { format!("[0, {number}, 1]") } else { number.to_owned() };
            let (message, _) = refusal(from, &to);
            assert!(message.contains("finite number") || message.contains("not TOML"), "{from} {number}: {message}");
        }
    }
}

#[test]
fn sources_of_fields_are_checked_at_their_place() {
    let b = "volume = \"b.nii\"\ntransfer = [{ value = 0, color = [1, 1, 1], extinction = 0 }, \
             { value = 9, color = [1, 0, 0], extinction = 2.5 }]";
    let cases = [
        ("isosurface = { volume = \"b.nii\", levle = 3 }", "16:34: unknown key `levle`"),
        ("isosurface = { volume = \"b.nii\" }", "expected a key `level` here"),
        (
            "isosurface = { volume = \"b.nii\", level = 1, interpolation = \"cubic\" }",
            "expected one of \"trilinear\", \"catmull-rom\"",
        ),
        ("isosurface = { volume = \"b.nii\", level = 1, inside = \"up\" }", "expected one of \"above\", \"below\""),
        ("isosurface = { volume = \"../../b.nii\", level = 1 }", "lies outside the scene's root folder"),
        ("level_set = { points = \"b.ply\", tolerance = 0 }", "`tolerance`: expected a number above 0, up to 1"),
        ("slice = { volume = \"b.nii\", center = [0, 0, 0], normal = [0, 0, 1] }", "a slice needs a key `transfer`"),
        (
            "slice = { volume = \"b.nii\", center = [0, 0, 0], normal = [0, 0, 0] }\ntransfer = [{ value = 0, color = [1, 1, 1] }]",
            "`normal`: expected a direction",
        ),
        (
            "slice = { volume = \"b.nii\", center = [0, 0, 0], normal = [0, 0, 1] }\n\
             transfer = [{ value = 0, color = [1, 1, 1], extinction = 1 }]",
            "a slice has no extinction",
        ),
        (
            "isosurface = { volume = \"b.nii\", level = 1 }\nclip = [{ normal = [0, 1, 0] }]",
            "expected either `normal` and `point`, or `box`",
        ),
        (
            "isosurface = { volume = \"b.nii\", level = 1 }\nclip = [{ box = [[0, 0, 0], [1, 0, 1]] }]",
            "expected a highest corner above the lowest",
        ),
        (
            "cloud = { ellipsoids = [{ center = [0, 0, 0], radii = [1, 1, 1] }], octaves = 0, spacing = 0.1, extinction = 1 }",
            "`octaves`: expected a whole number from 1 to 16, found 0",
        ),
        (
            "cloud = { ellipsoids = [{ center = [0, 0, 0], radii = [1, 1, 1] }], frequency = 0, spacing = 0.1, extinction = 1 }",
            "`frequency`: expected a number above 0",
        ),
    ];
    for (source, expected) in cases {
        refused(b, source, expected);
    }
}

#[test]
fn values_that_a_scene_may_leave_to_the_plan_are_named_with_auto() {
    let whole = "expected a whole number or \"auto\", found";
    refused("[render]", "[render]\nantialias = \"fine\"", &format!("21:13: {whole} the text \"fine\""));
    refused("[render]", "[render]\nantialias = 2.5", &format!("21:13: {whole}"));
    refused("[render]", "[render]\nantialias = -1", &format!("21:13: {whole}"));
    let exact = "expected true, false or \"auto\", found";
    refused("slice_thickness = \"auto\"", "exact = \"yes\"", &format!("{exact} the text \"yes\""));
    refused("slice_thickness = \"auto\"", "exact = 1", &format!("{exact} the number 1"));
    refused(
        "slice_thickness = \"auto\"",
        "accumulation = \"f64\"",
        "expected one of \"auto\", \"f32\", \"f16\", found \"f64\"",
    );
}

#[test]
fn bi22_numbers_out_of_range_name_the_range() {
    refused("opacity = 0.3", "opacity = 1.0001", "19:11: `opacity`: expected a number from 0 to 1, found 1.0001");
    refused("opacity = 0.3", "color = [-1, 0, 0]", "19:10: `color`: expected numbers from 0 to 1e30, found -1");
    refused("opacity = 0.3", "medium = { asymmetry = 1 }", "`asymmetry`: expected a number between -1 and 1, found 1");
    refused("2.5", "-2.5", "`extinction`: expected a number from 0 to 1e18, found -2.5");
    refused("value = 9", "value = 0", "`value`: expected more than that of the point before, found 0");
    refused("[20, 20, 20]", "[1, 2, 1e31]", "9:20: `intensity`");
    refused("\"auto\"", "0", "21:30: `slice_thickness`: expected a number above 0");
    refused("material = \"glass\"", "footprint = 3", "`footprint`: expected an index below 3, found 3");
    refused("[render]", "[render]\nantialias = 9", "21:13: `antialias`: expected a whole number from 1 to 8, found 9");
    refused("[render]", "[render]\ntolerance = 0", "`tolerance`: expected a number above 0, at most 1, found 0");
    refused("size = [8, 6]", "size = [8, 6]\nfov_y = 180", "6:9: `fov_y`: expected degrees between 0 and 180");
    refused("target = [0, 0, 0]", "target = [0, 1, 4]", "4:10: `target`: expected another place than the position");
}

#[test]
fn bi29_impossible_resolutions_are_refused() {
    for (size, expected) in [
        ("[0, 6]", "5:9: `size`: expected 1 to 65536 pixels a side, found 0"),
        ("[8, -1]", "5:12: expected a whole number from 0 to 4294967295, found the number -1"),
        ("[2147483648, 6]", "5:9: `size`: expected 1 to 65536 pixels a side, found 2147483648"),
        ("[1000000, 1000000]", "5:9: `size`: expected 1 to 65536 pixels a side, found 1000000"),
        ("[8, 1e300]", "5:12: expected a whole number"),
    ] {
        refused("[8, 6]", size, expected);
    }
    let implicit = |n: &str| format!("implicit = {{ expression = \"x\", box = [[0,0,0],[1,1,1]], {n} }}");
    for n in ["resolution = 0", "resolution = -1", "resolution = 2147483648", "spacing = 1e-9", "spacing = 0", ""] {
        let (message, _) = refusal("mesh = \"a.ply\"", &implicit(n));
        assert!(message.starts_with("12:"), "{n}: {message}");
    }
}

#[test]
fn bi24_expression_errors_name_line_and_column_of_the_scene() {
    for (expression, expected) in [
        ("2*sine(x)", "12:30: `expression`, column 3: expected a variable, a constant or a function, found"),
        ("x + ", "12:32: `expression`, column 5: expected"),
        ("x^2 + (y", "12:36: `expression`, column 9: expected"),
        ("ü", "12:28: `expression`, column 1: expected"),
        // Written with an escape: the value's own place.
        ("x \\u002b", "12:27: `expression`, column 4: expected"),
    ] {
        for (kind, more) in [("implicit", ""), ("density ", ", extinction = 1")] {
            let rest = format!("box = [[0,0,0],[1,1,1]], spacing = 0.1{more}");
            let source = format!("{kind} = {{ expression = \"{expression}\", {rest} }}");
            let (message, hint) = refusal("mesh = \"a.ply\"", &source);
            assert!(message.starts_with(expected) && !hint.is_empty(), "{message} / {hint}");
        }
    }
    let text = "implicit = { expression = \"\"\"\nx +\n* y\"\"\", box = [[0,0,0],[1,1,1]], spacing = 0.1 }";
    let (message, _) = refusal("mesh = \"a.ply\"", text);
    assert!(message.starts_with("14:1: `expression`, column 5: "), "{message}");
}

#[test]
fn bi28_names_and_references_name_both_places() {
    refused("name = \"b\"", "name = \"a\"", "15:8: duplicate object name `a`, first at line 11, column 8");
    let (message, hint) = refusal("material = \"glass\"", "material = \"glas\"");
    assert_eq!(message, "13:12: material `glas` is not defined");
    assert_eq!(hint, "did you mean `glass`? It is defined at line 18, column 1.");
}

#[test]
fn an_object_has_exactly_one_source() {
    refused(
        "mesh = \"a.ply\"",
        "mesh = \"a.ply\"\npoints = \"a.las\"",
        "10:1: object `a`: expected exactly one source, found mesh and points",
    );
    refused("mesh = \"a.ply\"", "", "10:1: object `a`: expected exactly one source, found none");
    refused("volume = \"b.nii\"", "mesh = \"b.ply\"", "`transfer` belongs to a `volume`");
    refused("volume = \"b.nii\"", "volume = \"b.nii\"\nopacity = 0.5", "a medium has no `opacity`");
    refused(
        "volume = \"b.nii\"",
        "volume = \"b.nii\"\ncolor = [1, 0, 0]",
        "the colours of a volume are those of its `transfer`",
    );
    refused("mesh = \"a.ply\"", "mesh = \"a.ply\"\nmerge_duplicates = true", "`merge_duplicates` belongs to `points`");
}

#[test]
fn what_bounds_matter_is_checked() {
    let opacity = "opacity = 0.3";
    refused(opacity, "ior = 0", "19:7: `ior`: expected a number from 0.1 to 10, found 0");
    refused(opacity, "ior = -1.5", "`ior`: expected a number from 0.1 to 10");
    refused(opacity, "ior = nan", "19:7: expected a finite number, found nan");
    refused(opacity, "ior = 1.5\ncauchy = { a = 1.5, b = 0.004 }", "expected one of `ior` and `cauchy`, found both");
    refused(opacity, "cauchy = { a = 1.5, b = -1 }", "`b`: expected a number from 0 to 1, found -1");
    refused(opacity, "cauchy = { a = 1.5 }", "expected a key `b` here");
    refused(opacity, "absorption_inside = [0, -1, 0]", "`absorption_inside`: expected numbers from 0");
    refused(opacity, "ior = 1.5\nopacity = 1", "nothing passes a surface whose opacity is 1");
}

#[test]
fn an_environment_stands_in_the_place_of_a_colour_and_inside_the_root_folder() {
    let with = |keys: &str| format!("[background]\n{keys}\n[render]");
    let both = with("environment = \"a.hdr\"\ncolor = [1, 1, 1]");
    refused("[render]", &both, "21:15: expected one of `color` and `environment`, found both");
    for key in ["rotate", "scale"] {
        refused("[render]", &with(&format!("{key} = 1")), &format!(": `{key}` belongs to an `environment`"));
    }
    let sky = |key: &str| with(&format!("environment = \"a.hdr\"\n{key}"));
    refused("[render]", &sky("scale = -1"), "22:9: `scale`: expected a number from 0 to 1e18, found -1");
    refused("[render]", &sky("rotate = nan"), "22:10: expected a finite number, found nan");
    refused("[render]", &with("environment = \"\""), "expected a path");
    refused("[render]", "[ambient]\nenvironment = \"a.hdr\"\n[render]", "unknown key `environment`");
    let outside = with("environment = \"../../a.hdr\"");
    let error = parse(
        Path::new("/r/scenes/s.toml"),
        SCENE.replacen("[render]", &outside, 1).as_bytes(),
        &LoadOptions::default(),
    );
    assert!(error.unwrap_err().to_string().contains("lies outside the scene's root folder /r"));
    let text = SCENE.replacen("[render]", &sky("rotate = -90\nscale = 2"), 1);
    let scene = try_toml(&text).unwrap();
    let environment = scene.environment.as_ref().unwrap();
    assert_eq!((environment.turns, environment.scale), (-0.25, 2.0));
    assert_eq!(scene.files().last().unwrap(), Path::new("a.hdr"));
}

#[test]
fn bi12_data_outside_the_root_folder_is_refused() {
    for path in ["../../secret.ply", "/etc/passwd", "a/../../../b.ply"] {
        let text = SCENE.replacen("a.ply", path, 1);
        let at = |allow_path| {
            parse(Path::new("/r/scenes/s.toml"), text.as_bytes(), &LoadOptions { allow_path, ..Default::default() })
        };
        let error = at(false).unwrap_err();
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains("12:8:") && error.to_string().contains("outside"), "{error}");
        let hint = error.hint();
        assert!(
            hint.starts_with("allow it with the line root = \"/") && hint.ends_with("or with --allow-path"),
            "{hint}"
        );
        at(true).unwrap();
    }
    let inside = SCENE.replacen("a.ply", "../assets/x/../a.ply", 1);
    parse(Path::new("/r/scenes/s.toml"), inside.as_bytes(), &LoadOptions::default()).unwrap();
    refused("a.ply", "http://example.org/a.ply", "expected a path, found the address");
    refused("a.ply", "a\\u0000b", "expected a path");
    refused("a.ply", "", "expected a path");
}

#[cfg(unix)]
#[test]
fn bi12_a_link_that_leads_outside_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("project");
    std::fs::create_dir_all(root.join("scenes")).unwrap();
    std::fs::write(folder.path().join("secret.ply"), "x").unwrap();
    std::os::unix::fs::symlink("../../secret.ply", root.join("scenes/a.ply")).unwrap();
    let error = parse(&root.join("scenes/s.toml"), SCENE.as_bytes(), &LoadOptions::default()).unwrap_err();
    assert!(error.to_string().contains("outside"), "{error}");
}

#[test]
fn bi25_deep_nesting_is_refused_without_overflow() {
    let deep = 100_000;
    let dotted = format!("{}x = 1", "a.".repeat(deep));
    let header = format!("[{}x]", "a.".repeat(deep));
    let lists = format!("a = {}{}", "[".repeat(deep), "]".repeat(deep));
    let tables = format!("a = {}", "{ a = ".repeat(deep));
    for text in [dotted, header, lists, tables] {
        assert_eq!(try_toml(&text).unwrap_err().exit_code(), 3);
    }
    for text in ["[".repeat(deep), "{\"a\":".repeat(deep)] {
        let error = parse(Path::new("s.json"), text.as_bytes(), &LoadOptions::default()).unwrap_err();
        assert!(error.to_string().contains("at most 64 levels of nesting"), "{error}");
    }
    // A long expression in dotted numbers is not nesting.
    let expression = vec!["0.1*x"; 200].join("+");
    let implicit = format!("implicit = {{ expression = \"{expression}\", box = [[0,0,0],[1,1,1]], spacing = 0.1 }}");
    try_toml(&SCENE.replacen("mesh = \"a.ply\"", &implicit, 1)).unwrap();
}

#[test]
fn bi26_a_scene_of_a_million_lights_is_a_limit() {
    let light = "{\"kind\":\"point\",\"position\":[0,0,0],\"intensity\":[1,1,1]}";
    let text = format!("{{\"version\":1,\"light\":[{}]}}", vec![light; 1_000_000].join(","));
    assert!(text.len() as u64 > MAX_SCENE_BYTES);
    let error = parse(Path::new("s.json"), text.as_bytes(), &LoadOptions::default()).unwrap_err();
    assert_eq!(error.exit_code(), 5);
}

#[test]
fn bi8_line_endings_and_byte_order_mark_are_accepted() {
    let plain = try_toml(SCENE).unwrap();
    for text in [SCENE.replace('\n', "\r\n"), format!("\u{feff}{SCENE}"), SCENE.replace("\n", "\n\t\n")] {
        let mut scene = try_toml(&text).unwrap();
        assert_ne!(scene.sha256, plain.sha256);
        scene.sha256.clone_from(&plain.sha256);
        assert_eq!(scene, plain);
    }
    let error = parse(Path::new("s.toml"), b"version = 1\n\xff", &LoadOptions::default()).unwrap_err();
    assert_eq!(error.to_string(), "s.toml:2:1: expected UTF-8, found the byte 0xff");
}

const AS_JSON: &str = r#"{"version":1,"camera":{"position":[0,1,4],"target":[0,0,0],"size":[8,6]},
"light":[{"kind":"point","position":[2,4,1],"intensity":[20,20,20]}],
"object":[{"name":"a","mesh":"a.ply","material":"glass"},{"name":"b","volume":"b.nii","transfer":
[{"value":0,"color":[1,1,1],"extinction":0},{"value":9,"color":[1,0,0],"extinction":2.5}]}],
"material":{"glass":{"opacity":0.3}},"render":{"points":{"slice_thickness":"auto"}}}"#;

#[test]
fn json_and_toml_are_one_schema() {
    let toml = try_toml(SCENE).unwrap();
    let mut json = parse(Path::new("s.json"), AS_JSON.as_bytes(), &LoadOptions::default()).unwrap();
    json.sha256.clone_from(&toml.sha256);
    json.file.clone_from(&toml.file);
    assert_eq!(json, toml);
}

/// A damaged scene is either still a scene or a scene error.
fn accept_or_refuse(file: &str, bytes: &[u8]) -> bool {
    match parse(Path::new(file), bytes, &LoadOptions::default()) {
        Ok(_) => true,
        Err(error) => {
            assert_eq!(error.exit_code(), 3, "{error}");
            assert!(matches!(error, Error::Scene(scene::Error::Scene { line: 1.., column: 1.., .. })), "{error:?}");
            false
        }
    }
}

#[test]
fn every_truncation_is_a_scene_or_a_scene_error() {
    for (file, text) in [("s.toml", SCENE), ("s.json", AS_JSON)] {
        let accepted = (0..=text.len()).filter(|n| accept_or_refuse(file, &text.as_bytes()[..*n])).count();
        // TOML has optional ends, such as the last table; JSON has none.
        assert!(accepted > 0 && (file == "s.toml" || accepted == 1), "{file}: {accepted}");
    }
}

#[test]
fn every_bit_flip_is_a_scene_or_a_scene_error() {
    for (file, text) in [("s.toml", SCENE), ("s.json", AS_JSON)] {
        let mut bytes = text.as_bytes().to_vec();
        let mut accepted = 0;
        for i in 0..bytes.len() * 8 {
            bytes[i / 8] ^= 1 << (i % 8);
            accepted += usize::from(accept_or_refuse(file, &bytes));
            bytes[i / 8] ^= 1 << (i % 8);
        }
        assert!(accepted > 0 && accepted < bytes.len() * 8, "{file}: {accepted}");
    }
}

#[test]
fn overrides_change_the_scene_and_are_to_blame_for_their_errors() {
    let with = |set: &str| {
        let overrides = vec![Override::parse(set)?];
        parse(Path::new("s.toml"), SCENE.as_bytes(), &LoadOptions { overrides, ..Default::default() })
    };
    assert!(with("render.points.exact=true").unwrap().render.points.exact);
    assert_eq!(with("render.points.slice_thickness = 0.5").unwrap().render.points.slice_thickness, Some(0.5));
    assert_eq!(with("object.a.opacity=0.25").unwrap().objects[0].opacity, Some(0.25));
    assert_eq!(with("light.0.intensity=[1, 2, 3]").unwrap().lights[0].light.intensity, [1.0, 2.0, 3.0]);
    assert_eq!(with("material.glass.shading=phase").unwrap().materials[1].opacity, 0.3);
    assert_ne!(with("render.seed=1").unwrap().sha256, try_toml(SCENE).unwrap().sha256);
    for bad in [
        "render.points.exact",
        "=1",
        "render..exact=true",
        "render.points.exact=",
        "render.points.exakt=true",
        "render.points.exact=1",
        "render.tolerance=nan",
        "render.tolerance=-nan",
        "object.c.opacity=1",
        "object.2.opacity=1",
        "version.x=1",
        "camera.size=[0, 0]",
    ] {
        assert_eq!(with(bad).unwrap_err().exit_code(), 2, "{bad}");
    }
    assert_eq!(
        with("render.points.exakt=true").unwrap_err().to_string(),
        "--set render.points.exakt=true: unknown key `exakt`"
    );
}

#[test]
fn bi1_what_is_no_file_is_a_file_system_error() {
    for path in ["/nowhere/s.toml", "/", "/dev/zero"] {
        assert_eq!(
            Error::from(scene::load(Path::new(path), &LoadOptions::default()).unwrap_err()).exit_code(),
            4,
            "{path}"
        );
    }
}

const DOCUMENT: &str = include_str!("../../docs/scene.md");

#[test]
fn the_documents_example_is_a_scene() {
    let example = DOCUMENT.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let scene = parse(Path::new("/r/scenes/s.toml"), example.as_bytes(), &LoadOptions::default()).unwrap();
    assert_eq!((scene.lights.len(), scene.objects.len(), scene.materials.len()), (2, 7, 3));
}

#[test]
fn every_key_of_the_schema_is_documented() {
    fn keys(schema: &serde_json::Value, found: &mut Vec<String>) {
        match schema {
            serde_json::Value::Object(fields) => {
                if let Some(serde_json::Value::Object(properties)) = fields.get("properties") {
                    found.extend(properties.keys().cloned());
                }
                fields.values().for_each(|v| keys(v, found));
            }
            serde_json::Value::Array(items) => items.iter().for_each(|v| keys(v, found)),
            _ => {}
        }
    }
    let schema = serde_json::from_str(&organza::scene::schema()).unwrap();
    let mut found = Vec::new();
    keys(&schema, &mut found);
    assert!(found.len() > 90, "{}", found.len());
    let undocumented: Vec<&String> = found.iter().filter(|key| !DOCUMENT.contains(key.as_str())).collect();
    assert!(undocumented.is_empty(), "{undocumented:?}");
}
