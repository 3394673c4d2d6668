//! The eye on a ball around a centre.

use crate::lights::Direction;
use libm::{atan2, exp2, sincos};
use organza::scene::Scene;
use splat_core::glam::DVec3;
use splat_core::{Camera, Projection};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Elevations from which on the picture's up follows from the azimuth: nearer to a pole, the pole lies nearly along the view.
const NEAR_POLE: f64 = 89.0 / 180.0 * PI;

/// Powers of two of the distance for each step of a wheel: six steps halve it.
const OCTAVES_PER_STEP: f64 = 1.0 / 6.0;

/// Parts of a unit vector that rounding makes.
const ROUNDING: f64 = 1e-9;

/// Least and greatest distance, world units, within those that scenes may have.
const NEAREST: f64 = 1e-15;
const FARTHEST: f64 = 1e15;

/// The eye's place as a person turns it: on a ball around a centre, between two poles. The eye goes up to a pole and not beyond, so the picture
/// never flips. At a pole the azimuth still turns the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewpoint {
    /// Radians about the pole; about +Y from +Z towards +X.
    pub azimuth: f64,
    /// Radians above the horizon, −π/2 to π/2.
    pub elevation: f64,
    /// World units from the eye to the centre, > 0.
    pub distance: f64,
    /// World position in the middle of the picture.
    pub centre: DVec3,
    /// Unit vector around which the azimuth goes: +Y or −Y, unless the scene's camera leans.
    pub pole: DVec3,
    /// Pinhole or parallel.
    pub projection: Projection,
}

impl Viewpoint {
    /// The viewpoint of a scene whose camera has its place.
    pub fn of_scene(scene: &Scene) -> Self {
        Self::of_camera(&scene.camera, scene.target)
    }

    /// The viewpoint of a camera that looks at `target`.
    pub fn of_camera(camera: &Camera, target: DVec3) -> Self {
        let [right, up, forward] = camera.axes;
        // A camera that does not lean has its right on the horizon.
        let leans = right.y.abs() > ROUNDING;
        let pole = if leans { up } else { upright(up) };
        let outwards = -forward;
        let frame = Frame::around(pole);
        let height = outwards.dot(pole);
        let elevation = atan2(height, (outwards - pole * height).length());
        // Along the pole the direction says nothing of the azimuth, and the picture's right says all; it says the same elsewhere.
        let azimuth = atan2(-right.dot(frame.zero), right.dot(frame.quarter));
        let distance = (target - camera.position).length().clamp(NEAREST, FARTHEST);
        Self { azimuth, elevation, distance, centre: target, pole, projection: camera.projection }
    }

    /// World position of the eye.
    pub fn eye(&self) -> DVec3 {
        self.centre + self.outwards() * self.distance
    }

    /// The up direction of the picture: the pole, or near it the direction to the pole.
    pub fn up(&self) -> DVec3 {
        if self.elevation.abs() < NEAR_POLE { self.pole } else { self.upwards() }
    }

    /// Unit vector from the centre to the eye.
    fn outwards(&self) -> DVec3 {
        let (sine, cosine) = sincos(self.elevation);
        self.level() * cosine + self.pole * sine
    }

    /// Unit vector across the view towards the upper pole.
    pub(crate) fn upwards(&self) -> DVec3 {
        let (sine, cosine) = sincos(self.elevation);
        self.pole * cosine - self.level() * sine
    }

    /// Unit vector on the horizon below the eye.
    fn level(&self) -> DVec3 {
        let frame = Frame::around(self.pole);
        let (sine, cosine) = sincos(self.azimuth);
        frame.zero * cosine + frame.quarter * sine
    }

    /// Unit vector to the right of the picture.
    pub(crate) fn right(&self) -> DVec3 {
        let frame = Frame::around(self.pole);
        let (sine, cosine) = sincos(self.azimuth);
        frame.quarter * cosine - frame.zero * sine
    }

    /// After a drag in heights of the picture; one height is half a turn.
    #[must_use]
    pub fn orbited(self, right: f64, up: f64) -> Self {
        self.looking_from(self.azimuth - right * PI, self.elevation - up * PI)
    }

