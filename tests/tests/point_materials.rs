//! Materials by a column, and values that are written: drawn, converted, read again and coloured anew.

use organza_tests::{Place, largest_difference, picture_of};
use std::fmt::Write as _;

const HEAD: &str = "version = 1\n[camera]\nposition = [0.3, 0.2, 4]\ntarget = [0, 0, 0]\nsize = [40, 30]\n\
    [background]\ncolor = [0.1, 0.2, 0.3]\n[ambient]\ncolor = [0.2, 0.2, 0.2]\n\
    [[light]]\nkind = 'point'\nposition = [2, 3, 4]\nintensity = [40, 38, 35]\n\
    [material.clay]\ncolor = [0.8, 0.3, 0.1]\nspecular = 0.5\n[material.glass]\ncolor = [0.2, 0.4, 0.9]\nopacity = 0.4\n\
    [[object]]\nname = 'wall'\n";

fn place(columns: &str) -> Place {
    let mut text = format!("x,y,z,{columns}\n");
    for i in 0..400 {
        let x = f64::from(i % 20) * 0.1 - 1.0;
        let y = f64::from(i / 20) * 0.1 - 1.0;
        writeln!(text, "{x:.2},{y:.2},0,{},{}", u8::from(x + y > 0.05), i % 20 + 2 * (i / 20)).unwrap();
    }
    let place = Place::new(&format!("{HEAD}points = 'wall.csv'\nmaterials = ['glass', 'clay']\n"));
    place.write("wall.csv", text);
    place
}

#[test]
fn materials_and_values_of_points_survive_their_file() {
    let place = place("material,heat");
    let draw = |scene: &str, more: &[&str]| {
        place.expect(0, &[&["render", scene, "-o", "a.exr", "--force"], more].concat(), "");
        picture_of(&place.path("a.exr"))
    };
    let both = draw("s.toml", &[]);
    for one in ["object.wall.materials=['glass']", "object.wall.materials=['clay', 'clay']"] {
        if one.contains("'glass']") {
            place.expect(3, &["render", "s.toml", "-o", "b.exr", "--set", one], "1 in the column `material` of point");
        } else {
            let other = draw("s.toml", &["--set", one]);
            assert!(largest_difference(&both.channel("R"), &other.channel("R")) > 0.1);
        }
    }
    // The list of a file of splats is by the ids that its comments name: 0 is the default material.
    place.expect(0, &["convert", "s.toml", "-o", "splats.ply"], "");
    let head = String::from_utf8_lossy(&place.bytes("splats.ply")[..2000]).into_owned();
    assert!(head.contains("comment material 1: clay\ncomment material 2: glass\n"), "{head}");
    place.write("again.toml", format!("{HEAD}points = 'splats.ply'\nmaterials = ['clay', 'clay', 'glass']\n"));
    assert!(draw("again.toml", &[]) == both);
    // A value that colours come from is kept, and classified anew it has the colours that the column itself has.
    let by = |column: &str, map: &str| format!("object.wall.color_by={{column='{column}', map='{map}'}}");
    place.expect(0, &["convert", "s.toml", "-o", "hot.ply", "--set", &by("heat", "viridis")], "");
    place.write("hot.toml", format!("{HEAD}points = 'hot.ply'\nmaterials = ['clay', 'clay', 'glass']\n"));
    let anew = draw("hot.toml", &["--set", &by("value", "turbo")]);
    assert!(anew == draw("s.toml", &["--set", &by("heat", "turbo")]));
    assert!(anew != draw("hot.toml", &[]));
}

#[test]
fn a_list_without_its_column_and_a_column_without_its_list_are_named() {
    let place_of_columns = place("stuff,heat");
    place_of_columns.expect(
        3,
        &["render", "s.toml", "-o", "a.exr"],
        "materials is a file without such a column, expected one with",
    );
    let place_of_columns = place("material,heat");
    place_of_columns.write("s.toml", format!("{HEAD}points = 'wall.csv'\nmaterial = 'clay'\n"));
    place_of_columns.expect(
        0,
        &["render", "s.toml", "-o", "a.exr"],
        "`material` of the file is not used: the object has one",
    );
}
