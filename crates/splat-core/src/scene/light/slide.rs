//! A slide: a picture that a light shines through, as that of a projector ("projective textured lights": Zhang and Crawfis, section 6).
//!
//! A world point p lies at (u, v) of the picture, 0 to 1 from its top left, with d = p − origin, and w = d·axis for light from a place, 1
//! for parallel light:
//!
//! u = ½ + d·across/w,  v = ½ + d·down/w.
//!
//! The frame around the picture lets nothing through, and nothing shines backwards, w ≤ 0. Between centres of texels look-ups are
//! bilinear; at the border the last texel goes on to the edge. A receiver of deviation σ sees a mean.
//! It blends the two levels of an image pyramid (each of half as many texels a side) whose texels are nearest to 2σ.

use super::LightShape;
use crate::shapes::image_levels::{Border, ImageLevels};
use crate::{Error, RadianceImage};
use glam::DVec3;

/// Where each world point lies in a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlideProjection {
    /// The light, or for parallel light the point that the middle of the picture falls on; world.
    pub origin: DVec3,
    /// Unit direction of travel along the axis of light from a place; `None` for parallel light.
    pub axis: Option<DVec3>,
    /// To the right of the picture, as it is seen along the light, over its width: that at a distance of 1 along the axis, or in world
    /// units for parallel light.
    pub across: DVec3,
    /// Down in the picture, over its height in the same way.
    pub down: DVec3,
}

/// How a picture lies before a light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Framing {
    /// World direction that is upwards in the picture; any length but 0, not along the light.
    pub up: DVec3,
    /// Width of the picture, > 0, as [`SlideProjection::across`] has it. `None` is for spots alone: the shorter side of the picture is as wide
    /// as the cone.
    pub width: Option<f64>,
    /// The world point that the middle of the picture of parallel light falls on.
    pub center: DVec3,
}

/// A picture and how it lies before its light.
///
/// ```
/// use splat_core::{Framing, LightShape, RadianceImage, Slide, glam::DVec3};
/// let halves = RadianceImage { size: [2, 1], pixels: vec![[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] };
/// let sun = LightShape::Directional { direction: DVec3::NEG_Z };
/// let slide = Slide::new(&halves, &sun, &Framing { up: DVec3::Y, width: Some(2.0), center: DVec3::ZERO }).unwrap();
/// assert_eq!(slide.passing(DVec3::new(-0.5, 0.2, 7.0), 0.0), [1.0, 0.0, 0.0]);
/// assert_eq!(slide.passing(DVec3::new(-1.5, 0.2, 7.0), 0.0), [0.0; 3]);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Slide {
    projection: SlideProjection,
    picture: ImageLevels,
}

impl SlideProjection {
    /// That of a picture of `size` before a light.
    ///
    /// # Errors
    /// [`Error::Invalid`] for a light that is neither a spot nor parallel, and for numbers of the framing that do not hold.
    fn new(size: [u32; 2], light: &LightShape, framing: &Framing) -> Result<Self, Error> {
        let fault = |attribute, found: String, expected| Error::invalid("slide", 0, attribute, found, expected);
        let [width, height] = size.map(f64::from);
        let (origin, direction, axis, covering) = match *light {
            LightShape::Spot { position, direction, outer, .. } => {
                let side = 2.0 * libm::tan(outer);
                (position, direction, Some(direction), Some(side * (width / height).max(1.0)))
            }
            LightShape::Directional { direction } => (framing.center, direction, None, None),
            other => return Err(fault("light", format!("{other:?}"), "a spot or parallel light")),
        };
        let right = direction.cross(framing.up).normalize_or_zero();
        if right == DVec3::ZERO {
            return Err(fault("up", framing.up.to_string(), "a direction that is not along the light"));
        }
        let across = framing.width.or(covering).filter(|w| w.is_finite() && *w > 0.0);
        let Some(across) = across.filter(|w| (w.recip() * height / width).is_finite()) else {
            return Err(fault("width", format!("{:?}", framing.width), "a finite length > 0"));
        };
        if !origin.is_finite() {
            return Err(fault("center", origin.to_string(), "finite numbers"));
        }
        let down = direction.cross(right);
        Ok(Self { origin, axis, across: right / across, down: down / (across * height / width) })
    }

    /// Place in the picture and widths of the picture per world unit there; `None` behind the light.
    fn place(&self, p: DVec3) -> Option<([f64; 2], f64)> {
        let d = p - self.origin;
        let w = self.axis.map_or(1.0, |axis| d.dot(axis));
        let at = [self.across, self.down].map(|side| 0.5 + d.dot(side) / w);
        (w > 0.0).then(|| (at, self.across.length() / w))
    }
}

impl Slide {
    /// A picture before a light.
    ///
    /// # Errors
    /// [`Error::Invalid`] as from [`RadianceImage::validate`], for a light that is neither a spot nor parallel, and for numbers of the
    /// framing that do not hold.
    pub fn new(image: &RadianceImage, light: &LightShape, framing: &Framing) -> Result<Self, Error> {
        image.validate()?;
        let projection = SlideProjection::new(image.size, light, framing)?;
        Ok(Self { projection, picture: ImageLevels::new(image.clone(), Border::Goes) })
    }

    /// Where world points lie in it.
    pub fn projection(&self) -> &SlideProjection {
        &self.projection
    }

    /// The picture as it was given.
    pub fn image(&self) -> &RadianceImage {
        self.picture.image()
    }

    /// Factor on the light that arrives at a world point, per channel; `spread` is the deviation of the splat that receives it, world
    /// units, 0 for a bare point.
    pub fn passing(&self, p: DVec3, spread: f64) -> [f32; 3] {
        self.projection.place(p).map_or([0.0; 3], |(at, per)| self.look_up(at, spread * per))
    }

    /// The same at a place of the picture; `spread` in widths of the picture.
    pub fn look_up(&self, at: [f64; 2], spread: f64) -> [f32; 3] {
        if !at.iter().all(|v| (0.0..=1.0).contains(v)) {
            return [0.0; 3];
        }
        let texels = 2.0 * spread * f64::from(self.image().size[0]);
        self.picture.at(at, texels).map(|v| v as f32)
    }

    /// The most that it lets through in any channel.
    pub fn brightest(&self) -> f32 {
        self.image().pixels.iter().flatten().fold(0.0, |most, v| most.max(*v))
    }

    /// Multiplies all lengths by `scale`, as [`Light::scaled`](crate::Light::scaled) does.
    pub fn scale_world(&mut self, scale: f64) {
        self.projection.origin *= scale;
        if self.projection.axis.is_none() {
            self.projection.across /= scale;
            self.projection.down /= scale;
        }
    }

    /// Bytes that it takes.
    pub fn bytes(&self) -> u64 {
        self.picture.bytes()
    }

    /// Bytes that a slide of a picture of this size takes.
    pub fn bytes_of(size: [u32; 2]) -> u64 {
        ImageLevels::bytes_of(size)
    }
}
