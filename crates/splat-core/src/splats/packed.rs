//! A cloud in 13 to 25 bytes a splat, for what is kept and not drawn just now (Gunjee 2007, section 6, leaves compressed attributes for later).
//!
//! Splats stay in their order, in blocks of 256; in canonical order a block is small. What a number is counted in is its block's own:
//!
//! | attribute | bits | step |
//! |---|---|---|
//! | position | 3 × 16 | even, 1/65535 of the block's sides |
//! | normal | 2 × 8 | octahedral (Meyer et al. 2010), the nearest of four, within 0.64° |
//! | radius | 8 | even in the square root, 1/255 of the block's range |
//! | cross-section, crossing depth | 16 | even in the square root, 1/65535 of the block's range |
//! | colour | 3 × 8 | even in the square root, 1/255 of the block's brightest |
//! | value | 16 | even, 1/65535 of the block's range |
//! | shading normal | 2 × 8 | as the normal; none stays none |
//! | tangent | 2 × 8, 8 | direction as the normal; length as the radius, those without a tangent left out |
//! | shadow coefficient | 8 | even, 1/255 of the block's range |
//! | kind, material, footprint, object | 8 | none: a place in the block's list of those that occur together |
//!
//! A number is off by half a step at most, and by rounding to f32. What a block has one of is kept exactly. Columns that are empty stay so.

mod block;
mod bytes;
mod octahedral;

use crate::{Cloud, Error};
use block::{Block, Look};
use glam::{DVec3, Vec3};
use rayon::prelude::*;

/// Splats of a block.
const BLOCK: usize = 256;
/// Blocks that one task packs or unpacks at least.
const FEW: usize = 32;

/// A cloud that is kept, see the crate's README for its errors.
///
/// ```
/// use splat_core::{Cloud, PackedCloud, Splat, glam::{DVec3, Vec3}};
/// let mut cloud = Cloud::new(DVec3::new(1e7, 0.0, 0.0));
/// (0..1000).for_each(|i| cloud.push(&Splat { position: Vec3::X * i as f32, ..Splat::default() }));
/// let packed = PackedCloud::new(&cloud).unwrap();
/// let again = packed.unpack();
/// assert!(packed.bytes() < 16 * 1000 && cloud.bytes() == 40 * 1000);
/// assert!(cloud.position.iter().zip(&again.position).all(|(a, b)| a.distance(*b) <= 0.5 * 255.0 / 65535.0 * 1.01));
/// assert_eq!((again.radius, again.color), (cloud.radius, cloud.color));
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct PackedCloud {
    origin: DVec3,
    blocks: Vec<Block>,
    /// Of all blocks, one after the other.
    looks: Vec<Look>,
    look: Vec<u8>,
    position: Vec<[u16; 3]>,
    radius: Vec<u8>,
    cross_section: Vec<u16>,
    color: Vec<[u8; 3]>,
    normal: Vec<[i8; 2]>,
    value: Vec<u16>,
    crossing_depth: Vec<u16>,
    shading_normal: Vec<[i8; 2]>,
    tangent: Vec<Tangent>,
    shadow_coefficient: Vec<u8>,
}

/// Direction and length of a tangent.
type Tangent = ([i8; 2], u8);

impl PackedCloud {
    /// Packs a cloud; the same bits for any number of threads.
    ///
    /// # Errors
    /// Those of [`Cloud::validate`], and [`Error::Invalid`] for a cloud with Gaussians, whose table is larger than their splats.
    pub fn new(cloud: &Cloud) -> Result<Self, Error> {
        cloud.validate()?;
        if let Some(i) = (0..cloud.gaussian.len()).find(|i| cloud.gaussian_of(*i).is_some()) {
            return Err(Error::invalid("splat", i, "gaussian", cloud.gaussian[i], "none: Gaussians are not packed"));
        }
        let ranges = (0..cloud.len().div_ceil(BLOCK)).into_par_iter().with_min_len(FEW);
        let (mut blocks, lists): (Vec<Block>, Vec<Vec<Look>>) =
            ranges.map(|b| Block::new(cloud, b * BLOCK..cloud.len().min((b + 1) * BLOCK))).unzip();
        let mut first = 0;
        for (block, looks) in blocks.iter_mut().zip(&lists) {
            block.first_look = first;
            first += looks.len() as u32;
        }
        let looks = lists.concat();
        let place_of_look = |i: usize| {
            let look = Look::from_splat(cloud, i);
            let first = blocks[i / BLOCK].first_look as usize;
            looks[first..].iter().position(|l| *l == look).unwrap_or(0) as u8
        };
        Ok(Self {
            origin: cloud.origin,
            look: (0..cloud.len()).into_par_iter().with_min_len(FEW * BLOCK).map(place_of_look).collect(),
            position: by_block(&blocks, &cloud.position, |b, p| b.places(*p)),
            radius: by_block(&blocks, &cloud.radius, |b, v| b.radius.step_of(*v) as u8),
            cross_section: by_block(&blocks, &cloud.cross_section, |b, v| b.cross_section.step_of(*v)),
            color: by_block(&blocks, &cloud.color, |b, c| c.map(|v| b.color.step_of(v) as u8)),
            normal: by_block(&blocks, &cloud.normal, |_, n| octahedral::steps(*n)),
            value: by_block(&blocks, &cloud.value, |b, v| b.value.step_of(*v)),
            crossing_depth: by_block(&blocks, &cloud.crossing_depth, |b, v| b.crossing_depth.step_of(*v)),
            shading_normal: by_block(&blocks, &cloud.shading_normal, |_, n| octahedral::steps_if_any(*n)),
            tangent: by_block(&blocks, &cloud.tangent, |b, t| {
                // One whose length no number holds is that of a round disc.
                let length = t.length();
                let direction = if length > 0.0 { *t } else { Vec3::ZERO };
                (octahedral::steps_if_any(direction), b.tangent.step_of(length) as u8)
            }),
            shadow_coefficient: by_block(&blocks, &cloud.shadow_coefficient, |b, v| {
                b.shadow_coefficient.step_of(*v) as u8
            }),
            blocks,
            looks,
        })
    }

