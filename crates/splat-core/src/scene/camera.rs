//! The camera and its spaces: world → view → pixels.

use crate::Error;
use glam::{DMat3, DVec3, Mat3, Vec3};

/// How view space becomes the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// A pinhole; `fov_y` is the full vertical angle, radians, in (0, π).
    Perspective {
        /// Full vertical angle, radians.
        fov_y: f64,
    },
    /// Parallel rays; the image is `height` world units high.
    Orthographic {
        /// Height of the image, world units, > 0.
        height: f64,
    },
}

/// A camera: right-handed, +Y up in the image, looking along its −Z.
///
/// View space has x to the right, y up and z the **view depth**, positive in front.
///
/// ```
/// use splat_core::{Camera, Projection, glam::DVec3};
/// let camera = Camera::look_at(DVec3::new(0.0, 0.0, 5.0), DVec3::ZERO, DVec3::Y,
///     Projection::Perspective { fov_y: 0.6 }, [640, 480]).unwrap();
/// let p = camera.view_from_world(DVec3::new(0.0, 1.0, 0.0));
/// assert!((p - DVec3::new(0.0, 1.0, 5.0)).length() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// World position of the eye.
    pub position: DVec3,
    /// Rows: right, up and forward unit vectors in world space.
    pub axes: [DVec3; 3],
    /// Pinhole or parallel.
    pub projection: Projection,
    /// Image width and height, pixels, each 1 to 65536.
    pub size: [u32; 2],
}

/// World offsets of one cloud → view space, in f32 after the camera was subtracted in f64.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewTransform {
    /// Rotation.
    pub rotation: Mat3,
    /// View position of the cloud's origin.
    pub translation: Vec3,
}

impl ViewTransform {
    /// View position of an offset: x right, y up, z depth.
    pub fn apply(&self, offset: Vec3) -> Vec3 {
        self.rotation * offset + self.translation
    }

    /// View depth alone.
    pub fn depth(&self, offset: Vec3) -> f32 {
        // Row 2 of the rotation, as apply() would compute it.
        let m = &self.rotation;
        m.x_axis.z * offset.x + m.y_axis.z * offset.y + m.z_axis.z * offset.z + self.translation.z
    }
}

impl Camera {
    /// A camera at `position` that looks at `target`. When `up` is parallel to the view another up is taken.
    ///
    /// # Errors
    /// [`Error::Invalid`] for numbers that are not finite, `position` = `target`, a field of view outside (0, π) or an
    /// image of no pixels or more than 65536 a side.
    pub fn look_at(
        position: DVec3,
        target: DVec3,
        up: DVec3,
        projection: Projection,
        size: [u32; 2],
    ) -> Result<Self, Error> {
        let bad = |attribute, found: String, expected| {
            Err(Error::Invalid { element: "camera", index: 0, attribute, found, expected })
        };
        if !(position.is_finite() && target.is_finite() && up.is_finite()) {
            return bad("position, target, up", format!("{position}, {target}, {up}"), "finite numbers");
        }
        let Some(forward) = normalize(target - position) else {
            return bad("target", target.to_string(), "another place than the position");
        };
        match projection {
            Projection::Perspective { fov_y } if !(fov_y > 0.0 && fov_y < std::f64::consts::PI) => {
                return bad("fov_y", format!("{}°", fov_y.to_degrees()), "an angle between 0° and 180°");
            }
            Projection::Orthographic { height } if !(height.is_finite() && height > 0.0) => {
                return bad("height", height.to_string(), "a finite number > 0");
            }
            _ => {}
        }
        if size.iter().any(|s| !(1..=65536).contains(s)) {
            return bad("size", format!("{size:?}"), "1 to 65536 pixels a side");
        }
        let up = normalize(up).filter(|u| u.cross(forward).length() > 1e-9);
        let up = up.unwrap_or(if forward.y.abs() < 0.9 { DVec3::Y } else { DVec3::NEG_Z });
        let right = forward.cross(up).normalize();
        Ok(Self { position, axes: [right, right.cross(forward), forward], projection, size })
    }

    /// The same view with `antialias` times the pixels along each side, a sample each.
    #[must_use]
    pub fn with_samples(mut self, antialias: u32) -> Self {
        self.size = self.size.map(|s| s.saturating_mul(antialias));
        self
    }

