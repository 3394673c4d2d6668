//! Where everything lies in one sweep: slabs, the volumes in them, the eye's image.

use super::input::HalfInput;
use crate::half_vector::eye::gradient::Gradients;
use crate::half_vector::light::buffer::LightBuffer;
use crate::half_vector::slicing::axis::HalfVector;
use crate::half_vector::slicing::buckets::{Buckets, records};
use crate::half_vector::slicing::frame::Frame;
use crate::half_vector::slicing::gathered::GatheredVolume;
use crate::half_vector::slicing::placed::Placed;
use crate::half_vector::slicing::sight::{Shape, Sight};
use crate::shared::depths::DepthRange;
use crate::shared::gathered::gradient::KernelGradients;
use crate::shared::gradient_volume::GradientVolume;
use crate::shared::params::Reconstruction;
use crate::shared::pixel::Pixel;
use crate::shared::shadows::Shadows;
use crate::shared::voxels::Voxels;
use crate::{Error, Params, Volume};
use splat_core::glam::{DVec3, Vec3};
use splat_core::shade::LitBy;

/// Per-volume data of the voxels that may be seen, or that shape those.
pub(crate) struct VolumeVoxels<'a> {
    pub(crate) voxels: Voxels,
    pub(crate) values: Values<'a>,
    /// Shadows of what light is not carried through, where a light has any.
    pub(crate) shadows: Option<Shadows<'a>>,
    /// Central-difference gradients, where normals come from a gradient volume.
    pub(crate) gradients: Option<GradientVolume>,
    /// Where normals come from the field that sheets read.
    pub(crate) kernel_gradients: Option<KernelGradients>,
}

/// What sheets get the values of a volume from.
pub(crate) enum Values<'a> {
    /// The voxels in the order in which the eye's sheets take them.
    Splatted(Buckets),
    /// A lattice that pixels read.
    Gathered(GatheredVolume<'a>),
}

impl Values<'_> {
    /// Bytes of lists, or of a filtered lattice.
    pub(crate) fn bytes(&self) -> u64 {
        match self {
            Self::Splatted(buckets) => buckets.bytes(),
            Self::Gathered(volume) => volume.bytes(),
        }
    }
}

/// Everything of a sweep that does not depend on its light.
pub(crate) struct Geometry<'a> {
    pub(crate) volumes: &'a [Volume<'a>],
    pub(crate) placed: Vec<Placed<'a>>,
    pub(crate) frame: Frame,
    /// The eye's image.
    pub(crate) sight: Sight,
    /// Footprints in the eye's image, by volume.
    pub(crate) shapes: Vec<Shape>,
    pub(crate) gradients: Gradients,
    pub(crate) params: Params,
    /// By volume; empty until [`Geometry::sort_voxels`].
    pub(crate) voxels: Vec<VolumeVoxels<'a>>,
}

impl<'a> Geometry<'a> {
    /// Slabs across an axis, and the volumes in them.
    pub(crate) fn new(input: &'a HalfInput<'a>, params: &Params, axis: &HalfVector) -> Result<Self, Error> {
        let camera = input.sheets.camera;
        let volumes = &input.sheets.volumes[..];
        let frame = Frame::new(&input.bodies(), camera, params, axis)?;
        let placed: Vec<Placed<'a>> = volumes.iter().map(|v| Placed::new(v, &frame, params)).collect();
        let sight = Sight::new(&frame, *camera);
        let shapes = placed.iter().map(|p| sight.shape(&frame, p)).collect();
        let gradients = Gradients::new(&frame);
        Ok(Self { volumes, placed, frame, sight, shapes, gradients, params: *params, voxels: Vec::new() })
    }

    /// Finds the voxels that matter, with the shadows there that are known, and sorts them for both images (steps 3 and 4).
    ///
    /// `shadow_origin` is the world position that receivers of shadows are relative to.
    pub(crate) fn sort_voxels(
        &mut self,
        lights: &[LitBy<'a>],
        mut buffer: Option<&mut LightBuffer>,
        shadow_origin: DVec3,
    ) {
        for (v, placed) in self.placed.iter().enumerate() {
            if let Reconstruction::Gather(kernel) = self.params.reconstruction {
                let (volume, lattice, voxels) = GatheredVolume::new(placed, kernel, &self.frame, &self.sight);
                let receivers = placed.receivers(&voxels, lattice.rim);
                let shadows = Shadows::new(&receivers, lights, shadow_origin);
                let gradients = GradientVolume::new(&receivers, &lattice, &self.params);
                let differentiates = self.params.differentiates(placed.volume);
                let kernel_gradients = differentiates.then(|| KernelGradients::new(&placed.lattice_rows()));
                let values = Values::Gathered(volume);
                self.voxels.push(VolumeVoxels { voxels, values, shadows, gradients, kernel_gradients });
                continue;
            }
            let shape = &self.shapes[v];
            let mut reach = placed.lattice_reach(shape.extent(), self.sight.widest_pixel(&self.frame, placed));
            if let Some(buffer) = &buffer {
                let light = placed.lattice_reach(buffer.shape(v).extent(), 0.0);
                (0..3).for_each(|a| reach[a] = reach[a].max(light[a]));
            }
            let (lattice, voxels) = placed.voxels(reach);
            let receivers = placed.receivers(&voxels, lattice.rim);
            let shadows = Shadows::new(&receivers, lights, shadow_origin);
            let records = records(placed, &lattice, &voxels);
            let buckets = Buckets::new(&records, placed, &self.frame, &self.sight, shape);
            if let Some(buffer) = &mut buffer {
                let lists = Buckets::new(&records, placed, &self.frame, &buffer.sight, buffer.shape(v));
                buffer.push(lists);
            }
            let gradients = GradientVolume::new(&receivers, &lattice, &self.params);
            let values = Values::Splatted(buckets);
            self.voxels.push(VolumeVoxels { voxels, values, shadows, gradients, kernel_gradients: None });
        }
    }

    /// Depths across the slabs between which some places lie, world.
    pub(crate) fn depths_of(&self, places: impl Iterator<Item = DVec3>) -> DepthRange {
        let mut near = f64::INFINITY;
        let mut far = f64::NEG_INFINITY;
        for place in places {
            let depth = self.frame.point(place).z;
            near = near.min(depth);
            far = far.max(depth);
        }
        DepthRange { near: near as f32, far: far as f32 }
    }

    /// Unit direction from what a pixel sees to the eye.
    #[inline]
    pub(crate) fn to_eye(&self, pixel: Pixel) -> Vec3 {
        let camera = &self.sight.camera;
        let [right, up, forward] = camera.axes;
        let (_, along) = camera.view_ray(pixel.x as f64 + 0.5, pixel.y as f64 + 0.5);
        -(right * along.x + up * along.y + forward * along.z).normalize().as_vec3()
    }

    /// View depth of a pixel's ray at a depth across the slabs.
    pub(crate) fn view_depth(&self, pixel: Pixel, depth: f32) -> f64 {
        let ray = self.frame.ray(&self.sight.camera, pixel.x as f64 + 0.5, pixel.y as f64 + 0.5);
        (f64::from(depth) - ray.from.z) / ray.along.z
    }
}
