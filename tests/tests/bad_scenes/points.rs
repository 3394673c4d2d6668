//! How raw points look, and what is cut away: what is refused.

use super::{SCENE, refused, try_toml};

#[test]
fn how_points_look_is_checked() {
    let points = |keys: &str| format!("points = \"a.las\"\n{keys}\n[[object]]\nname = \"c\"\nmesh = \"a.ply\"");
    let refused = |keys: &str, expected: &str| refused("mesh = \"a.ply\"", &points(keys), expected);
    refused("color_by = { map = \"turbo\" }", "13:12: expected a key `column` here");
    refused("color_by = { column = \"\" }", "expected the name of a column, 1 to 256 bytes, found 0");
    refused("color_by = { column = \"z\", map = \"jet\" }", "13:34: `map`: expected one of viridis, magma,");
    refused(
        "color_by = { column = \"z\", range = [5, 5] }",
        "expected a lowest and a highest number up to 1e18, found 5 and 5",
    );
    refused(
        "color_by = { column = \"z\", map = \"distinct\", range = [1, 5] }",
        "has a colour for each number and no `range`",
    );
    refused("color_by = { column = \"z\" }\ncolor = [1, 0, 0]", "`color` and `color_by` exclude each other");
    let transfer = "transfer = [{ value = 0, color = [1, 1, 1] }]";
    refused(&format!("color_by = {{ column = \"z\", map = \"grey\" }}\n{transfer}"), "exclude each other");
    refused(
        transfer,
        "`transfer` belongs to a `volume` or `slice`, to a surface with a `field`, and to `points` or a `mesh` with `color_by`",
    );
    refused(
        "color_by = { column = \"z\" }\ntransfer = [{ value = 0, color = [1, 1, 1], extinction = 0.5 }]",
        "a surface has no extinction",
    );
    refused(
        "color_by = { column = \"z\" }\ntransfer = [{ value = 0, color = [1, 1, 1], opacity = 0.5 }, { value = 1, color = [1, 1, 1] }]",
        "expected a key `opacity` here, found none",
    );
    refused(
        "color_by = { column = \"z\" }\ntransfer = [{ value = 0, color = [1, 1, 1], opacity = 1.5 }]",
        "`opacity`: expected",
    );
    refused("discs = \"square\"", "expected");
    refused(
        "discs = \"elliptical\"\npoint_size = { pixels = 2 }",
        "`point_size` and discs = \"elliptical\" exclude each other",
    );
    refused("keep = { classification = [2, 6.5] }", "expected classes, whole numbers from 0 to 255, found 6.5");
    refused("keep = { class = [] }", "expected at least one class, found none");
    refused("keep = { intensity = [9, 2] }", "expected a lowest and a highest number up to 1e18, found [9.0, 2.0]");
    refused("keep = { intensity = [9] }", "expected a lowest and a highest number");
    refused("point_size = { pixels = 2, world = 1 }", "expected either `pixels` or `world`");
    refused("point_size = { pixels = 0 }", "`pixels`: expected a number above 0, up to 1024, found 0");
    refused("point_size = { world = -1 }", "`world`: expected a number above 0");
    refused("unlit = true\nmaterial = \"glass\"", "`unlit` and `material` exclude each other");
}

#[test]
fn fields_are_shown_by_surfaces_that_say_how() {
    let field = "field = { volume = \"b.nii\" }";
    let ramp = "transfer = [{ value = 0, color = [1, 1, 1] }]";
    let surface =
        |keys: &str, expected: &str| refused("mesh = \"a.ply\"", &format!("mesh = \"a.ply\"\n{keys}"), expected);
    surface(field, "a `field` needs a key `transfer`, found none");
    surface(&format!("{field}\n{ramp}\ncolor = [1, 0, 0]"), "13:9: `field` and `color` exclude each other");
    surface(&format!("field = {{}}\n{ramp}"), "expected a key `volume` here");
    surface(&format!("field = {{ volume = \"b.nii\", level = 2 }}\n{ramp}"), "unknown key `level`");
    surface(
        &format!("field = {{ volume = \"b.nii\", interpolation = \"cubic\" }}\n{ramp}"),
        "expected one of \"trilinear\", \"catmull-rom\", found \"cubic\"",
    );
    surface(&format!("field = {{ volume = \"../../b.nii\" }}\n{ramp}"), "b.nii");
    let extinct = "transfer = [{ value = 0, color = [1, 1, 1], extinction = 1 }]";
    surface(&format!("{field}\n{extinct}"), "a surface has no extinction");
    surface(&format!("{field}\n{ramp}\nunit_length = 1"), "`unit_length` belongs to");
    let in_place_of_mesh =
        |source: &str, expected: &str| refused("mesh = \"a.ply\"", &format!("{source}\n{field}\n{ramp}"), expected);
    in_place_of_mesh(
        "medium_ball = { center = [0, 0, 0], radius = 1, extinction = 1, spacing = 0.1 }",
        "`field` belongs to surfaces",
    );
    in_place_of_mesh(
        "slice = { volume = \"b.nii\", center = [0, 0, 0], normal = [0, 0, 1] }",
        "a slice shows the values of its own",
    );
    in_place_of_mesh("points = \"a.las\"\ncolor_by = { column = \"z\" }", "`field` and `color_by` exclude each other");
}