    /// Number of pixels.
    pub fn pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }

    /// Multiplies all lengths by `scale`: the same picture of a world that is scaled alike.
    pub fn scale_world(&mut self, scale: f64) {
        self.position *= scale;
        if let Projection::Orthographic { height } = &mut self.projection {
            *height *= scale;
        }
    }

    /// View position of a world position: x right, y up, z depth.
    pub fn view_from_world(&self, p: DVec3) -> DVec3 {
        let d = p - self.position;
        DVec3::new(self.axes[0].dot(d), self.axes[1].dot(d), self.axes[2].dot(d))
    }

    /// The transform of offsets from `origin`, subtracted in f64 before anything becomes f32.
    pub fn view_from_offset(&self, origin: DVec3) -> ViewTransform {
        let rows = DMat3::from_cols(self.axes[0], self.axes[1], self.axes[2]).transpose();
        ViewTransform { rotation: rows.as_mat3(), translation: self.view_from_world(origin).as_vec3() }
    }

    /// Pixels per unit of x/z (perspective) or per world unit (orthographic); pixels are square.
    pub fn focal_px(&self) -> f64 {
        let height_px = f64::from(self.size[1]);
        match self.projection {
            Projection::Perspective { fov_y } => 0.5 * height_px / libm::tan(0.5 * fov_y),
            Projection::Orthographic { height } => height_px / height,
        }
    }

    /// Whether rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        matches!(self.projection, Projection::Orthographic { .. })
    }

    /// The ray through image position (x, y), pixels from the top left corner: view-space origin and direction, the
    /// direction's z being 1.
    pub fn view_ray(&self, x_px: f64, y_px: f64) -> (DVec3, DVec3) {
        let f = self.focal_px();
        let u = (x_px - 0.5 * f64::from(self.size[0])) / f;
        let v = (0.5 * f64::from(self.size[1]) - y_px) / f;
        match self.projection {
            Projection::Perspective { .. } => (DVec3::ZERO, DVec3::new(u, v, 1.0)),
            Projection::Orthographic { .. } => (DVec3::new(u, v, 0.0), DVec3::Z),
        }
    }

    /// Whether a ball in view space may reach into the pyramid, or the box, that the camera sees; wrong only beside edges, where it
    /// says yes.
    pub fn may_see(&self, middle: DVec3, radius: f64) -> bool {
        let focal = self.focal_px();
        let half = self.size.map(|s| 0.5 * f64::from(s) / focal);
        let inside = |at: f64, half: f64| {
            if self.is_orthographic() {
                at - radius <= half
            } else {
                at - half * middle.z <= radius * libm::hypot(half, 1.0)
            }
        };
        middle.z + radius > 0.0 && inside(middle.x.abs(), half[0]) && inside(middle.y.abs(), half[1])
    }

    /// Whether a convex body with these corners, in world space, may reach into the pyramid, or the box, that the camera sees: no side of that
    /// has all of it outside. Wrong only beside edges, where it says yes.
    pub fn may_see_hull(&self, corners: &[DVec3]) -> bool {
        let focal = self.focal_px();
        let beyond = |p: DVec3, axis: usize, sign: f64| {
            let half = 0.5 * f64::from(self.size[axis]) / focal;
            sign * p[axis] > half * if self.is_orthographic() { 1.0 } else { p.z }
        };
        let every_corner =
            |is_outside: &dyn Fn(DVec3) -> bool| corners.iter().all(|c| is_outside(self.view_from_world(*c)));
        let beside = |axis: usize| [-1.0, 1.0].into_iter().any(|sign| every_corner(&|p| beyond(p, axis, sign)));
        !(every_corner(&|p| p.z <= 0.0) || beside(0) || beside(1))
    }

    /// The ray through image position (x, y), pixels from the top left corner: its unit direction in world space, and the solid angle
    /// of a pixel there, sr; 0 where rays are parallel.
    pub fn direction(&self, x_px: f64, y_px: f64) -> (DVec3, f64) {
        let (_, ray) = self.view_ray(x_px, y_px);
        let direction = (self.axes[0] * ray.x + self.axes[1] * ray.y + self.axes[2] * ray.z).normalize();
        if self.is_orthographic() {
            return (direction, 0.0);
        }
        // A pixel of side 1/f at distance 1 along the view, seen at an angle whose cosine is 1/|ray|.
        let length_sq = ray.length_squared();
        (direction, 1.0 / (self.focal_px().powi(2) * length_sq * length_sq.sqrt()))
    }
}

