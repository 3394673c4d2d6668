//! One frame of translucent splats, step by step, with buffers that live from frame to frame.

use crate::{outdoor, outdoor_cloud};
use splat_core::glam::{DVec3, Vec3};
use splat_core::raster::FoldInput;
use splat_core::raster::{Detail, OpaqueImage, Params, ProjectInput, Projected, RasterCounts, fold, project_into};
use splat_core::{Accumulator, Camera, Cloud, Direction, FootprintStack, Material, Projection, Splat, SplatKind, rng};

/// Everything that a frame of translucent splats needs, shaded values included.
pub struct Frame {
    cloud: Cloud,
    camera: Camera,
    footprints: FootprintStack,
    materials: Vec<Material>,
    values: Vec<f32>,
    scratch: hbsort::Scratch,
    order: hbsort::SliceOrder,
    projected: Projected,
}

impl Frame {
    /// The outdoor scene as `n` translucent splats.
    pub fn outdoor(n: usize) -> Self {
        let (mut cloud, camera) = outdoor_cloud(n);
        cloud.kind.iter_mut().filter(|k| **k == SplatKind::Opaque).for_each(|k| *k = SplatKind::Surface);
        let scene = outdoor();
        Self::new(cloud, camera, scene.footprints.clone(), scene.materials.clone())
    }

    /// `n` random media splats in a cube that fills the image, each 3 pixels across with the resampling filter.
    pub fn small_splats(n: usize) -> Self {
        let eye = DVec3::new(0.0, 0.0, 4.0);
        let camera = Camera::look_at(eye, DVec3::ZERO, DVec3::Y, Projection::Perspective { fov_y: 0.5 }, [600, 500])
            .expect("a camera");
        let mut cloud = Cloud::new(DVec3::ZERO);
        for i in 0..n as u64 {
            let at = Vec3::from_array([0, 1, 2].map(|k| 2.0 * rng::unit_f32(3, 3, i, k) - 1.0));
            cloud.push(&Splat { position: at, radius: 1e-3, cross_section: 1e-6, ..Splat::default() });
        }
        cloud.canonicalize();
        Self::new(cloud, camera, FootprintStack::default(), vec![Material::default()])
    }

    fn new(cloud: Cloud, mut camera: Camera, footprints: FootprintStack, materials: Vec<Material>) -> Self {
        camera.size = [600, 500];
        let values = vec![0.5; 3 * cloud.len()];
        let mut out = Self {
            cloud,
            camera,
            footprints,
            materials,
            values,
            scratch: hbsort::Scratch::new(),
            order: hbsort::SliceOrder::default(),
            projected: Projected::default(),
        };
        out.sort();
        out
    }

    /// Bytes a point of all that lives in a frame: cloud, values, order, sort scratch, footprints.
    pub fn bytes_a_point(&self) -> f64 {
        let cloud = &self.cloud;
        let columns = 12 * (cloud.position.len() + cloud.color.len() + cloud.normal.len() + cloud.tangent.len())
            + 4 * (cloud.radius.len() + cloud.cross_section.len() + cloud.object.len() + cloud.value.len())
            + 4 * cloud.shadow_coefficient.len()
            + 2 * cloud.material.len()
            + cloud.kind.len()
            + cloud.footprint.len();
        let frame = 4 * self.values.len() as u64 + self.order.bytes();
        let bytes = columns as u64 + frame + self.scratch.bytes() + self.projected.bytes();
        bytes as f64 / cloud.len() as f64
    }

    /// Splats of the cloud.
    pub fn splats(&self) -> u64 {
        self.cloud.len() as u64
    }

    /// Slices front to back.
    pub fn sort(&mut self) {
        self.scratch.recycle(std::mem::take(&mut self.order));
        let params = hbsort::Params { direction: Direction::FrontToBack, ..hbsort::Params::default() };
        self.order = hbsort::slice_cloud(&self.cloud, None, &self.camera, &params, &mut self.scratch)
            .expect("finite splats sort");
    }

    /// Footprints.
    pub fn project(&mut self) {
        let detail = Detail { depth: false, object: false };
        let footprints = &self.footprints;
        let materials = &self.materials;
        project_into(
            &mut self.projected,
            &ProjectInput {
                cloud: &self.cloud,
                camera: &self.camera,
                footprints,
                materials,
                params: &Params::default(),
                detail,
            },
        );
    }

    /// What a device composites: the footprints and the order as they are, into an empty image.
    pub fn with_input<T>(&self, work: impl FnOnce(&FoldInput<'_>, &Accumulator) -> T) -> T {
        let input = FoldInput {
            projected: &self.projected,
            order: &self.order.input_from_sorted,
            values: &self.values,
            materials: &self.materials,
            opaque: &OpaqueImage::default(),
            direction: Direction::FrontToBack,
            params: &Params::default(),
        };
        work(&input, &Accumulator::new(self.camera.size, 1, 3, false, false))
    }

    /// Composites.
    pub fn fold(&mut self) -> RasterCounts {
        let mut acc = Accumulator::new(self.camera.size, 1, 3, false, false);
        let input = FoldInput {
            projected: &self.projected,
            order: &self.order.input_from_sorted,
            values: &self.values,
            materials: &self.materials,
            opaque: &OpaqueImage::default(),
            direction: Direction::FrontToBack,
            params: &Params::default(),
        };
        let counts = fold(&input, &mut acc, None).expect("invariant: nobody cancels");
        std::hint::black_box(&acc);
        counts
    }
}
