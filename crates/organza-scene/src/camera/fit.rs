//! A camera that sees everything: its direction is given, its place is found.
//!
//! The sides of the view are four planes whose directions follow from the angle of view and the direction of the camera. Pushed
//! inwards until each touches the outermost point, two of them meet in a line on which the eye may lie for the picture's width, two for its
//! height; the eye is where the stricter of them puts it, in the middle between the sides of the other. So the picture is filled as far as it
//! can be, by a single look at every point.

use glam::DVec3;
use splat_core::{Camera, DAabb, Projection};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Azimuth of a camera that states none, degrees.
pub const DEFAULT_AZIMUTH: f64 = 30.0;
/// Share of the picture that is filled where nothing else is said.
pub const DEFAULT_FILL: f64 = 0.9;
/// Size of a picture whose camera states none, pixels.
pub const DEFAULT_SIZE: [u32; 2] = [960, 540];

/// Elevation over what is as high as it is wide, and what is added for what is flat, degrees.
const ELEVATION: [f64; 2] = [15.0, 25.0];

/// Radius around a lone point, which has no size: the spacing that such a point is drawn with, world units.
const LONE: f64 = 1.0;

/// Least distance of the eye from what is seen, over the size of all.
const CLOSEST: f64 = 0.01;

/// How a camera is to be placed so that it sees everything.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraFit {
    /// Angle about +Y of the place of the eye, from +Z towards +X, radians.
    pub azimuth: f64,
    /// Angle of the place of the eye above the horizon, radians, −π/2 to π/2; `None` chooses by the shape: the flatter, the higher.
    pub elevation: Option<f64>,
    /// Share of the picture's width or height that is filled, in (0, 1].
    pub fill: f64,
    /// Whether the eye goes around everything at one distance, so that no azimuth cuts anything off.
    pub around: bool,
}

/// A camera whose place was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundCamera {
    /// The camera.
    pub camera: Camera,
    /// A point in the middle of the picture, amid what is seen.
    pub target: DVec3,
    /// Angle above the horizon, radians.
    pub elevation: f64,
    /// Box around all that it was placed for.
    pub bounds: DAabb,
}

/// Points in the world, given one by one: all that is seen lies in their convex hull.
pub type EachPoint<'a> = dyn Fn(&mut dyn FnMut(DVec3)) + 'a;

impl CameraFit {
    /// The camera with the projection and the size of `like` that sees all points; `None` if there are none.
    ///
    /// ```
    /// use organza_scene::CameraFit;
    /// use splat_core::{Camera, Projection, glam::DVec3};
    /// let lens = Projection::Perspective { fov_y: std::f64::consts::FRAC_PI_2 };
    /// let like = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, lens, [200, 100]).unwrap();
    /// let fit = CameraFit { azimuth: 0.0, elevation: Some(0.0), fill: 1.0, around: false };
    /// // A square of side 2 fills the height of a picture with 45° to each side from a distance of 1.
    /// let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
    /// let found = fit.camera(&like, &|add| corners.iter().for_each(|p| add(*p))).unwrap();
    /// assert!((found.camera.position - DVec3::Z).length() < 1e-12);
    /// ```
    pub fn camera(&self, like: &Camera, points: &EachPoint<'_>) -> Option<FoundCamera> {
        let mut bounds = DAabb::EMPTY;
        points(&mut |p| bounds = bounds.union(DAabb::new(p, p)));
        if bounds.is_empty() || !bounds.size().is_finite() {
            return None;
        }
        let size = bounds.size();
        if size.max_element() == 0.0 {
            bounds = DAabb::around(bounds.center(), DVec3::splat(LONE));
        }
        let elevation = self.elevation.unwrap_or_else(|| by_shape(bounds));
        let axes = axes(self.azimuth, elevation);
        let camera = Camera { axes, ..*like };
        let middle = bounds.center();
        let mut sides = Sides::new(&camera, self.fill, elevation);
        let mut add = |p: DVec3| if self.around { sides.add_around(p - middle) } else { sides.add(p - middle, axes) };
        if size.max_element() == 0.0 {
            bounds.corners().into_iter().for_each(add)
        } else {
            points(&mut add)
        }
        let (eye, projection) = sides.eye(like.projection, bounds.diagonal());
        let world = |v: DVec3| middle + axes[0] * v.x + axes[1] * v.y + axes[2] * v.z;
        let target = world(DVec3::new(eye.x, eye.y, 0.0));
        Some(FoundCamera {
            camera: Camera { position: world(eye), axes, projection, ..*like },
            target,
            elevation,
            bounds,
        })
    }
}