fn normalize(v: DVec3) -> Option<DVec3> {
    // Scaled first, so that 1e±200 neither overflows nor vanishes.
    let largest = v.abs().max_element();
    (largest > 0.0).then(|| (v / largest).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_are_seen_where_their_places_are() {
        let eye = DVec3::new(3.0, 1.0, 5.0);
        let origin = DVec3::new(0.5, -0.25, 1.0);
        let camera =
            Camera::look_at(eye, DVec3::ZERO, DVec3::Y, Projection::Perspective { fov_y: 0.6 }, [4, 4]).unwrap();
        let view = camera.view_from_offset(origin);
        for offset in [Vec3::ZERO, Vec3::new(1.0, -2.0, 0.5)] {
            let expected = camera.view_from_world(origin + offset.as_dvec3()).as_vec3();
            assert!((view.apply(offset) - expected).length() < 1e-6, "{offset}");
            assert!((view.depth(offset) - expected.z).abs() < 1e-6, "{offset}");
        }
    }

    #[test]
    fn ou2_impossible_cameras_are_refused() {
        let p = Projection::Perspective { fov_y: 0.6 };
        let look = |target, projection, size| Camera::look_at(DVec3::ZERO, target, DVec3::Y, projection, size);
        assert!(look(DVec3::ZERO, p, [1, 1]).is_err());
        assert!(look(DVec3::X, p, [0, 1]).is_err());
        assert!(look(DVec3::X * f64::NAN, p, [1, 1]).is_err());
        for fov_y in [0.0, std::f64::consts::PI, f64::NAN] {
            assert!(look(DVec3::X, Projection::Perspective { fov_y }, [1, 1]).is_err());
        }
    }

    #[test]
    fn ou2_up_along_the_view_picks_another_up() {
        let camera =
            Camera::look_at(DVec3::ZERO, DVec3::Y, DVec3::Y, Projection::Orthographic { height: 1.0 }, [4, 4]).unwrap();
        assert!(camera.axes.iter().all(|a| (a.length() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn bs06_depth_keeps_its_digits_far_from_the_origin() {
        let far = DVec3::splat(1e7);
        let look = |at: DVec3| {
            let p = Projection::Perspective { fov_y: 0.6 };
            Camera::look_at(at + DVec3::Z * 5.0, at, DVec3::Y, p, [8, 8]).unwrap()
        };
        let offset = Vec3::new(0.25, 0.5, 0.125);
        let near_zero = look(DVec3::ZERO).view_from_offset(DVec3::ZERO).depth(offset);
        let shifted = look(far).view_from_offset(far).depth(offset);
        assert_eq!(near_zero, shifted);
    }

    #[test]
    fn a_ball_is_seen_as_soon_as_it_touches_the_pyramid() {
        let projection = Projection::Perspective { fov_y: std::f64::consts::FRAC_PI_2 };
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, [20, 10]).expect("a camera");
        // The upper side is y = z, which a ball at (0, 2, 1) is √½ away from.
        assert!(!camera.may_see(DVec3::new(0.0, 2.0, 1.0), 0.70));
        assert!(camera.may_see(DVec3::new(0.0, 2.0, 1.0), 0.71));
        assert!(camera.may_see(DVec3::new(1.9, 0.0, 1.0), 0.0) && !camera.may_see(DVec3::new(2.1, 0.0, 1.0), 0.0));
        assert!(!camera.may_see(DVec3::new(0.0, 0.0, -1.0), 0.9));
    }

    #[test]
    fn a_long_body_beside_the_view_is_not_seen_though_a_ball_about_it_would_be() {
        let projections =
            [Projection::Perspective { fov_y: std::f64::consts::FRAC_PI_2 }, Projection::Orthographic { height: 8.0 }];
        for projection in projections {
            let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, projection, [10, 10]).expect("a camera");
            let sees = |min: [f64; 3], max: [f64; 3]| {
                camera.may_see_hull(&crate::DAabb::new(DVec3::from_array(min), DVec3::from_array(max)).corners())
            };
            // Along the left side, which is x = −4 at a depth of 4.
            assert!(!sees([-9.0, -50.0, -4.0], [-4.1, 50.0, -3.9]));
            assert!(sees([-9.0, -50.0, -4.0], [-3.9, 50.0, -3.9]));
            assert!(!sees([-50.0, 4.1, -4.0], [50.0, 5.0, -3.0]) && sees([-50.0, 3.9, -4.0], [50.0, 5.0, -3.0]));
            assert!(!sees([-50.0, -50.0, 0.0], [50.0, 50.0, 9.0]) && sees([-50.0, -50.0, -0.1], [50.0, 50.0, 9.0]));
        }
    }
}
