//! What lights see of a scene's parts, extractions and stops: what is refused.

use super::{SCENE, refused, try_toml};

#[test]
fn what_is_extracted_from_nothing_is_refused() {
    let refused = |keys: &str, expected: &str| {
        refused("mesh = \"a.ply\"", &format!("extract = {{ {keys} }}"), expected);
    };
    refused("light = 1", "12:21: `light`: expected a light below 1, found 1");
    refused("absorbance = 0.0", "12:26: `absorbance`: expected a number above 0, at most 10, found 0");
    refused("absorbance = 11", "`absorbance`: expected a number above 0, at most 10, found 11");
    refused("objects = []", "12:23: `objects`: expected at least one name, found none");
    refused("objects = [\"b\", \"fog\"]", "12:29: `objects`: expected the name of an object, found `fog`");
    refused("objects = [\"a\"]", "12:24: `objects`: `a` is extracted itself");
    refused("object = [\"b\"]", "unknown key `object`");
    // Two that are made of each other, and one of nothing.
    let pair = SCENE.replace("mesh = \"a.ply\"", "extract = { objects = [\"c\"] }")
        + "[[object]]\nname = \"c\"\nextract = { objects = [\"a\"] }\n";
    let error = try_toml(&pair).unwrap_err().to_string();
    assert!(error.contains("12:24: `objects`: `c` is extracted itself"), "{error}");
    let alone = SCENE.replace("mesh = \"a.ply\"", "extract = {}").replace("volume = ", "visible = false\nvolume = ");
    let error = try_toml(&alone).unwrap_err().to_string();
    assert!(error.contains("12:11: `extract`: the light sees nothing"), "{error}");
    let sized = SCENE.replace("mesh = \"a.ply\"", "extract = {}\npoint_size = { world = 1 }");
    assert!(try_toml(&sized).unwrap_err().to_string().contains("`point_size` belongs to `points`"));
}

#[test]
fn stops_that_no_light_could_tell_are_refused() {
    let scene = |track: &str, stop: &str, more: &str| {
        let scene =
            format!("{SCENE}[animation]\nframes = 9\n[[animation.track]]\n{track}\nstop = {{ {stop} }}\n{more}");
        try_toml(&scene).map(|_| ()).map_err(|e| (e.to_string(), e.hint().to_owned()))
    };
    let keys = "keys = [{ frame = 0, value = [0, 0, 0] }, { frame = 8, value = [1, 0, 0] }]";
    let track = format!("set = \"object.a.transform.translate\"\n{keys}");
    let other = |set: &str| format!("[[animation.track]]\nset = \"{set}\"\nkeys = [{{ frame = 0, value = 0 }}]\n");
    assert_eq!(scene(&track, "", ""), Ok(()));
    assert_eq!(scene(&track.replace("object.a", "object.0"), "objects = [\"b\"]", ""), Ok(()));
    for (track, stop, more, expected) in [
        (track.clone(), "radius = 1", String::new(), "unknown key `radius`"),
        (track.clone(), "", other("object.a.transform.scale"), "another track moves the object too"),
        (track.clone(), "light = 3", String::new(), "`light`: expected a light below 1, found 3"),
        (track.clone(), "objects = [\"x\"]", String::new(), "expected the name of an object, found `x`"),
        (track.clone(), "objects = [\"a\"]", String::new(), "`objects`: `a` is changed by a track"),
        (track.clone(), "objects = [\"b\"]", other("object.b.visible"), "`b` is changed by a track"),
        (track.clone(), "", other("object.b.visible"), "27:8: `stop`: there is nothing to stop at"),
        (track.clone(), "", other("light.0.intensity"), "`light`: a track changes it"),
        (track.clone(), "", other("object.0.transform"), "another track moves the object too"),
        (track.replace("translate", "rotate"), "", String::new(), "expected a track of an object's place"),
        (track.replace("object.a", "object.z"), "", String::new(), "expected a track of an object's place"),
        (track.replace("[1, 0, 0]", "[1, 0]"), "", String::new(), "`value`: expected three numbers"),
    ] {
        let (error, hint) = scene(&track, stop, &more).unwrap_err();
        assert!(error.contains(expected), "{track}\n{stop}\n{more}\nexpected: {expected}\nfound: {error} ({hint})");
    }
    let of_extraction = SCENE.replace("mesh = \"a.ply\"", "extract = {}")
        + &format!("[animation]\nframes = 9\n[[animation.track]]\n{track}\nstop = {{}}\n");
    let error = try_toml(&of_extraction).unwrap_err().to_string();
    assert!(error.contains("`stop`: an extraction is found where others stand"), "{error}");
}