/// What is flat is seen from higher up.
fn by_shape(bounds: DAabb) -> f64 {
    let size = bounds.size();
    let width = size.x.max(size.z);
    let flatness = if size.y < width { 1.0 - size.y / width } else { 0.0 };
    (ELEVATION[0] + ELEVATION[1] * flatness).to_radians()
}

/// Right, up and forward of a camera that looks back from an azimuth and an elevation.
fn axes(azimuth: f64, elevation: f64) -> [DVec3; 3] {
    let (sin_a, cos_a) = libm::sincos(azimuth.rem_euclid(TAU));
    let (sin_e, cos_e) = libm::sincos(elevation);
    // Straight up and down as well: the picture's right is level whatever the elevation.
    let back = DVec3::new(sin_a * cos_e, sin_e, cos_a * cos_e);
    let right = DVec3::new(cos_a, 0.0, -sin_a);
    [right, back.cross(right), -back]
}

/// How far points push the sides of a view, about the middle of what is seen.
struct Sides {
    /// Tangents of half the filled angle to the right and upwards; 0 for parallel rays.
    tangent: [f64; 2],
    /// Of the four sides: right and left, top and bottom.
    most: [[f64; 2]; 2],
    /// Sine and cosine of the elevation.
    tilt: (f64, f64),
    /// Nearest depth of a point.
    nearest: f64,
    fill: f64,
    aspect: f64,
}

impl Sides {
    fn new(camera: &Camera, fill: f64, elevation: f64) -> Self {
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let half = match camera.projection {
            Projection::Perspective { fov_y } => fill * libm::tan(0.5 * fov_y),
            Projection::Orthographic { .. } => 0.0,
        };
        Self {
            tangent: [half * aspect, half],
            most: [[f64::NEG_INFINITY; 2]; 2],
            tilt: libm::sincos(elevation.clamp(-FRAC_PI_2, FRAC_PI_2)),
            nearest: f64::INFINITY,
            fill,
            aspect,
        }
    }

    fn add(&mut self, p: DVec3, axes: [DVec3; 3]) {
        let depth = axes[2].dot(p);
        self.nearest = self.nearest.min(depth);
        for side in 0..2 {
            let across = axes[side].dot(p);
            let lean = self.tangent[side] * depth;
            let [high, low] = &mut self.most[side];
            *high = high.max(across - lean);
            *low = low.max(-across - lean);
        }
    }

    /// The circle of a point about the vertical axis through the middle.
    fn add_around(&mut self, p: DVec3) {
        let (sin, cos) = self.tilt;
        let radius = DVec3::new(p.x, 0.0, p.z).length();
        self.nearest = self.nearest.min(-p.y * sin - radius * cos);
        // The farthest of a·cos φ + b·sin φ is √(a² + b²).
        let [wide, high] = self.tangent;
        let to_side = radius * (1.0 + (wide * cos).powi(2)).sqrt() + wide * sin * p.y;
        self.most[0] = self.most[0].map(|most| most.max(to_side));
        let up = p.y * (cos + high * sin) + radius * (sin - high * cos).abs();
        let down = p.y * (high * sin - cos) + radius * (sin + high * cos).abs();
        self.most[1] = [self.most[1][0].max(up), self.most[1][1].max(down)];
    }