    /// Azimuth and elevation of an eye in the direction of a unit vector.
    pub(crate) fn direction_to(&self, to: DVec3) -> Direction {
        let frame = Frame::around(self.pole);
        let height = to.dot(self.pole);
        let level = to - self.pole * height;
        // Along the pole every azimuth is the same direction.
        let azimuth =
            if level.length() < ROUNDING { 0.0 } else { atan2(level.dot(frame.quarter), level.dot(frame.zero)) };
        let elevation = atan2(height, level.length());
        Direction { azimuth: azimuth.to_degrees(), elevation: elevation.to_degrees() }
    }

    /// At this azimuth and elevation, radians.
    #[must_use]
    pub fn looking_from(self, azimuth: f64, elevation: f64) -> Self {
        // From −π to π, so that long turning loses no digits.
        let azimuth = (azimuth + PI).rem_euclid(TAU) - PI;
        Self { azimuth, elevation: elevation.clamp(-FRAC_PI_2, FRAC_PI_2), ..self }
    }

    /// After a drag in heights of the picture: what is in the middle follows the pointer.
    #[must_use]
    pub fn panned(self, right: f64, up: f64) -> Self {
        let height = self.height();
        let centre = self.centre - self.right() * (right * height) - self.upwards() * (up * height);
        Self { centre, ..self }
    }

    /// After so many steps of a wheel, nearer where they are positive.
    #[must_use]
    pub fn zoomed(self, steps: f64) -> Self {
        let factor = exp2(-steps * OCTAVES_PER_STEP);
        match self.projection {
            Projection::Perspective { .. } => {
                Self { distance: (self.distance * factor).clamp(NEAREST, FARTHEST), ..self }
            }
            // Parallel rays see as much from anywhere.
            Projection::Orthographic { height } => {
                let height = (height * factor).clamp(NEAREST, FARTHEST);
                Self { projection: Projection::Orthographic { height }, ..self }
            }
        }
    }

    /// Height of the picture at the centre, world units.
    pub fn height(&self) -> f64 {
        match self.projection {
            Projection::Perspective { fov_y } => 2.0 * self.distance * libm::tan(0.5 * fov_y),
            Projection::Orthographic { height } => height,
        }
    }
}

/// The pole of a camera that does not lean: one that looks straight down has +Y.
fn upright(up: DVec3) -> DVec3 {
    if up.y < -ROUNDING { DVec3::NEG_Y } else { DVec3::Y }
}

/// The horizon of a pole.
struct Frame {
    /// Where the azimuth is 0.
    zero: DVec3,
    /// Where the azimuth is a quarter of a turn.
    quarter: DVec3,
}

