//! What the command says of the files that it reads, and how colours of photographs are drawn.

use organza_tests::{draw_in, mean_and_ripple, organza, parallel_view, window};
use serde_json::{Value, json};
use std::fs;
use std::path::Path;
use std::process::Output;

/// A wall of points of one grey, and a column that nobody asks for.
fn wall(names: &str) -> String {
    let mut text = format!("{names}\n");
    for i in 0..80 * 80 {
        text += &format!("{},{},0,128,128,128,{i}\n", (i % 80) as f64 / 20.0 - 2.0, (i / 80) as f64 / 20.0 - 2.0);
    }
    text
}

/// The wall in a world without light.
fn scene(more: &str) -> String {
    format!("{}[[object]]\nname = 'wall'\npoints = 'wall.csv'\n{more}", parallel_view(2.0, 16))
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    organza().current_dir(folder).args(arguments).output().unwrap()
}

fn errors(out: &Output) -> String {
    String::from_utf8_lossy(&out.stderr).into_owned()
}

/// They were lit a second time: here, where there is no light, they were black.
#[test]
fn points_with_colours_are_drawn_as_they_are_unless_the_scene_names_a_material() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("wall.csv"), wall("x,y,z,red,green,blue,time")).unwrap();
    let grey = ((128.0f64 / 255.0 + 0.055) / 1.055).powf(2.4);
    let drawn = |more: &str, arguments: &[&str]| {
        let picture = draw_in(folder.path(), &scene(more), arguments);
        mean_and_ripple(&window(&picture.channel("G"), 16, 2..14, 2..14))
    };
    for technique in ["points", "particles"] {
        let (mean, ripple) = drawn("", &["--technique", technique]);
        assert!((mean - grey).abs() < 1e-6 && ripple < 1e-6, "{technique}: {mean} of {grey}, ripple {ripple}");
        for more in ["material = 'paint'\n[material.paint]\n", "color = [1, 1, 1]\n"] {
            assert_eq!(drawn(more, &["--technique", technique]).0, 0.0, "{technique}: {more}");
        }
    }
    // A file without colours is lit.
    fs::write(folder.path().join("wall.csv"), wall("x,y,z,a,b,c,time")).unwrap();
    assert_eq!(drawn("", &[]).0, 0.0);
}

#[test]
fn columns_that_are_not_used_are_named_once() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("wall.csv"), wall("x,y,z,red,green,intensity,time")).unwrap();
    fs::write(folder.path().join("s.toml"), scene("[[object]]\nname = 'again'\npoints = 'wall.csv'\n")).unwrap();
    let out = run(folder.path(), &["render", "s.toml", "--json"]);
    assert!(out.status.success(), "{}", errors(&out));
    let said: Vec<String> = errors(&out).lines().filter(|l| l.contains("not used")).map(str::to_owned).collect();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].starts_with("note: ") && said[0].ends_with("wall.csv: not used: red, green, time, intensity"));
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(document["notes"].as_array().unwrap().len(), 1);
    assert!(!document["warnings"].to_string().contains("not used"));
    let explained = run(folder.path(), &["explain", "s.toml"]);
    assert!(errors(&explained).contains("not used: red, green, time, intensity"), "{}", errors(&explained));
    let info: Value = serde_json::from_slice(&run(folder.path(), &["info", "wall.csv", "--json"]).stdout).unwrap();
    // A scene may ask for any of them.
    assert_eq!(info["not_used"], json!([]));
    assert!(["red", "green", "time"].iter().all(|name| info["columns"][name].is_array()), "{info}");
    assert_eq!(info["attributes"], json!(["intensity"]));
    assert_eq!(info["remarks"], json!([]));
}

#[test]
fn info_says_what_becomes_of_colours_and_of_spaces() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("wall.csv"), wall("x,y,z,red,green,blue,time")).unwrap();
    let volume = "NRRD0004\ntype: uchar\ndimension: 3\nspace: LPS\nsizes: 1 1 1\n\
        space directions: (1,0,0) (0,1,0) (0,0,1)\nencoding: raw\n\nx";
    fs::write(folder.path().join("a.nrrd"), volume).unwrap();
    let remarks = |name: &str| {
        let document: Value = serde_json::from_slice(&run(folder.path(), &["info", name, "--json"]).stdout).unwrap();
        document["remarks"].clone()
    };
    assert_eq!(
        remarks("wall.csv"),
        json!(["colours are drawn as they are, without light, unless the scene names a material"])
    );
    assert_eq!(remarks("a.nrrd"), json!(["space: left-posterior-superior, converted to right-anterior-superior"]));
}

#[test]
fn the_frame_of_a_series_is_told_and_one_that_is_not_there_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let series =
        "NRRD0004\ntype: uchar\ndimension: 4\nsizes: 1 1 1 2\nkinds: space space space time\nencoding: raw\n\nxy";
    fs::write(folder.path().join("a.nrrd"), series).unwrap();
    let info: Value = serde_json::from_slice(&run(folder.path(), &["info", "a.nrrd", "--json"]).stdout).unwrap();
    assert_eq!(info["remarks"], json!(["frame 0 of 2; `frame` chooses another"]));
    let transfer =
        "[{ value = 0, color = [1, 1, 1], extinction = 0 }, { value = 200, color = [1, 1, 1], extinction = 1 }]";
    let object = format!("[[object]]\nname = 'it'\nvolume = 'a.nrrd'\ntransfer = {transfer}\n");
    fs::write(folder.path().join("s.toml"), parallel_view(2.0, 16) + &object).unwrap();
    let told = run(folder.path(), &["explain", "s.toml", "--set", "object.it.frame=1"]);
    assert!(errors(&told).contains("a.nrrd: frame 1 of 2; `frame` chooses another"), "{}", errors(&told));
    let refused = run(folder.path(), &["render", "s.toml", "--set", "object.it.frame=2"]);
    assert_eq!(refused.status.code(), Some(3));
    assert!(
        errors(&refused).contains("expected a `frame` from 0 to 1, as the file has 2 volumes"),
        "{}",
        errors(&refused)
    );
}

#[test]
fn exit_3_gaussians_without_a_rotation_are_refused_where_it_should_stand() {
    let folder = tempfile::tempdir().unwrap();
    let names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2", "rot_0"];
    let properties: String = names.iter().map(|n| format!("property float {n}\n")).collect();
    let text = format!("ply\nformat ascii 1.0\nelement vertex 1\n{properties}end_header\n{}\n", "0 ".repeat(11));
    fs::write(folder.path().join("wall.csv"), text).unwrap();
    fs::write(folder.path().join("s.toml"), scene("")).unwrap();
    for arguments in [["render", "s.toml"], ["info", "wall.csv"]] {
        let out = run(folder.path(), &arguments);
        assert_eq!(out.status.code(), Some(3));
        assert!(errors(&out).contains("wall.csv:3: expected a property 'rot_1' of 'vertex', found none"));
    }
}

/// The message named the object, and `scene` where the file should stand.
#[test]
fn errors_of_conversions_name_the_file_and_the_object() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("two.xyz"), "0 0 0\n1 0 0\n").unwrap();
    let text = format!("{}[[object]]\nname = 'skin'\nlevel_set = {{ points = 'two.xyz' }}\n", parallel_view(2.0, 16));
    fs::write(folder.path().join("s.toml"), text).unwrap();
    let out = run(folder.path(), &["render", "s.toml"]);
    assert_eq!(out.status.code(), Some(3), "{}", errors(&out));
    assert!(errors(&out).contains("two.xyz: object 'skin': "), "{}", errors(&out));
}
