//! Clouds of splats: an f64 origin and f32 columns with the rendering-oriented attributes of Gunjee 2007, section 3.

mod checked;

pub use checked::Unfit;

use crate::{Aabb, Error, Gaussians};
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::sync::Arc;

/// Centres per task of [`Cloud::bounds`].
const BOUNDED: usize = 1 << 14;

/// What a splat is optically.
#[repr(u8)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub enum SplatKind {
    /// A piece of a participating medium: an isotropic kernel around the position.
    #[default]
    Medium = 0,
    /// A piece of a translucent surface: a disc in the tangent plane.
    Surface = 1,
    /// A piece of an opaque surface: a disc that ends every ray.
    Opaque = 2,
}

/// One splat with all its attributes, in row form; [`Cloud`] keeps them as columns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Splat {
    /// Centre, world units, relative to the cloud's origin.
    pub position: Vec3,
    /// Cutoff radius of the kernel, world units, > 0: the kernel is zero from there on. For a disc with a
    /// `tangent` it is the second principal radius.
    pub radius: f32,
    /// Extinction cross-section K, an area in world units², ≥ 0: the optical depth at u is K·w(u) with ∫w dA = 1.
    /// For a surface it is the optical depth of one crossing times the area that the splat stands for; an opaque
    /// splat stores that area alone.
    pub cross_section: f32,
    /// Linear Rec.709 colour, each channel ≥ 0: surface albedo, or the tint of a medium's scattering.
    pub color: [f32; 3],
    /// Medium, translucent surface or opaque surface.
    pub kind: SplatKind,
    /// Index into the [`crate::MaterialTable`].
    pub material: u16,
    /// Index into the [`crate::FootprintStack`] (the paper's texture id).
    pub footprint: u8,
    /// Index into the [`crate::ObjectTable`].
    pub object: u32,
    /// Unit normal, or zero for none. A disc lies across it.
    pub normal: Vec3,
    /// Unit normal that light is reflected about, or zero where that is `normal`: the interpolated one of a mesh whose
    /// triangles are coarser than the surface that they stand for.
    pub shading_normal: Vec3,
    /// Semi-axis of the tangent disc along the first principal direction, or zero for a circular disc. Of a Gaussian the longest way from its
    /// centre to where it is not seen any more.
    pub tangent: Vec3,
    /// Share of the shadow that this splat receives, in \[0, 1\]; the paper's shadow coefficient.
    pub shadow_coefficient: f32,
    /// The physical value that the splat was made from (density, temperature, intensity …), any finite number.
    pub value: f32,
    /// Optical depth of one crossing of the translucent surface that a disc is a piece of, ≥ 0; 0 where it is not known. The area
    /// that the disc stands for is `cross_section` over it. It tells the opacity of a layer where discs are blended before layers are.
    pub crossing_depth: f32,
    /// Place in [`Cloud::gaussians`] of the Gaussian that it is seen as, or [`Gaussians::NONE`].
    pub gaussian: u32,
}

impl Default for Splat {
    fn default() -> Self {
        Self {
            position: Vec3::ZERO,
            radius: 1.0,
            cross_section: 1.0,
            color: [1.0; 3],
            kind: SplatKind::Medium,
            material: 0,
            footprint: 0,
            object: 0,
            normal: Vec3::ZERO,
            shading_normal: Vec3::ZERO,
            tangent: Vec3::ZERO,
            shadow_coefficient: 1.0,
            value: 0.0,
            crossing_depth: 0.0,
            gaussian: Gaussians::NONE,
        }
    }
}