impl Frame {
    fn around(pole: DVec3) -> Self {
        // +Z about +Y, towards +X; about −Y the same, the other way round.
        let beside = if pole.z.abs() < 0.9 { DVec3::Z } else { DVec3::NEG_Y };
        let zero = (beside - pole * beside.dot(pole)).normalize();
        Self { zero, quarter: pole.cross(zero) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Projection = Projection::Perspective { fov_y: 0.6 };

    fn camera(position: DVec3, target: DVec3, up: DVec3) -> Camera {
        Camera::look_at(position, target, up, LENS, [64, 48]).unwrap()
    }

    fn seen_from(viewpoint: &Viewpoint) -> Camera {
        Camera::look_at(viewpoint.eye(), viewpoint.centre, viewpoint.up(), viewpoint.projection, [64, 48]).unwrap()
    }

    #[test]
    fn a_camera_comes_back_from_its_viewpoint() {
        let target = DVec3::new(4e6, -20.0, 3e5);
        let ways = [
            DVec3::new(0.0, 0.0, 4.0),
            DVec3::new(-3.0, 1.0, -2.0),
            DVec3::new(0.0, 7.0, 0.0),
            DVec3::new(0.0, -7.0, 0.0),
            DVec3::new(1e-12, 5.0, 0.0),
            DVec3::new(200.0, -300.0, 5.0),
        ];
        let ups = [DVec3::Y, DVec3::NEG_Y, DVec3::new(1.0, 2.0, 0.5), DVec3::X, DVec3::Z];
        for way in ways {
            for up in ups {
                let before = camera(target + way, target, up);
                let after = seen_from(&Viewpoint::of_camera(&before, target));
                assert!((before.position - after.position).length() < 1e-8, "{way} {up}");
                for k in 0..3 {
                    let error = (before.axes[k] - after.axes[k]).length();
                    assert!(error < 1e-7, "{way} {up}, axis {k}: {} {}", before.axes[k], after.axes[k]);
                }
            }
        }
    }

    #[test]
    fn azimuth_and_elevation_are_those_of_scenes() {
        let viewpoint = Viewpoint::of_camera(&camera(DVec3::new(3.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y), DVec3::ZERO);
        assert!((viewpoint.azimuth.to_degrees() - 45.0).abs() < 1e-12);
        assert_eq!((viewpoint.elevation, viewpoint.pole), (0.0, DVec3::Y));
        let above = Viewpoint::of_camera(&camera(DVec3::new(0.0, 1.0, 1.0), DVec3::ZERO, DVec3::Y), DVec3::ZERO);
        assert!((above.elevation.to_degrees() - 45.0).abs() < 1e-12);
    }

    #[test]
    fn the_picture_does_not_flip_at_a_pole() {
        let mut viewpoint =
            Viewpoint::of_camera(&camera(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y), DVec3::ZERO);
        let mut before = seen_from(&viewpoint);
        // Up over the pole by far, then along it.
        for step in 0..400 {
            viewpoint = if step < 200 { viewpoint.orbited(0.0, -0.005) } else { viewpoint.orbited(0.005, 0.0) };
            let after = seen_from(&viewpoint);
            for k in 0..3 {
                // No step turns the picture by more than the drag: 0.005 of half a turn.
                assert!((before.axes[k] - after.axes[k]).length() < 0.005 * PI + 1e-9, "step {step}, axis {k}");
            }
            before = after;
        }
        assert!((viewpoint.elevation - FRAC_PI_2).abs() < 1e-12);
        // 200 steps of 0.9 degrees are half a turn: the picture stands on its head, and the eye is where it was.
        assert!((before.axes[1] - DVec3::Z).length() < 1e-9, "{}", before.axes[1]);
    }

    #[test]
    fn a_drag_takes_what_is_in_the_middle_with_it() {
        let at = DVec3::new(1.0, 2.0, 5.0);
        for projection in [LENS, Projection::Orthographic { height: 3.0 }] {
            let camera = Camera::look_at(at, DVec3::new(0.5, 0.0, 0.0), DVec3::Y, projection, [64, 48]).unwrap();
            let viewpoint = Viewpoint::of_camera(&camera, DVec3::new(0.5, 0.0, 0.0));
            let moved = seen_from(&viewpoint.panned(0.25, -0.125));
            let place = moved.view_from_world(viewpoint.centre);
            let scale = if moved.is_orthographic() { 1.0 } else { place.z };
            // 48 rows: 12 pixels to the right, 6 down.
            assert!((place.x / scale * moved.focal_px() - 12.0).abs() < 1e-9);
            assert!((place.y / scale * moved.focal_px() + 6.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_wheel_goes_in_and_out_by_the_same() {
        for projection in [LENS, Projection::Orthographic { height: 3.0 }] {
            let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, projection, [64, 48]).unwrap();
            let viewpoint = Viewpoint::of_camera(&camera, DVec3::ZERO);
            assert!((viewpoint.zoomed(6.0).height() / viewpoint.height() - 0.5).abs() < 1e-12);
            assert!((viewpoint.zoomed(3.7).zoomed(-3.7).height() / viewpoint.height() - 1.0).abs() < 1e-12);
            assert!(viewpoint.zoomed(1000.0).height() > 0.0 && viewpoint.zoomed(-1000.0).height() < 1e17);
        }
    }
}
