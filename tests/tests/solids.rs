//! Unions, intersections and differences as sources of a scene.

use organza_tests::{draw_in, organza, parallel_view};

/// A ball of radius `r` about x = `x` as a part, in a box with room around it.
fn ball(x: f64, r: f64) -> String {
    format!(
        "{{ implicit = {{ expression = 'sqrt((x - {x})^2 + y^2 + z^2) - {r}', \
         box = [[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]], spacing = 0.125 }} }}"
    )
}

fn scene(source: &str) -> String {
    parallel_view(4.0, 40)
        + "[[light]]\nkind = 'directional'\ndirection = [-1, -1, -1]\nirradiance = [3, 3, 3]\n[material.a]\nopacity = 0.5\n\
           [[object]]\nname = 'it'\nmaterial = 'a'\n"
        + source
}

#[test]
fn solids_of_expressions_are_those_of_min_and_max_and_clips_cut_them_alike() {
    let folder = tempfile::tempdir().unwrap();
    let a = "sqrt((x - -0.25)^2 + y^2 + z^2) - 0.625";
    let b = "sqrt((x - 0.5)^2 + y^2 + z^2) - 0.5";
    let parts = [ball(-0.25, 0.625), ball(0.5, 0.5)].join(", ");
    let clip = "clip = [{ normal = [0, 0, 1], point = [0, 0, 0.25] }]\n";
    let mut seen = Vec::new();
    for (source, expression) in [
        ("union", format!("min({a}, {b})")),
        ("intersection", format!("max({a}, {b})")),
        ("difference", format!("max({a}, -({b}))")),
    ] {
        // A union's box is a step larger than those of its parts.
        let one = format!(
            "implicit = {{ expression = '{expression}', box = [[-1.625, -1.625, -1.625], [1.625, 1.625, 1.625]], \
             spacing = 0.125 }}\n"
        );
        for clip in ["", clip].into_iter().skip(usize::from(source != "union")) {
            let of_parts = draw_in(folder.path(), &scene(&format!("{source} = [{parts}]\n{clip}")), &[]);
            assert_eq!(of_parts, draw_in(folder.path(), &scene(&format!("{one}{clip}")), &[]), "{source}, {clip}");
            assert!(!seen.contains(&of_parts.sha256(1.0)), "{source}, {clip} is like another");
            seen.push(of_parts.sha256(1.0));
        }
    }
}

#[test]
fn what_is_made_of_files_is_named_and_places_apart_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let points = "{ level_set = { points = 'a.xyz' } }";
    std::fs::write(&path, scene(&format!("difference = [{points}, {{ union = [{points}, {}] }}]\n", ball(0.0, 1.0))))
        .unwrap();
    let told = organza().arg("info").arg(&path).arg("--json").output().unwrap();
    let told: serde_json::Value = serde_json::from_slice(&told.stdout).unwrap();
    assert_eq!(told["objects"][0]["source"], "difference");
    assert_eq!(told["objects"][0]["path"].as_str().unwrap().matches("a.xyz").count(), 2);

    // Of files with several axes that point up the scene says which counts.
    std::fs::write(
        folder.path().join("body.nrrd"),
        "NRRD0004\ntype: float\ndimension: 3\nspace: right-anterior-superior\nsizes: 2 2 2\n\
         space directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\nencoding: ascii\n\n0 0 0 0 1 1 1 1\n",
    )
    .unwrap();
    let body = "{ isosurface = { volume = 'body.nrrd', level = 0.5 } }";
    let explained = |more: &str| {
        std::fs::write(&path, scene(&format!("union = [{points}, {body}]\n{more}"))).unwrap();
        let out = organza().arg("info").arg(&path).output().unwrap();
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let (code, message) = explained("");
    assert!(code == Some(3) && message.contains("several axes that point up"), "{message}");
    assert_eq!(explained("transform = { up = 'z' }\n").0, Some(0));

    let far = ball(0.0, 1.0).replace("[-1.5, -1.5, -1.5], [1.5, 1.5, 1.5]", "[5, 5, 5], [6, 6, 6]");
    std::fs::write(&path, scene(&format!("intersection = [{}, {far}]\n", ball(0.0, 1.0)))).unwrap();
    let refused = organza().args(["render", "-o", "a.exr"]).arg(&path).current_dir(folder.path()).output().unwrap();
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(message.contains("object 'it'") && message.contains("boxes have a place in common"), "{message}");
    assert!(refused.status.code() == Some(3) && !folder.path().join("a.exr").exists());
}

#[test]
fn lists_of_solids_are_checked_at_their_place() {
    const SKULL: &str = "{ isosurface = { volume = 'b.nii', level = 1 } }";
    for (source, expected) in [
        ("union = []".to_owned(), "expected at least two solids, found 0"),
        (format!("difference = [{SKULL}]"), "expected at least two solids, found 1"),
        (format!("union = [{SKULL}, {{}}]"), "expected exactly one solid in each part, found none"),
        (format!("union = [{SKULL}, {{ mesh = 'b.ply' }}]"), "unknown key `mesh`"),
        (
            "union = [{ isosurface = { volume = 'b.nii', level = 1 }, level_set = { points = 'b.ply' } }, {}]"
                .to_owned(),
            "expected exactly one solid in each part, found several",
        ),
        (format!("union = [{SKULL}, {{ intersection = [{{}}] }}]"), "expected at least two solids, found 1"),
    ] {
        let text = scene(&source);
        let refused = organza::scene::parse("s.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap_err();
        let line = text.lines().position(|line| line.starts_with(&source)).unwrap() + 1;
        let refused = refused.to_string();
        assert!(refused.starts_with(&format!("s.toml:{line}:")) && refused.contains(expected), "{source}: {refused}");
    }
}

/// An isosurface of three beams in steps of 8 mm, of which single pieces are no larger than a step or two.
#[test]
fn an_isosurface_of_a_coarse_volume_keeps_its_opacity_where_no_spacing_is_stated() {
    let assets = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets").canonicalize().unwrap();
    let scene = format!(
        "version = 1\nroot = '{assets}'\n[camera]\nauto = true\nazimuth = 140\nsize = [96, 96]\n[ambient]\ncolor = [1, 1, 1]\n\
         [[object]]\nname = 'it'\nopacity = 0.3\n\
         isosurface = {{ volume = '{assets}/dose/dose.nrrd', level = 3000, interpolation = 'catmull-rom' }}\n",
        assets = assets.display()
    );
    let folder = tempfile::tempdir().unwrap();
    let opacity = |arguments: &[&str]| -> f64 { draw_in(folder.path(), &scene, arguments).opacity().iter().sum() };
    let fine = opacity(&["--set", "object.it.spacing=1"]);
    for technique in ["points", "reference"] {
        let found = opacity(&["--technique", technique]) / fine;
        assert!((found - 1.0).abs() < 0.02, "{technique}: {found} of the opacity");
    }
}
