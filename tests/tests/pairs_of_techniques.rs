//! Two techniques in one picture: each draws its own objects once, so transmittances multiply.

use organza_tests::{Place, mean_and_ripple, parallel_view, picture_of, window};

/// Every technique, and whether it draws media.
const TECHNIQUES: [(&str, bool); 5] =
    [("points", true), ("particles", true), ("sheets", true), ("surfels", false), ("reference", true)];

/// Kinds of objects, those that are media first.
const KINDS: [&str; 4] = ["medium_box", "volume", "rectangle", "mesh"];
const MEDIA: usize = 2;

/// Pixels along a side of the patch that one pair of kinds fills, which is one unit wide.
const PATCH: u32 = 12;

/// An object of a kind over the patch of a column and a row, in the plane or the slab of thickness 0.5 about `depth`.
fn object(kind: usize, technique: &str, place: &Patch, depth: f64) -> String {
    let [x, y] = place.center();
    let source = match KINDS[kind] {
        "medium_box" => format!(
            "medium_box = {{ min = [{:?}, {:?}, {:?}], max = [{:?}, {:?}, {:?}], extinction = 1, spacing = 0.05 }}",
            x - 0.5,
            y - 0.5,
            depth - 0.25,
            x + 0.5,
            y + 0.5,
            depth + 0.25
        ),
        "volume" => format!(
            "volume = 'even.nrrd'\ntransfer = [{{ value = 1, color = [1, 1, 1], extinction = 1 }}]\n\
             transform = {{ translate = [{:?}, {:?}, {:?}] }}",
            x - 0.475,
            y - 0.475,
            depth - 0.225
        ),
        "rectangle" => format!(
            "rectangle = {{ center = [{x:?}, {y:?}, {depth:?}], u = [0.5, 0, 0], v = [0, 0.5, 0], spacing = 0.05 }}\n\
             opacity = 0.5"
        ),
        _ => format!(
            "mesh = 'square.obj'\nspacing = 0.05\nopacity = 0.5\n\
             transform = {{ translate = [{x:?}, {y:?}, {depth:?}] }}"
        ),
    };
    let name = format!("{kind} {technique} {} {} {depth}", place.column, place.row);
    format!("[[object]]\nname = '{name}'\ntechnique = '{technique}'\n{source}\n")
}

/// What lets through what an object of a kind does.
fn transmittance(kind: usize) -> f64 {
    if kind < MEDIA { (-0.5f64).exp() } else { 0.5 }
}

/// How the objects of a pair lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Placing {
    /// One before the other.
    Apart,
    /// At the same depths.
    Among,
}

struct Patch {
    column: usize,
    row: usize,
}

impl Patch {
    fn center(&self) -> [f64; 2] {
        [self.column as f64 - 1.5, 1.5 - self.row as f64]
    }

    /// Values of a picture well inside.
    fn inner(&self, values: &[f64]) -> Vec<f64> {
        let inner = |rank: usize| rank as u32 * PATCH + 4..(rank as u32 + 1) * PATCH - 4;
        window(values, 4 * PATCH, inner(self.column), inner(self.row))
    }
}

/// Looks at every pair of techniques, and of kinds of objects, before each other, and at the same depths, where they take turns; `is_tried` chooses
/// among these by the ranks of the techniques.
fn pairs_let_through_the_product(is_tried: impl Fn(usize, usize, Placing) -> bool) {
    let place = Place::new("");
    let header = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 20 20 10\nspacings: 0.05 0.05 0.05\nencoding: raw\n\n";
    place.write("even.nrrd", [header.as_bytes(), &[1; 4000]].concat());
    place.write("square.obj", "v -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0.5 0.5 0\nv -0.5 0.5 0\nf 1 2 3 4\n");
    for (rank, (first, first_draws_media)) in TECHNIQUES.into_iter().enumerate() {
        for (other_rank, (second, second_draws_media)) in TECHNIQUES.into_iter().enumerate() {
            for placing in [Placing::Apart, Placing::Among] {
                if rank == other_rank || !is_tried(rank, other_rank, placing) {
                    continue;
                }
                let apart = if placing == Placing::Apart { 1.0 } else { 0.1 };
                let mut scene = parallel_view(4.0, 4 * PATCH);
                let mut expected = Vec::new();
                for row in if first_draws_media { 0 } else { MEDIA }..KINDS.len() {
                    for column in if second_draws_media { 0 } else { MEDIA }..KINDS.len() {
                        let patch = Patch { column, row };
                        scene += &object(row, first, &patch, apart);
                        scene += &object(column, second, &patch, 0.0);
                        expected.push((patch, transmittance(row) * transmittance(column)));
                    }
                }
                scene += "[render]\nantialias = 1\nparticles = { repeat_level = 100 }\n";
                place.write("s.toml", scene);
                place.expect(0, &["render", "s.toml", "-o", "a.exr", "--force"], "");
                let alpha = picture_of(&place.path("a.exr")).opacity();
                for (patch, expected) in expected {
                    let (found, _) = mean_and_ripple(&patch.inner(&alpha));
                    let [kind, other] = [KINDS[patch.row], KINDS[patch.column]];
                    // 16 pixels of 100 sets: five standard errors of at most ½ / √1600.
                    assert!(
                        (1.0 - found - expected).abs() < 0.0625,
                        "{first} {kind} {apart} before {second} {other}: {} for {expected}",
                        1.0 - found
                    );
                }
            }
        }
    }
}

#[test]
fn every_pair_of_techniques_and_kinds_lets_through_the_product() {
    pairs_let_through_the_product(|rank, other, placing| (placing == Placing::Among) == (rank < other));
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn every_pair_lets_through_the_product_in_either_order() {
        pairs_let_through_the_product(|rank, other, placing| (placing == Placing::Among) != (rank < other));
    }
}
