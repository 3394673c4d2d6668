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
    assert!(said.contains("not in the table of labels, so in colours of their numbers: 4"), "{said}");
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
fn labels_lie_in_the_intensities_beside_them_or_show_them() {
    let place = place();
    let header = "NRRD0004\ntype: float\ndimension: 3\nsizes: 24 16 16\nencoding: ascii\n\n".to_owned();
    place.write("scan.nrrd", header + &(0..24 * 256).map(|k| format!("{}\n", k % 24)).collect::<String>());
    let scene = |objects: &str| {
        format!(
            "version = 1\n[camera]\nauto = true\nsize = [96, 72]\n[[light]]\nkind = 'directional'\ndirection = [1, -1, -1]\nirradiance = [3, 3, 3]\n{objects}"
        )
    };
    let regions = "[[object]]\nname = 'regions'\nmesh = 'seg.nrrd'\nlabels = { 3 = 'core', 4 = { color = '#0000ff', opacity = 0.5 }, 9 = { visible = false } }\n";
    let scan = "[[object]]\nname = 'scan'\nvolume = 'scan.nrrd'\nunit_length = 10\ntransfer = [{ value = 0, color = [0.4, 0.4, 0.4], opacity = 0 }, { value = 23, color = [1, 1, 1], opacity = 0.3 }]\n";
    let field = "[[object]]\nname = 'shown'\nmesh = 'seg.nrrd'\nfield = { volume = 'scan.nrrd' }\ntransfer = [{ value = 9, color = [1, 0, 0] }, { value = 16, color = [0, 0, 1] }]\n";
    let colored = "[[object]]\nname = 'shown'\nmesh = 'seg.nrrd'\ncolor_by = { volume = 'scan.nrrd' }\n";
    for (name, objects) in
        [("both", format!("{regions}{scan}")), ("alone", regions.to_owned()), ("field", field.to_owned())]
    {
        place.write(&format!("{name}.toml"), scene(&objects));
        place.expect(0, &["render", &format!("{name}.toml"), "-o", &format!("{name}.png")], "");
    }
    let both = place.pixels("both.png").to_rgb8();
    let grey = both.pixels().filter(|p| p.0[0] > 30 && p.0[0].abs_diff(p.0[2]) < 12).count();
    assert!(grey > 1000 && hues(&place, "alone.png")[2] > 20, "{grey}");
    let [red, _, blue] = hues(&place, "field.png");
    assert!(red > 20 && blue > 20, "{red} {blue}");
    place.write("colored.toml", scene(colored));
    place.expect(
        3,
        &["render", "colored.toml"],
        "unknown key `volume`\nhint: a surface shows another volume by `field`",
    );
}

#[test]
fn what_looks_like_labels_and_like_amounts_is_told_with_the_option_that_changes_it() {
    let place = place();
    let write = |name: &str, value: &dyn Fn(i32) -> i32| {
        let header = "NRRD0004\ntype: short\ndimension: 3\nsizes: 16 16 16\nencoding: ascii\n\n".to_owned();
        place.write(name, header + &(0..4096).map(|k| format!("{}\n", value(k))).collect::<String>());
    };
    let is_inside =
        |k: i32| (2..14).contains(&(k % 16)) && (2..14).contains(&(k / 16 % 16)) && (2..14).contains(&(k / 256));
    write("mask.nrrd", &|k| if is_inside(k) { 5 } else { 0 });
    write("three.nrrd", &|k| if k / 256 < 8 { 1 } else { 2 + i32::from(k % 16 < 8) });
    write("minus.nrrd", &|k| if is_inside(k) { 1 + k % 16 / 8 + 2 * (k / 16 % 16 / 8) } else { -1 });
    let said = |arguments: &[&str]| {
        let out = place.expect(0, arguments, "");
        String::from_utf8_lossy(&[out.stdout, out.stderr].concat()).into_owned()
    };
    let doubt = "its 2 whole numbers (0, 5) are taken for amounts, not for labels: two numbers may be a mask, too";
    let draw = |name: &'static str| ["render", name, "--size", "80x60", "--force", "-o", "a.png"];
    for arguments in [&["info", "mask.nrrd"][..], &draw("mask.nrrd")] {
        let text = said(arguments);
        assert!(text.contains(doubt) && text.contains("--preset labels"), "{text}");
    }
    let text = said(&[&draw("mask.nrrd")[..], &["--preset", "labels"]].concat());
    assert!(text.contains("1 label"), "{text}");
    for name in ["three.nrrd", "minus.nrrd"] {
        let text = said(&["info", name]);
        assert!(text.contains("labels, not amounts"), "{text}");
    }
    let text = said(&draw("minus.nrrd"));
    assert!(text.contains("its voxels of -1 belong to no region"), "{text}");
    place.write("some.ctbl", "1 a 255 0 0 255\n2 b 0 255 0 255\n");
    place.expect(
        2,
        &[&draw("mask.nrrd")[..], &["--labels", "some.ctbl"]].concat(),
        "no file is a volume of labels; mask.nrrd: the table lacks 1 of its 1 number: 5",
    );
    place.write(
        "half.nrrd",
        "NRRD0004\ntype: float\ndimension: 3\nsizes: 2 2 2\nencoding: ascii\n\n0\n.5\n1\n2\n3\n4\n5\n6\n",
    );
    place.expect(
        2,
        &[&draw("half.nrrd")[..], &["--preset", "labels"]].concat(),
        "--preset labels: no file is a volume of labels; half.nrrd: it has the value 0.5",
    );
}

#[test]
fn wrong_tables_are_refused_with_their_place() {
    let place = place();
    place.write("bad.ctbl", "3 core 255 0 0 255\n4 box 0 0 300 255\n");
    place.write("bad.toml", "three = \"core\"\n");
    place.write("key.toml", "3 = { nam = \"core\" }\n");
    place.write("turned.toml", "liver = 12\n");
    place.write("bare.toml", "12 = 3\n");
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
        (3, "seg.nrrd", "turned.toml", "behind the number of a label, such as 12 = \"liver\", found the number 12"),
        (3, "seg.nrrd", "bare.toml", "behind the number of a label, such as 12 = \"liver\", found the number 3"),
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