    /// The cloud again, in its order, as far as steps go; the same bits for any number of threads.
    pub fn unpack(&self) -> Cloud {
        let blocks = &self.blocks;
        let look = |b: &Block, l: &u8| self.looks[b.first_look as usize + usize::from(*l)];
        let mut cloud = Cloud {
            position: by_block(blocks, &self.position, |b, p| b.place(*p)),
            radius: by_block(blocks, &self.radius, |b, v| b.radius.value(f32::from(*v))),
            cross_section: by_block(blocks, &self.cross_section, |b, v| b.cross_section.value(f32::from(*v))),
            color: by_block(blocks, &self.color, |b, c| c.map(|v| b.color.value(f32::from(v)))),
            kind: by_block(blocks, &self.look, |b, l| look(b, l).kind),
            material: by_block(blocks, &self.look, |b, l| look(b, l).material),
            footprint: by_block(blocks, &self.look, |b, l| look(b, l).footprint),
            object: by_block(blocks, &self.look, |b, l| look(b, l).object),
            normal: by_block(blocks, &self.normal, |_, n| octahedral::normal(*n)),
            value: by_block(blocks, &self.value, |b, v| b.value.value(f32::from(*v))),
            crossing_depth: by_block(blocks, &self.crossing_depth, |b, v| b.crossing_depth.value(f32::from(*v))),
            shading_normal: by_block(blocks, &self.shading_normal, |_, n| octahedral::normal_if_any(*n)),
            tangent: by_block(blocks, &self.tangent, |b, (direction, length)| {
                octahedral::normal_if_any(*direction) * b.tangent.value(f32::from(*length))
            }),
            shadow_coefficient: by_block(blocks, &self.shadow_coefficient, |b, v| {
                b.shadow_coefficient.value(f32::from(*v))
            }),
            ..Cloud::new(self.origin)
        };
        if self.looks.iter().any(|l| !l.has_normal) {
            let has_normal = |i: usize| look(&blocks[i / BLOCK], &self.look[i]).has_normal;
            let normals = cloud.normal.par_iter_mut().enumerate().with_min_len(FEW * BLOCK);
            normals.filter(|(i, _)| !has_normal(*i)).for_each(|(_, n)| *n = Vec3::ZERO);
        }
        cloud
    }

    /// Number of splats.
    pub fn len(&self) -> usize {
        self.position.len()
    }

    /// True without splats.
    pub fn is_empty(&self) -> bool {
        self.position.is_empty()
    }

    /// Bytes held.
    pub fn bytes(&self) -> u64 {
        let rows = size_of_val(&*self.look)
            + size_of_val(&*self.position)
            + size_of_val(&*self.radius)
            + size_of_val(&*self.cross_section)
            + size_of_val(&*self.color)
            + size_of_val(&*self.normal)
            + size_of_val(&*self.value)
            + size_of_val(&*self.crossing_depth)
            + size_of_val(&*self.shading_normal)
            + size_of_val(&*self.tangent)
            + size_of_val(&*self.shadow_coefficient);
        (rows + size_of_val(&*self.blocks) + size_of_val(&*self.looks)) as u64
    }
}

/// A column made from another, each entry by its block.
fn by_block<Q: Sync, T: Clone + Default + Send>(
    blocks: &[Block],
    from: &[Q],
    entry: impl Fn(&Block, &Q) -> T + Sync,
) -> Vec<T> {
    let mut out = vec![T::default(); from.len()];
    let parts = out.par_chunks_mut(BLOCK).zip(from.par_chunks(BLOCK)).zip(blocks).with_min_len(FEW);
    // Loops over one block each, of which what they read of it leaves vectors of lanes.
    parts.for_each(|((out, from), block)| out.iter_mut().zip(from).for_each(|(to, v)| *to = entry(block, v)));
    out
}