#[test]
fn points_that_are_a_medium_have_an_extinction_and_nothing_of_surfaces() {
    let points = |keys: &str| format!("points = \"a.ply\"\n{keys}\n[[object]]\nname = \"c\"\nmesh = \"a.ply\"");
    let refused = |keys: &str, expected: &str| refused("mesh = \"a.ply\"", &points(keys), expected);
    refused("as = \"fog\"", "expected");
    refused("as = \"medium\"", "expected a key `extinction` here, found none");
    refused("as = \"medium\"\nextinction = -1", "`extinction`");
    refused("as = \"surface\"\nextinction = 1", "`extinction` belongs to `points` with as = \"medium\"");
    let medium = "as = \"medium\"\nextinction = 1";
    for (key, expected) in [
        ("point_size = { pixels = 2 }", "points that are a medium have no discs"),
        ("discs = \"round\"", "points that are a medium have no discs"),
        (
            "color_by = { column = \"z\" }\ntransfer = [{ value = 0, color = [1, 1, 1], extinction = 1 }]",
            "`extinction` and those of the object's `transfer` exclude each other",
        ),
        (
            "color_by = { column = \"z\" }\nunit_length = 1",
            "`unit_length` belongs to a `volume`, and to `points` that are a medium with a `transfer`",
        ),
        ("merge_duplicates = true", "points that are a medium share the matter of their place"),
        ("opacity = 0.5", "a medium has no `opacity`"),
        ("technique = \"surfels\"", "is a medium, and the technique `surfels` draws surfaces alone"),
    ] {
        refused(&format!("{medium}\n{key}"), expected);
    }
}

#[test]
fn what_raw_points_alone_have_is_refused_elsewhere() {
    for (key, value) in [
        ("color_by", "{ column = \"z\" }"),
        ("keep", "{ z = [0, 1] }"),
        ("unlit", "true"),
        ("point_size", "{ pixels = 2 }"),
        ("discs", "\"round\""),
        ("as", "\"medium\""),
        ("extinction", "1"),
    ] {
        // A mesh has colours by columns.
        let source =
            if key == "color_by" { "isosurface = { volume = \"b.nii\", level = 1 }" } else { "mesh = \"a.ply\"" };
        refused("mesh = \"a.ply\"", &format!("{source}\n{key} = {value}"), &format!("`{key}` belongs to `points`"));
    }
}

#[test]
fn lists_of_materials_are_checked() {
    let listed = |keys: &str, expected: &str| {
        let text = SCENE.replacen("mesh = \"a.ply\"\nmaterial = \"glass\"", &format!("points = \"a.las\"\n{keys}"), 1);
        let found = try_toml(&format!(
            "{text}\n[material.lens]\nior = 1.5\n[material.bumpy]\nbump = {{ height = 1, size = 1 }}\n\
             [material.soft]\nfootprint = 1\n"
        ));
        match found {
            Ok(scene) => assert!(expected.is_empty() && scene.objects[0].materials.len() == 2, "{keys}"),
            Err(e) => assert!(!expected.is_empty() && e.to_string().contains(expected), "{keys}: {e}"),
        }
    };
    listed("materials = [\"glass\", \"glass\"]", "");
    listed("materials = [\"glass\"]\nmaterial = \"glass\"", "`materials` and `material` exclude each other");
    listed("materials = []", "`materials`: expected 1 to 65535 names, found 0");
    listed("materials = [\"glass\", \"glas\"]", "13:23: material `glas` is not defined");
    listed("materials = [\"glass\"]\nas = \"medium\"", "`materials` belongs to `points` that are surfaces");
    listed("materials = [\"glass\"]\nunlit = true", "`materials` and `unlit` exclude each other");
    listed("materials = [\"lens\"]", "material `lens` bounds matter, which is for all points of an object alike");
    listed("materials = [\"bumpy\"]", "material `bumpy` has bumps");
    listed("materials = [\"soft\"]", "material `soft` names a footprint");
}
