//! Depths of a homogeneous slab, seen straight and aslant, against the closed form of the slab cut by each pixel's own ray.

use organza_tests::draw;
use splat_core::glam::DVec3;

const SIZE: usize = 24;
const NAMES: [&str; 4] = ["first", "median", "mean", "sigma"];
/// The slab lies between z = ±¼.
const HALF: f64 = 0.25;

/// How a slab is looked at, from 5 units away.
#[derive(Clone, Copy)]
struct View {
    /// From its middle towards the eye, not of unit length.
    towards: DVec3,
    /// Vertical angle, degrees; `None` for parallel rays.
    fov: Option<f64>,
}

impl View {
    const PARALLEL_HEIGHT: f64 = 1.0;

    fn scene(&self, tau: f64, spacing: f64) -> String {
        let eye = self.eye();
        let lens = match self.fov {
            Some(fov) => format!("fov_y = {fov:?}"),
            None => format!("orthographic = {:?}", Self::PARALLEL_HEIGHT),
        };
        format!(
            "version = 1\n[camera]\nposition = [{:?}, {:?}, {:?}]\ntarget = [0, 0, 0]\n{lens}\nsize = [{SIZE}, {SIZE}]\n\
             [render]\nantialias = 1\nlayers = ['depth']\n\
             [[object]]\nname = 'slab'\n\
             medium_box = {{ min = [-2.4, -2.4, {:?}], max = [2.4, 2.4, {HALF:?}], extinction = {:?}, spacing = {spacing:?} }}\n",
            eye.x,
            eye.y,
            eye.z,
            -HALF,
            tau / (2.0 * HALF)
        )
    }

    fn eye(&self) -> DVec3 {
        5.0 * self.towards.normalize()
    }

    /// Depths at which the ray of pixel `k` enters and leaves the slab, and its length for each unit of depth.
    fn cut(&self, k: usize) -> [f64; 3] {
        let forward = -self.towards.normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let place = |v: usize| (v as f64 + 0.5) / SIZE as f64 - 0.5;
        let x = place(k % SIZE);
        let y = -place(k / SIZE);
        let (from, along) = match self.fov {
            Some(fov) => {
                let height = 2.0 * (0.5 * fov.to_radians()).tan();
                (self.eye(), forward + (right * x + up * y) * height)
            }
            None => (self.eye() + (right * x + up * y) * Self::PARALLEL_HEIGHT, forward),
        };
        let at = |z: f64| (z - from.z) / along.z;
        [at(HALF), at(-HALF), along.length()]
    }

    /// First, median, mean and deviation of depth at pixel `k` for `tau` across the slab.
    fn depths(&self, tau: f64, k: usize) -> [f64; 4] {
        let [near, far, length] = self.cut(k);
        let tau = tau / (2.0 * HALF) * (far - near) * length;
        let at = |level: f64| if level <= tau { near + (far - near) * level / tau } else { f64::INFINITY };
        let mean = 1.0 / tau - 1.0 / tau.exp_m1();
        let variance = 1.0 / (tau * tau) - tau.exp() / (tau.exp_m1() * tau.exp_m1());
        [at(-(-1.0f64 / 255.0).ln_1p()), at(2f64.ln()), near + (far - near) * mean, (far - near) * variance.sqrt()]
    }
}

/// What is found less the closed form for each pixel, in spacings.
fn differences(view: View, tau: f64, spacing: f64, arguments: &[&str]) -> [Vec<f64>; 4] {
    let picture = draw(&view.scene(tau, spacing), arguments);
    std::array::from_fn(|i| {
        let found = picture.channel(&format!("depth.{}.Z", NAMES[i]));
        let error = |(k, found): (usize, &f64)| {
            let expected = view.depths(tau, k)[i];
            let off = if *found == expected { 0.0 } else { (found - expected) / spacing };
            assert!(off.is_finite(), "{}, pixel {k}: {found}, expected {expected}", NAMES[i]);
            off
        };
        found.iter().enumerate().map(error).collect()
    })
}

const STRAIGHT: DVec3 = DVec3::Z;
const DIAGONAL: DVec3 = DVec3::new(1.0, 0.0, 1.0);
/// 65 degrees.
const STEEP: DVec3 = DVec3::new(0.9063, 0.0, 0.4226);
const GENERIC: DVec3 = DVec3::new(0.35, 0.21, 0.91);
/// A spacing that divides the slab, and one that does not.
const SPACINGS: [f64; 2] = [0.05, 0.08];

#[test]
fn depths_of_a_slanted_slab_are_its_closed_form() {
    // Most that first, median, mean and deviation are off in any pixel, in spacings.
    for (towards, most) in [
        (STRAIGHT, [[0.01; 4], [0.04, 0.03, 0.02, 0.02]]),
        (DIAGONAL, [[0.11, 0.09, 0.07, 0.04]; 2]),
        (STEEP, [[0.3, 0.27, 0.27, 0.2]; 2]),
        (GENERIC, [[0.04, 0.015, 0.015, 0.015]; 2]),
    ] {
        for fov in [None, Some(8.0)] {
            for (spacing, most) in SPACINGS.into_iter().zip(most) {
                for tau in [0.4, 1.5, 6.0] {
                    let found = differences(View { towards, fov }, tau, spacing, &[]);
                    let found = found.map(|d| d.into_iter().map(f64::abs).fold(0.0, f64::max));
                    println!("from {towards}, {fov:?}, spacing {spacing}, tau {tau}: {found:.4?}");
                    let close = found.iter().zip(most).all(|(found, most)| *found < most);
                    assert!(
                        close,
                        "from {towards}, {fov:?}, spacing {spacing}, tau {tau}: {found:.4?}, at most {most:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn depths_of_a_slanted_slab_by_particles_are_its_closed_form() {
    const LEVELS: f64 = 400.0;
    // Particles of a box are sampled from the box and not from splats: no kernel blurs its faces.
    let tau = 1.5;
    let spacing = SPACINGS[0];
    for towards in [STRAIGHT, DIAGONAL, GENERIC] {
        let view = View { towards, fov: None };
        let levels = LEVELS.to_string();
        let found = differences(view, tau, spacing, &["--technique", "particles", "--repeat-level", &levels]);
        let pixels = (SIZE * SIZE) as f64;
        let mean = found[2].iter().sum::<f64>() / pixels;
        let sigma = found[3].iter().sum::<f64>() / pixels;
        let [near, far, _] = view.cut(0);
        let deviation = view.depths(tau, 0)[3] / spacing;
        let error = deviation / (LEVELS * -(-tau * (far - near) / (2.0 * HALF)).exp_m1() * pixels).sqrt();
        println!("from {towards}: mean {mean:.4}, sigma {sigma:.4} spacings; standard error of the mean {error:.4}");
        assert!(mean.abs() < 4.0 * error && sigma.abs() < 4.0 * error, "from {towards}: {mean} {sigma}");
    }
}
