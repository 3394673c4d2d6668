//! The same object in many forms: mesh, implicit surface, raw points; grid, formula, lattice. Through the whole command,
//! all forms of a shape show its transmittance and cast its shadow, and come together as their resolution rises.

mod shape;
pub(crate) mod write;

use organza_tests::{draw_in, parallel_view, window};
use shape::{Rays, Shape};
use std::path::Path;

/// Height of the view, world units.
const HEIGHT: f64 = 2.6;
/// Extinction of solids, opacity of one crossing of shells.
const EXTINCTION: f64 = 0.8;
const OPACITY: f64 = 0.3;
/// Where a shape stands whose shadow falls to the middle of the wall, along (0, −1, −1).
const LIFT: f64 = 3.0;
const WALL: f64 = -1.0;
/// Sizes of the picture. Splats are as far apart as pixels, and cells of the shadow map grow finer with them.
const SIZES: [u32; 3] = [24, 48, 96];
/// Sets of particles that are averaged.
const SETS: u32 = 64;

/// How an object is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    Mesh,
    Implicit,
    Points,
    Grid,
    Density,
    Lattice,
}

const SHELLS: [Form; 3] = [Form::Mesh, Form::Implicit, Form::Points];
const SOLIDS: [Form; 2] = [Form::Grid, Form::Density];

/// A shape given in some form, at the resolution of a picture of `size`² pixels.
#[derive(Debug, Clone, Copy)]
struct Object {
    shape: Shape,
    form: Form,
    size: u32,
}

impl Object {
    fn spacing(self) -> f64 {
        HEIGHT / f64::from(self.size)
    }

    /// The object in a scene file with its middle at (0, `y`, `z`), its data written into `folder`.
    fn source(self, folder: &Path, [y, z]: [f64; 2]) -> String {
        let shape = self.shape;
        let h = self.spacing();
        let bounds = format!("box = [[-1, -1, -1], [1, 1, 1]], spacing = {h:?}");
        let place = format!("[[object]]\nname = 'it'\ntransform = {{ up = 'y', translate = [0, {y:?}, {z:?}] }}\n");
        place
            + &match self.form {
                Form::Mesh => {
                    std::fs::write(folder.join("mesh.ply"), write::mesh(&shape.triangles(h))).unwrap();
                    format!("mesh = 'mesh.ply'\nopacity = {OPACITY}\nspacing = {h:?}\n")
                }
                Form::Points => {
                    std::fs::write(folder.join("points.ply"), write::points(&shape.triangles(h))).unwrap();
                    format!("points = 'points.ply'\nopacity = {OPACITY}\n")
                }
                Form::Implicit => {
                    format!("implicit = {{ expression = '{}', {bounds} }}\nopacity = {OPACITY}\n", shape.formula())
                }
                Form::Grid => {
                    std::fs::write(folder.join("grid.nii"), write::nifti(&shape.occupancy(h), h)).unwrap();
                    format!(
                        "volume = 'grid.nii'\nspacing = {h:?}\n\
                         transfer = [{{ value = 0, color = [1, 1, 1], extinction = 0 }}, \
                         {{ value = 1, color = [1, 1, 1], extinction = {EXTINCTION} }}]\n"
                    )
                }
                Form::Density => format!(
                    "density = {{ expression = 'max(0, min(1, 0.5 - ({})/{h:?}))', {bounds}, \
                     extinction = {EXTINCTION} }}\n",
                    shape.formula()
                ),
                Form::Lattice => format!(
                    "medium_ball = {{ center = [0, 0, 0], radius = {:?}, extinction = {EXTINCTION}, \
                     spacing = {h:?} }}\n",
                    shape::RADIUS
                ),
            }
    }

