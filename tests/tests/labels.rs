//! Volumes of labels by tables of their names, colours and opacities, and the size of voxels, through the whole command.

use organza_tests::Place;

/// A ball of label 3 in one of label 9, and a box of 4 beside them.
fn place() -> Place {
    let place = Place::new("");
    let label = |k: i32| {
        let [x, y, z] = [k % 24, k / 24 % 16, k / 384];
        let square = (x - 8).pow(2) + (y - 8).pow(2) + (z - 8).pow(2);
        match () {
            () if square < 12 => 3,
            () if square < 45 => 9,
            () if (18..22).contains(&x) && (5..11).contains(&y) && (5..11).contains(&z) => 4,
            () => 0,
        }
    };
    let text = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 24 16 16\nencoding: ascii\n\n".to_owned();
    place.write("seg.nrrd", text + &(0..24 * 256).map(|k| format!("{}\n", label(k))).collect::<String>());
    place.write(
        "all.ctbl",
        "# names\n0 Background 0 0 0 0\n3 core 255 0 0 255\n4 box 0 0 255 255\n9 skin 0 255 0 255\n",
    );
    place.write("inner.ctbl", "3 core 255 0 0 255\n4 box 0 0 255 255\n9 skin 0 255 0 0\n");
    place.write("clear.txt", "3 255 0 0 1 1 1 \"core\"\n4 0 0 255 1 1 1 \"box\"\n9 0 255 0 0.2 1 1 \"skin\"\n");
    place.write("names.toml", "3 = \"core\"\n[9]\nname = \"skin\"\nvisible = false\n");
    place
}

/// How many pixels of a picture are mostly red, green and blue.
fn hues(place: &Place, name: &str) -> [usize; 3] {
    let picture = place.pixels(name).to_rgb8();
    let count = |c: usize| {
        let most =
            |p: &&image::Rgb<u8>| (0..3).all(|other| other == c || u16::from(p.0[c]) > 2 * u16::from(p.0[other]) + 20);
        picture.pixels().filter(most).count()
    };
    [0, 1, 2].map(count)
}

#[test]
fn a_table_colours_labels_hides_them_and_makes_them_translucent() {
    let place = place();
    let drawn = |table: &str, name: &str| {
        let render = ["render", "seg.nrrd", "--labels", table, "--size", "160x120", "-o", name];
        let out = place.expect(0, &render, "");
        (hues(&place, name), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let ([red, green, blue], _) = drawn("all.ctbl", "all.png");
    assert!(red == 0 && green > 500 && blue > 200, "{red} {green} {blue}");
    let ([red, green, blue], said) = drawn("inner.ctbl", "inner.png");
    assert!(red > 200 && green == 0 && blue > 200, "{red} {green} {blue}");
    assert!(said.contains("seg.nrrd: hidden by the table of labels: 9"), "{said}");
    let (_, said) = drawn("names.toml", "names.png");
    assert!(said.contains("not in the table of labels, so in colours in turns: 4"), "{said}");
    // The core is seen through the skin.
    drawn("clear.txt", "clear.png");
    let [clear, opaque] = ["clear.png", "all.png"].map(|name| place.pixels(name).to_rgb8());
    let brighter = clear.pixels().zip(opaque.pixels()).filter(|(a, b)| a.0[0] > b.0[0] + 20);
    assert!(brighter.count() > 200);
}

#[test]
fn names_stand_in_legends_and_in_what_info_says() {
    let place = place();
    let out = place.expect(0, &["info", "seg.nrrd", "--labels", "inner.ctbl"], "");
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    for line in
        ["label       3 core: 171 voxels", "label       4 box: 144 voxels", "label       9 skin: 1,066 voxels, hidden"]
    {
        assert!(text.contains(line), "{text}");
    }
    let out = place.expect(0, &["info", "seg.nrrd", "--json", "--labels", "names.toml"], "");
    let document: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(document["labels"][0], serde_json::json!({ "number": 3, "name": "core", "voxels": 171 }));
    // With names a legend is wider.
    for (table, name) in [("all.ctbl", "with.png"), ("names.toml", "without.png")] {
        place.expect(0, &["render", "seg.nrrd", "--labels", table, "--legend", "--size", "320x240", "-o", name], "");
    }
    assert!(place.bytes("with.png") != place.bytes("without.png"));
}

#[test]
fn wrong_tables_are_refused_with_their_place() {
    let place = place();
    place.write("bad.ctbl", "3 core 255 0 0 255\n4 box 0 0 300 255\n");
    place.write("bad.toml", "three = \"core\"\n");
    place.write("key.toml", "3 = { nam = \"core\" }\n");
    place.write("hidden.toml", "3 = { visible = false }\n4 = { visible = false }\n9 = { opacity = 0 }\n");
    place.write(
        "scan.nrrd",
        "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: ascii\n\n0\n.5\n1\n2\n3\n4\n5\n6\n",
    );
    place.write("plain.toml", "version = 1\ncamera = \"auto\"\n[[object]]\nname = \"a\"\nvolume = \"seg.nrrd\"\nlabels = \"all.ctbl\"\ntransfer = [{ value = 0, color = [1, 1, 1], extinction = 1 }]\n");
    for (code, file, table, said) in [
        (3, "seg.nrrd", "bad.ctbl", "bad.ctbl:2:11: expected a number from 0 to 255, found '300'"),
        (
            3,
            "seg.nrrd",
            "bad.toml",
            "bad.toml:1:9: expected the number of a label, whole, from 0 to 16777216, found `three`",
        ),
        (3, "seg.nrrd", "key.toml", "key.toml:1:7: unknown key `nam`"),
        (
            4,
            "seg.nrrd",
            "missing.lut",
            "missing.lut: cannot read the table of labels: expected a file, found no such file",
        ),
        (3, "seg.nrrd", "seg.nrrd", "expected `number name R G B A`"),
        (3, "seg.nrrd", "hidden.toml", "expected a label that is shown, found none: all are hidden"),
        (2, "scan.nrrd", "all.ctbl", "--labels all.ctbl: no file is a volume of labels"),
    ] {
        place.expect(code, &["render", file, "--labels", table, "-o", "a.png"], said);
    }
    place.expect(3, &["render", "plain.toml", "-o", "a.png"], "`labels` belongs to a `mesh` of a volume of labels");
    let scene = ["render", "plain.toml", "--labels", "all.ctbl", "-o", "a.png"];
    place.expect(2, &scene, "--labels is for data files, and a scene is given");
    assert!(!place.made().contains(&"a.png".to_owned()));
}

#[test]
fn a_size_of_voxels_takes_the_place_of_the_file_s() {
    let place = place();
    place.expect(0, &["init", "seg.nrrd", "--labels", "all.ctbl", "-o", "s2.toml"], "");
    let text = String::from_utf8(place.bytes("s2.toml")).unwrap();
    assert!(text.contains("labels = \"all.ctbl\""), "{text}");
    place.write("s2.toml", text.replace("labels = ", "voxel_size = [1, 1, 3]\nlabels = "));
    let out = place.expect(0, &["render", "s2.toml", "-o", "deep.png", "--size", "160x120"], "");
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(said.contains("voxels of 1 x 1 x 3 by `voxel_size`, in the place of 1 x 1 x 1"), "{said}");
    let wrong = ["render", "s2.toml", "-o", "a.png", "--set", "object.0.voxel_size=[1, 0, 1]"];
    place.expect(2, &wrong, "`voxel_size`: expected three numbers above 0");
}
