//! Normals: solved for from the samples of neighbouring pixels and sheets, or those of a gradient volume.

use super::{Image, SlabVoxels, View};
use crate::image_aligned::reference::{normal_of_field, normal_of_volume};
use crate::shared::params::Gradients;
use splat_core::glam::{DMat3, DVec3, DVec4, Vec3};

impl View<'_> {
    /// −∇v/|∇v| of a volume at a pixel of a slab, whose middle has these slab coordinates; of one without normals 0.
    pub(super) fn normal(
        &self,
        eye: &Image,
        around: &SlabVoxels,
        v: usize,
        slab: u32,
        pixel: usize,
        middle: DVec3,
    ) -> Vec3 {
        let volume = self.placed[v].volume;
        if !volume.normals {
            return Vec3::ZERO;
        }
        match self.params.sheets.gradients {
            Gradients::Sheets => {}
            Gradients::Volume => return normal_of_volume(volume, self.frame.world(middle)),
            Gradients::Kernel => return normal_of_field(volume, &self.gathered[v], self.frame.world(middle)),
        }
        let [width, height] = eye.camera.size.map(|s| s as usize);
        // a, b, s and value of a neighbour that is inside.
        let sample = |[x, y, n]: [isize; 3]| -> Option<DVec4> {
            let [x, y] = [(pixel % width).checked_add_signed(x)?, (pixel / width).checked_add_signed(y)?];
            let beside = slab.checked_add_signed(n as i32)?;
            let pixel = (x < width && y < height).then_some(y * width + x)?;
            let voxels = [&around.before, &around.here, &around.after][(n + 1) as usize];
            let part = self.part(eye, &voxels[v], v, beside, pixel)?;
            let q = self.place(&eye.camera, pixel, 0.5 * (part.near + part.far));
            Some(DVec4::new(q.x, q.y, q.z, part.value))
        };
        let Some(here) = sample([0; 3]) else {
            return Vec3::ZERO;
        };
        let difference = |step: [isize; 3]| sample(step).unwrap_or(here) - sample(step.map(|n| -n)).unwrap_or(here);
        let rows = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map(difference);
        let [x, y, mut z] = rows.map(|row| row.truncate());
        // Without a neighbour across the slabs there is no gradient across them.
        z.z = if z.z == 0.0 { 1.0 } else { z.z };
        let steps = DMat3::from_cols(x, y, z).transpose();
        let differences = DVec3::new(rows[0].w, rows[1].w, rows[2].w);
        // Nor one along them without any along a row or a column.
        let gradient = match steps.determinant() {
            0.0 => DVec3::Z * differences.z / z.z,
            _ => steps.inverse() * differences,
        };
        let [a, b, across] = self.frame.axes;
        -(a * gradient.x + b * gradient.y + across * gradient.z).normalize_or_zero().as_vec3()
    }
}