    /// What the eye sees through the object: transmittance.
    fn seen(self) -> Vec<f64> {
        let folder = tempfile::tempdir().unwrap();
        let scene = parallel_view(HEIGHT, self.size) + &self.source(folder.path(), [0.0, 0.0]);
        draw_in(folder.path(), &scene, &[]).opacity().iter().map(|a| 1.0 - a).collect()
    }

    /// Share of light that arrives at a wall behind the object.
    fn shaded(self) -> Vec<f64> {
        let folder = tempfile::tempdir().unwrap();
        let scene = parallel_view(HEIGHT, self.size)
            + &format!(
                "[render]\nlayers = ['shadow']\nshadow = {{ cells = {} }}\n\
                 [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
                 [[object]]\nname = 'wall'\nrectangle = {{ center = [0, 0, {WALL:?}], u = [1.5, 0, 0], \
                 v = [0, 1.5, 0], spacing = {:?} }}\n",
                2 * self.size,
                self.spacing() / 2.0
            )
            + &self.source(folder.path(), [LIFT, LIFT + WALL]);
        draw_in(folder.path(), &scene, &[]).channel("shadow.A")
    }

    /// [`Object::seen`] by some techniques.
    fn seen_by<const N: usize>(self, techniques: [&str; N]) -> [Vec<f64>; N] {
        let folder = tempfile::tempdir().unwrap();
        let scene = parallel_view(HEIGHT, self.size) + &self.source(folder.path(), [0.0, 0.0]);
        techniques.map(|technique| {
            let picture = draw_in(folder.path(), &scene, &["--technique", technique]);
            picture.opacity().iter().map(|a| 1.0 - a).collect()
        })
    }

    /// [`Object::seen`] by the technique `particles`: transmittance and its standard error.
    fn seen_as_particles(self, seed: u32) -> (Vec<f64>, Vec<f64>) {
        let folder = tempfile::tempdir().unwrap();
        // Nothing shines but the background: luminance is transmittance.
        let scene = parallel_view(HEIGHT, self.size)
            + "[background]\ncolor = [1, 1, 1]\n"
            + &self.source(folder.path(), [0.0, 0.0]);
        let sets = format!("render.particles.repeat_level={SETS}");
        let seed = seed.to_string();
        let picture = draw_in(
            folder.path(),
            &scene,
            &["--technique", "particles", "--set", &sets, "--seed", &seed, "--layers", "std_error"],
        );
        (picture.opacity().iter().map(|a| 1.0 - a).collect(), picture.channel("std_error.A"))
    }

    /// [`squares`] of [`Object::seen_as_particles`], and the variance of each.
    fn squares_of_particles(self, seed: u32) -> (Vec<f64>, Vec<f64>) {
        let (image, error) = self.seen_as_particles(seed);
        let pixels = f64::from((self.size / SIZES[0]).pow(2));
        let squared: Vec<f64> = error.iter().map(|e| e * e).collect();
        let variance = squares(&squared, self.size).iter().map(|v| v / pixels).collect();
        (squares(&image, self.size), variance)
    }

    fn image(self, rays: Rays) -> Vec<f64> {
        if rays == Rays::View { self.seen() } else { self.shaded() }
    }
}