macro_rules! columns {
    (required: $($(#[$rm:meta])* $r:ident: $rt:ty,)* ; optional: $($(#[$om:meta])* $o:ident: $ot:ty = $od:expr,)*) => {
        /// Splats as columns. The last seven columns may be empty, which means their default for every splat.
        ///
        /// The id of a splat is its rank; [`Cloud::canonicalize`] makes that independent of the order of the input.
        ///
        /// ```
        /// use splat_core::{Cloud, Splat, glam::{DVec3, Vec3}};
        /// let mut cloud = Cloud::new(DVec3::new(6.4e5, 0.0, 8.5e5));
        /// cloud.push(&Splat { position: Vec3::new(0.5, 0.0, 0.0), radius: 0.1, ..Splat::default() });
        /// assert_eq!(cloud.len(), 1);
        /// cloud.validate().unwrap();
        /// ```
        #[derive(Debug, Clone, Default, PartialEq)]
        pub struct Cloud {
            /// World position that every offset is relative to.
            pub origin: DVec3,
            $($(#[$rm])* pub $r: Vec<$rt>,)*
            $($(#[$om])* pub $o: Vec<$ot>,)*
            /// Gaussians that splats are seen as.
            pub gaussians: Arc<Gaussians>,
        }

        impl Cloud {
            /// An empty cloud around `origin`.
            pub fn new(origin: DVec3) -> Self {
                Self { origin, ..Self::default() }
            }

            /// Room for `n` more splats in the required columns.
            pub fn reserve(&mut self, n: usize) {
                $(self.$r.reserve(n);)*
            }

            /// Appends one splat; an optional column comes into being with the first value that is not its default.
            pub fn push(&mut self, splat: &Splat) {
                let n = self.len();
                $(self.$r.push(splat.$r);)*
                $(if !self.$o.is_empty() || splat.$o != $od {
                    self.$o.resize(n, $od);
                    self.$o.push(splat.$o);
                })*
            }

            /// Splat `i` in row form.
            ///
            /// # Panics
            /// If `i` is out of range.
            pub fn get(&self, i: usize) -> Splat {
                Splat { $($r: self.$r[i],)* $($o: self.$o.get(i).copied().unwrap_or($od),)* }
            }

            /// Appends another cloud, rebased to this cloud's origin in f64.
            pub fn append(&mut self, other: &Cloud) {
                let n = self.len();
                let shift = other.origin - self.origin;
                $(self.$r.extend_from_slice(&other.$r);)*
                if shift != DVec3::ZERO {
                    for p in &mut self.position[n..] {
                        *p = (p.as_dvec3() + shift).as_vec3();
                    }
                }
                let total = self.len();
                $(if !self.$o.is_empty() || !other.$o.is_empty() {
                    self.$o.resize(n, $od);
                    self.$o.extend_from_slice(&other.$o);
                    self.$o.resize(total, $od);
                })*
                self.append_gaussians(n, other);
            }

            /// The splats `ids`, in that order.
            pub fn gather(&self, ids: &[u32]) -> Cloud {
                fn pick<T: Copy + Send + Sync>(column: &[T], ids: &[u32]) -> Vec<T> {
                    use rayon::prelude::*;
                    if column.is_empty() { return Vec::new(); }
                    ids.par_iter().with_min_len(8192).map(|&i| column[i as usize]).collect()
                }
                let gaussians = Arc::clone(&self.gaussians);
                Cloud { origin: self.origin, $($r: pick(&self.$r, ids),)* $($o: pick(&self.$o, ids),)* gaussians }
            }

            /// Bytes held by the columns.
            pub fn bytes(&self) -> u64 {
                let mut bytes = 0;
                $(bytes += std::mem::size_of_val(self.$r.as_slice());)*
                $(bytes += std::mem::size_of_val(self.$o.as_slice());)*
                bytes as u64 + self.gaussians.bytes()
            }

            fn check_lengths(&self) -> Result<(), Error> {
                let expected = self.len();
                $(if self.$r.len() != expected {
                    return Err(Error::ColumnLength { attribute: stringify!($r), found: self.$r.len(), expected });
                })*
                $(if !self.$o.is_empty() && self.$o.len() != expected {
                    return Err(Error::ColumnLength { attribute: stringify!($o), found: self.$o.len(), expected });
                })*
                Ok(())
            }
        }
    };
}

columns! {
    required:
    /// Centres, see [`Splat::position`].
    position: Vec3,
    /// Cutoff radii, see [`Splat::radius`].
    radius: f32,
    /// Extinction cross-sections, see [`Splat::cross_section`].
    cross_section: f32,
    /// Colours, see [`Splat::color`].
    color: [f32; 3],
    /// Kinds, see [`Splat::kind`].
    kind: SplatKind,
    /// Material ids.
    material: u16,
    /// Footprint ids.
    footprint: u8,
    /// Object ids.
    object: u32,
    ;
    optional:
    /// Unit normals, zero for none; may be empty.
    normal: Vec3 = Vec3::ZERO,
    /// Unit normals of shading, zero for `normal`; may be empty.
    shading_normal: Vec3 = Vec3::ZERO,
    /// First semi-axes of elliptical tangent discs, zero for circular; may be empty.
    tangent: Vec3 = Vec3::ZERO,
    /// Shadow coefficients; may be empty, which means 1.
    shadow_coefficient: f32 = 1.0,
    /// Physical values; may be empty.
    value: f32 = 0.0,
    /// Optical depths of one crossing, see [`Splat::crossing_depth`]; may be empty, which means that none is known.
    crossing_depth: f32 = 0.0,
    /// Places in the table of Gaussians, see [`Splat::gaussian`]; may be empty, which means that no splat is one.
    gaussian: u32 = Gaussians::NONE,
}

impl Cloud {
    /// Number of splats.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True without splats.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Normal of splat `i`, zero for none.
    pub fn normal_of(&self, i: usize) -> Vec3 {
        self.normal.get(i).copied().unwrap_or(Vec3::ZERO)
    }

    /// Normal that splat `i` reflects light about, zero for none.
    pub fn shading_normal_of(&self, i: usize) -> Vec3 {
        self.shading_normal.get(i).copied().filter(|n| *n != Vec3::ZERO).unwrap_or_else(|| self.normal_of(i))
    }

    /// First semi-axis of splat `i`'s disc, zero for circular.
    pub fn tangent_of(&self, i: usize) -> Vec3 {
        self.tangent.get(i).copied().unwrap_or(Vec3::ZERO)
    }

    /// Shadow coefficient of splat `i`.
    pub fn shadow_coefficient_of(&self, i: usize) -> f32 {
        self.shadow_coefficient.get(i).copied().unwrap_or(1.0)
    }

    /// Optical depth of one crossing of the surface that disc `i` is a piece of. Where it is not known the disc stands for the cell of
    /// a square lattice whose discs have the `spacing` of its footprint.
    pub fn crossing_depth_of(&self, i: usize, spacing: f32) -> f32 {
        let known = self.crossing_depth.get(i).copied().filter(|tau| *tau > 0.0);
        known.unwrap_or_else(|| self.cross_section[i] / (spacing * spacing))
    }

    /// Bounds of the centres, relative to the origin; empty bounds for an empty cloud.
    pub fn bounds(&self) -> Aabb {
        let chunks = self.position.par_chunks(BOUNDED);
        chunks.map(Aabb::of_points).reduce(|| Aabb::EMPTY, Aabb::union)
    }

    /// Multiplies all lengths by `scale`, cross-sections by its square.
    pub fn scale_world(&mut self, scale: f64) {
        let length = scale as f32;
        let area = (scale * scale) as f32;
        self.origin *= scale;
        self.position.iter_mut().for_each(|p| *p *= length);
        self.radius.iter_mut().for_each(|r| *r *= length);
        self.tangent.iter_mut().for_each(|t| *t *= length);
        self.cross_section.iter_mut().for_each(|k| *k *= area);
        self.scale_gaussians(length);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_and_columns_take_as_many_bytes_as_they_say() {
        let bytes = |splat: Splat| {
            let mut cloud = Cloud::default();
            (0..10).for_each(|_| cloud.push(&splat));
            cloud.bytes() / 10
        };
        assert_eq!(bytes(Splat::default()), 40);
        assert_eq!(bytes(Splat { normal: Vec3::Z, ..Splat::default() }), 52);
    }
}
