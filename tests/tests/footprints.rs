//! Images as footprints through the command: what is drawn of them by whom, and who refuses them by name.

use organza_tests::{Place, largest_difference, picture_of};
use std::fmt::Write as _;
use std::path::Path;

const SCENE: &str = "version = 1\nfootprints = [3, { image = 'maple.png' }, 2]\n[camera]\nposition = [0.2, 0.1, 4]\ntarget = [0, 0, 0]\nsize = [60, 45]\n\
    [background]\ncolor = [0.1, 0.2, 0.3]\n[ambient]\ncolor = [0.3, 0.3, 0.3]\n[render]\npoints = { exact = true }\n\
    [[light]]\nkind = 'point'\nposition = [2, 3, 3]\nintensity = [20, 18, 15]\n[material.leaf]\ncolor = [0.7, 0.3, 0.1]\n\
    [[object]]\nname = 'leaves'\npoints = 'leaves.csv'\nmaterial = 'leaf'\n";

/// Two crossed layers of leaves, of which every third is opaque and every fourth a formula.
fn place() -> Place {
    let place = Place::new(SCENE);
    let images = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/footprints");
    place.write("maple.png", std::fs::read(images.join("maple.png")).unwrap());
    let mut text = "x,y,z,nx,ny,nz,radius,footprint,opacity\n".to_owned();
    for i in 0..48 {
        let x = f64::from(i % 8) * 0.28 - 1.0;
        let y = f64::from(i / 8) * 0.3 - 0.8;
        let z = 0.3 * f64::from(i % 5);
        let n = f64::from(i % 7) * 0.2 - 0.6;
        let id = u8::from(i % 4 > 0);
        let opacity = if i % 3 == 0 { 1.0 } else { 0.7 };
        writeln!(text, "{x:.3},{y:.3},{z:.2},{n:.2},0.1,1,0.11,{id},{opacity}").unwrap();
    }
    place.write("leaves.csv", text);
    place
}

#[test]
fn leaves_are_drawn_as_the_exact_compositor_draws_them_and_to_the_same_bits_by_any_threads() {
    let place = place();
    let draw = |name: &str, more: &[&str]| {
        place.expect(0, &[&["render", "s.toml", "-o", name], more].concat(), "");
        picture_of(&place.path(name))
    };
    let picture = draw("a.exr", &["--threads", "1"]);
    assert_eq!(picture.sha256(1.0), draw("b.exr", &["--threads", "2"]).sha256(1.0), "threads");
    let exact = draw("exact.exr", &["--technique", "reference"]);
    let formulas = draw("formulas.exr", &["--set", "footprints=[3, 3]"]);
    let turned = draw("turned.exr", &["--set", "object.leaves.footprint={turn=90, seed=3}"]);
    let sheets = draw("sheets.exr", &["--technique", "sheets"]);
    for channel in ["R", "G", "B"] {
        let [seen, exact] = [&picture, &exact].map(|p| p.channel(channel));
        let difference = largest_difference(&seen, &exact);
        assert!(difference < 1e-5, "{channel}: {difference:e}");
        for (other, least) in [(&formulas, 0.02), (&turned, 0.02)] {
            assert!(largest_difference(&seen, &other.channel(channel)) > least, "{channel}");
        }
        // Slabs order leaves of one slab alike, whichever lies before the other.
        let difference = largest_difference(&seen, &sheets.channel(channel));
        assert!(difference < 0.1, "{channel} by sheets: {difference}");
    }
}

#[test]
fn what_draws_formulas_alone_says_so() {
    let place = place();
    let by = |technique| ["render", "s.toml", "-o", "a.exr", "--technique", technique];
    for technique in ["surfels", "particles"] {
        place.expect(3, &by(technique), "leaves: images as footprints, and its technique draws formulas alone");
    }
    place.expect(3, &["convert", "s.toml", "-o", "a.ply"], "object 'leaves': its splats show footprint 1, an image");
    place.write("leaves.csv", "x,y,z,footprint\n0,0,0,1\n1,0,0,3\n0,1,0,0\n");
    place.expect(
        3,
        &by("points"),
        "footprint is 3 in the column `footprint`, expected an index of the scene's `footprints`",
    );
    place.write("leaves.csv", "x,y,z,footprint\n0,0,0,1\n1,0,0,0.5\n0,1,0,0\n");
    place.expect(3, &by("points"), "expected a whole number from 0 to 255");
    assert_eq!(place.made(), ["leaves.csv", "maple.png"]);
}