fn rmse(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

/// Means over the pixels of each square of the coarsest picture.
fn squares(image: &[f64], size: u32) -> Vec<f64> {
    let n = SIZES[0];
    let side = size / SIZES[0];
    let square = |k: u32| {
        let x = k % n * side;
        let y = k / n * side;
        window(image, size, x..x + side, y..y + side).iter().sum::<f64>() / f64::from(side * side)
    };
    (0..n * n).map(square).collect()
}

/// The forms of a shape agree where splats are a pixel apart, and come to the closed form as all resolutions double.
///
/// Pictures are compared by squares of fixed size: a single pixel at a silhouette is a step that no resolution resolves.
fn compare(shape: Shape, forms: &[Form], solid: bool) {
    for rays in [Rays::View, Rays::Light] {
        let mut errors = vec![Vec::new(); forms.len()];
        for size in SIZES {
            let exact = squares(&shape.transmittance(solid, rays, size), size);
            let image = |&form: &Form| squares(&Object { shape, form, size }.image(rays), size);
            let images: Vec<Vec<f64>> = forms.iter().map(image).collect();
            for (k, image) in images.iter().enumerate() {
                errors[k].push(rmse(image, &exact));
                for (j, other) in images[..k].iter().enumerate().filter(|_| size == SIZES[2]) {
                    let apart = rmse(image, other);
                    assert!(apart < 0.01, "{shape:?} {rays:?}: {:?} and {:?} differ by {apart}", forms[k], forms[j]);
                }
            }
        }
        for (form, e) in forms.iter().zip(errors) {
            let order = 0.5 * (e[0] / e[2]).log2();
            println!("{shape:?} {rays:?} {form:?}: RMSE {e:.5?}, order {order:.2}");
            assert!(order >= 1.0, "{shape:?} {rays:?} {form:?}: RMSE {e:?}, order {order}");
        }
    }
}

/// Mean over `which` of `square`/`variance`, and whether it is at most 1 but for 4 deviations √(2/n) (3e-5).
fn chi_square(which: &[usize], square: impl Fn(usize) -> f64, variance: impl Fn(usize) -> f64) -> (f64, bool) {
    let n = which.len() as f64;
    let mean = which.iter().map(|&k| square(k) / variance(k)).sum::<f64>() / n;
    (mean, mean < 1.0 + 4.0 * (2.0 / n).sqrt())
}

/// Particles come to the closed form as points do, and at the finest within 0.01 of points; but for noise, which is what
/// their standard error says: z² over the squares has the mean 1 between two seeds, and from the closed form itself where
/// the `form` samples that (a medium in a ball, where points are a lattice).
fn compare_particles(shape: Shape, forms: &[Form], solid: bool) {
    for &form in forms {
        let mut errors = Vec::new();
        for size in SIZES {
            let object = Object { shape, form, size };
            let exact = squares(&shape.transmittance(solid, Rays::View, size), size);
            let points = squares(&object.seen(), size);
            let (particles, variance) = object.squares_of_particles(3);
            let other = squares(&object.seen_as_particles(4).0, size);
            let noise = variance.iter().sum::<f64>() / variance.len() as f64;
            let noisy: Vec<usize> = (0..variance.len()).filter(|&k| variance[k] > 1e-10).collect();
            let seeds = chi_square(&noisy, |k| (particles[k] - other[k]).powi(2), |k| 2.0 * variance[k]);
            let closed = chi_square(&noisy, |k| (particles[k] - exact[k]).powi(2), |k| variance[k]);
            let from_points = (rmse(&particles, &points).powi(2) - noise).max(0.0).sqrt();
            println!(
                "{shape:?} {form:?} {size}: {} squares, z² between seeds {:.3}, from the closed form {:.3}, \
                 RMS without noise from points {from_points:.5}",
                noisy.len(),
                seeds.0,
                closed.0
            );
            assert!(10 * noisy.len() > 3 * variance.len() && seeds.1, "{shape:?} {form:?} {size}: seeds {seeds:?}");
            assert!(form != Form::Lattice || closed.1, "{shape:?} {form:?} {size}: from the closed form {closed:?}");
            assert!(size < SIZES[2] || from_points < 0.01, "{shape:?} {form:?} {size}: {from_points} from points");
            // Mean square without noise, which may come out below 0, and four deviations of it.
            let spread = 4.0 * noise * (2.0 / variance.len() as f64).sqrt();
            errors.push((rmse(&particles, &exact).powi(2) - noise, spread));
        }
        println!("{shape:?} {form:?} as particles: mean square error without noise, and its spread {errors:.7?}");
        // Four times the resolution: a quarter of the error, a sixteenth of its square, but for noise.
        let [(coarse, around), _, (fine, spread)] = errors[..] else { unreachable!() };
        assert!(fine - spread <= (coarse + around).max(0.0) / 16.0, "{shape:?} {form:?}: {errors:?}");
    }
}

/// Sheets come to the closed form as points do, and at the finest within 0.01 of points, and of particles but for their noise.
fn compare_sheets(shape: Shape, forms: &[Form], solid: bool) {
    for &form in forms {
        let mut errors = Vec::new();
        for size in SIZES {
            let object = Object { shape, form, size };
            let exact = squares(&shape.transmittance(solid, Rays::View, size), size);
            let [image, points] = object.seen_by(["sheets", "points"]).map(|image| squares(&image, size));
            errors.push(rmse(&image, &exact));
            let apart = rmse(&image, &points);
            assert!(size < SIZES[2] || apart < 0.01, "{shape:?} {form:?} {size}: {apart} from points");
            if size == SIZES[2] {
                let (particles, variance) = object.squares_of_particles(3);
                let noise = variance.iter().sum::<f64>() / variance.len() as f64;
                let by_particles = (rmse(&image, &particles).powi(2) - noise).max(0.0).sqrt();
                println!("{shape:?} {form:?} in sheets: {apart:.5} from points, {by_particles:.5} from particles");
                assert!(by_particles < 0.01, "{shape:?} {form:?} {size}: {by_particles} from particles");
            }
        }
        let order = 0.5 * (errors[0] / errors[2]).log2();
        println!("{shape:?} {form:?} in sheets: RMSE {errors:.5?}, order {order:.2}");
        assert!(order >= 1.0, "{shape:?} {form:?} in sheets: RMSE {errors:?}, order {order}");
    }
}

/// Deviation from the transmittance of two crossings in pixels that have nothing else around them, out to 4 pixels.
fn ripple(image: &[f64], exact: &[f64], size: u32) -> f64 {
    let n = size as usize;
    let two = (1.0 - OPACITY).powi(2);
    let near = |c: usize| c.saturating_sub(4)..(c + 5).min(n);
    let inside = |k: &usize| near(k / n).all(|y| near(k % n).all(|x| (exact[y * n + x] - two).abs() < 1e-9));
    let pixels: Vec<usize> = (0..n * n).filter(inside).collect();
    assert!(pixels.len() > 500, "{} pixels", pixels.len());
    (pixels.iter().map(|k| (image[*k] - two).powi(2)).sum::<f64>() / pixels.len() as f64).sqrt()
}

/// Forms by surfels agree with each other, with the same by points, with particles of the scan, and with the closed form; and a
/// scan without order ripples at most a third as much as by points. Discs end about a pixel beyond a silhouette, so the error
/// falls with the pixel.
fn compare_surfels(shape: Shape) {
    let size = SIZES[2];
    let object = |form, size| Object { shape, form, size };
    let [coarse_exact, exact] = [SIZES[0], size].map(|size| shape.transmittance(false, Rays::View, size));
    let images = SHELLS.map(|form| object(form, size).seen_by(["surfels", "points"]));
    let in_squares = images.each_ref().map(|[surfels, _]| squares(surfels, size));
    let (particles, variance) = object(Form::Points, size).squares_of_particles(3);
    let noise = variance.iter().sum::<f64>() / variance.len() as f64;
    for (k, form) in SHELLS.into_iter().enumerate() {
        let image = &in_squares[k];
        let [surfels, points] = &images[k];
        let [coarse] = object(form, SIZES[0]).seen_by(["surfels"]).map(|image| rmse(&image, &coarse_exact));
        let error = rmse(image, &squares(&exact, size));
        let by_points = rmse(image, &squares(points, size));
        let by_particles = (rmse(image, &particles).powi(2) - noise).max(0.0).sqrt();
        let apart = in_squares.iter().map(|other| rmse(image, other)).fold(0.0, f64::max);
        println!(
            "{shape:?} {form:?} by surfels: RMSE {coarse:.5}, {error:.5}; from points {by_points:.5}, from particles of the \
             scan {by_particles:.5}, from another form {apart:.5}"
        );
        let most = error.max(by_points).max(by_particles).max(apart);
        assert!(most < 0.01 && error < 0.4 * coarse, "{shape:?} {form:?} by surfels: {most}, {error}, coarse {coarse}");
        if form == Form::Points {
            let [by_points, by_surfels] = [points, surfels].map(|image| ripple(image, &exact, size));
            println!("{shape:?}: ripple by points {by_points:.5}, by surfels {by_surfels:.2e}");
            assert!(by_surfels < by_points / 3.0, "{shape:?}: {by_surfels} by surfels, {by_points} by points");
        }
    }
}

#[test]
fn particles_of_a_ball() {
    compare_particles(Shape::Ball, &[Form::Lattice], true);
}

#[test]
fn a_tenth_less_extinction_is_told_apart_from_particles() {
    let object = Object { shape: Shape::Ball, form: Form::Lattice, size: SIZES[0] };
    let (image, error) = object.seen_as_particles(3);
    let exact = Shape::Ball.transmittance(true, Rays::View, SIZES[0]);
    let noisy: Vec<usize> = (0..image.len()).filter(|&k| error[k] > 1e-5).collect();
    let told =
        |thinner: f64| !chi_square(&noisy, |k| (image[k] - exact[k].powf(thinner)).powi(2), |k| error[k] * error[k]).1;
    assert!(told(0.9) && !told(1.0));
}

#[test]
fn another_object_is_told_apart() {
    let image = |shape| squares(&Object { shape, form: Form::Density, size: SIZES[0] }.seen(), SIZES[0]);
    let ball = image(Shape::Ball);
    let gyroid = image(Shape::Gyroid);
    assert!(rmse(&ball, &gyroid) > 0.1);
    let thinner: Vec<f64> = ball.iter().map(|t| t.powf(0.9)).collect();
    assert!(rmse(&ball, &thinner) > 0.01, "a tenth less extinction is told apart");
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn particles_of_shells() {
        compare_particles(Shape::Ball, &SHELLS, false);
        compare_particles(Shape::Gyroid, &[Form::Implicit], false);
    }

    #[test]
    fn sheets_of_shells() {
        compare_sheets(Shape::Ball, &SHELLS, false);
        compare_sheets(Shape::Gyroid, &[Form::Implicit], false);
    }

    #[test]
    fn shells_of_a_gyroid() {
        compare(Shape::Gyroid, &SHELLS, false);
    }

    #[test]
    fn solid_gyroids() {
        compare(Shape::Gyroid, &SOLIDS, true);
    }

    #[test]
    fn particles_of_solids() {
        compare_particles(Shape::Gyroid, &SOLIDS, true);
    }

    #[test]
    fn shells_of_a_torus() {
        compare(Shape::Torus, &SHELLS, false);
    }

    #[test]
    fn surfels_of_a_torus() {
        compare_surfels(Shape::Torus);
    }

    #[test]
    fn sheets_of_solids_and_of_a_mesh() {
        compare_sheets(Shape::Ball, &[Form::Lattice], true);
        compare_sheets(Shape::Gyroid, &SOLIDS, true);
        // Its triangles stay what they are.
        compare_sheets(Shape::Ball, &[Form::Mesh], false);
    }

    #[test]
    fn shells_of_a_ball() {
        compare(Shape::Ball, &SHELLS, false);
    }

    #[test]
    fn surfels_of_a_ball() {
        compare_surfels(Shape::Ball);
    }

    #[test]
    fn solid_balls() {
        compare(Shape::Ball, &[Form::Grid, Form::Density, Form::Lattice], true);
    }

    #[test]
    fn solid_tori() {
        compare(Shape::Torus, &SOLIDS, true);
    }
}