    /// Right, up and depth of the eye, and the projection with a height that fits. `extent` is the size of all.
    fn eye(&self, projection: Projection, extent: f64) -> (DVec3, Projection) {
        let middle = self.most.map(|[high, low]| 0.5 * (high - low));
        let half = self.most.map(|[high, low]| 0.5 * (high + low));
        let depth = match projection {
            Projection::Perspective { .. } => (0..2).map(|s| -half[s] / self.tangent[s]).fold(f64::INFINITY, f64::min),
            Projection::Orthographic { .. } => {
                let height = 2.0 * half[1].max(half[0] / self.aspect) / self.fill;
                let eye = DVec3::new(middle[0], middle[1], self.nearest - height);
                return (eye, Projection::Orthographic { height });
            }
        };
        // A line that is seen end on would touch the eye.
        (DVec3::new(middle[0], middle[1], depth.min(self.nearest - CLOSEST * extent)), projection)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn like(projection: Projection) -> Camera {
        Camera { position: DVec3::ZERO, axes: [DVec3::X, DVec3::Y, DVec3::NEG_Z], projection, size: [960, 540] }
    }

    const LENS: Projection = Projection::Perspective { fov_y: 0.6 };

    /// Points without order in a lopsided box.
    fn points(shift: DVec3, scale: f64) -> Vec<DVec3> {
        let fraction = |x: f64| x - x.floor();
        let at =
            |i: f64| DVec3::new(fraction(i * 0.754_877), fraction(i * 0.569_84) * 0.4, fraction(i * 0.362_1) * 2.0);
        (1..500).map(|i| shift + scale * at(f64::from(i))).collect()
    }

    /// The largest of each point's place over half the width and height of the picture.
    fn reach(camera: &Camera, points: &[DVec3]) -> [f64; 2] {
        let focal = camera.focal_px();
        let half = camera.size.map(|s| 0.5 * f64::from(s));
        points.iter().fold([0.0; 2], |most: [f64; 2], p| {
            let v = camera.view_from_world(*p);
            let depth = if camera.is_orthographic() { 1.0 } else { v.z };
            assert!(v.z > 0.0);
            [most[0].max((v.x / depth * focal / half[0]).abs()), most[1].max((v.y / depth * focal / half[1]).abs())]
        })
    }

    fn found(fit: CameraFit, projection: Projection, points: &[DVec3]) -> FoundCamera {
        fit.camera(&like(projection), &|add| points.iter().for_each(|p| add(*p))).unwrap()
    }

    #[test]
    fn the_picture_is_filled_to_the_share_and_no_farther() {
        for projection in [LENS, Projection::Orthographic { height: 1.0 }] {
            for (azimuth, elevation) in [(0.0, 0.0), (0.5, 0.3), (4.0, -1.2), (2.0, FRAC_PI_2)] {
                let fit = CameraFit { azimuth, elevation: Some(elevation), fill: 0.8, around: false };
                let points = points(DVec3::new(3.0, -7.0, 11.0), 2.0);
                let [x, y] = reach(&found(fit, projection, &points).camera, &points);
                assert!((x.max(y) - 0.8).abs() < 1e-9, "{azimuth} {elevation}: {x} {y}");
            }
        }
    }

    #[test]
    fn from_all_around_nothing_is_cut_off_and_the_distance_stays() {
        let points = points(DVec3::ZERO, 1.0);
        let mut largest: f64 = 0.0;
        let mut heights = Vec::new();
        for k in 0..180 {
            let fit = CameraFit { azimuth: TAU * f64::from(k) / 180.0, elevation: Some(0.4), fill: 0.9, around: true };
            let found = found(fit, LENS, &points);
            let [x, y] = reach(&found.camera, &points);
            largest = largest.max(x).max(y);
            heights.push(found.camera.position.y);
        }
        assert!(largest <= 0.9 + 1e-9 && largest > 0.88, "{largest}");
        assert!(heights.iter().all(|h| (h - heights[0]).abs() < 1e-12));
    }

    #[test]
    fn scaled_by_a_power_of_two_it_has_the_same_bits_and_shifted_far_the_same_view() {
        let fit = CameraFit { azimuth: 0.5, elevation: None, fill: 0.9, around: false };
        let near = found(fit, LENS, &points(DVec3::ZERO, 1.0));
        let large = found(fit, LENS, &points(DVec3::ZERO, 1024.0));
        assert_eq!(large.camera.position, near.camera.position * 1024.0);
        assert_eq!(large.camera.axes, near.camera.axes);
        let shift = DVec3::new(1e7, -1e7, 1e7);
        let far = found(fit, LENS, &points(shift, 1.0));
        assert!((far.camera.position - shift - near.camera.position).length() < 1e-6);
    }

    #[test]
    fn a_lone_point_has_a_ball_around_it_and_no_point_no_camera() {
        let fit = CameraFit { azimuth: 0.0, elevation: None, fill: 0.9, around: false };
        let place = DVec3::new(5.0, 6.0, 7.0);
        let camera = found(fit, LENS, &[place]).camera;
        let distance = camera.position.distance(place);
        assert!(distance > 1.0 && distance < 20.0, "{distance}");
        assert_eq!(fit.camera(&like(LENS), &|_| {}), None);
    }

    #[test]
    fn flat_ground_is_seen_from_higher_up() {
        let fit = CameraFit { azimuth: 0.0, elevation: None, fill: 0.9, around: false };
        let flat: Vec<DVec3> = points(DVec3::ZERO, 1.0).into_iter().map(|p| p * DVec3::new(1.0, 0.01, 1.0)).collect();
        let tall: Vec<DVec3> = points(DVec3::ZERO, 1.0).into_iter().map(|p| p * DVec3::new(1.0, 9.0, 1.0)).collect();
        let degrees = |points: &[DVec3]| found(fit, LENS, points).elevation.to_degrees();
        assert!((degrees(&tall) - 15.0).abs() < 1e-12 && degrees(&flat) > 39.0);
    }
}
