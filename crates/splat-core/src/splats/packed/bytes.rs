//! A packed cloud as bytes, and again: little-endian, one column after the other, as long as its counts say.

use super::block::{Block, Even, Look, Rooted};
use super::{BLOCK, PackedCloud};
use crate::{Error, SplatKind};
use glam::DVec3;

/// Columns that a cloud may lack, in the order of the bits that say so.
const OPTIONAL: usize = 6;
/// Bit of a look's kind that says that its splats have a normal.
const HAS_NORMAL: u8 = 0x80;
/// Numbers of a block that are f32.
const BLOCK_NUMBERS: usize = 25;

impl PackedCloud {
    /// The cloud as bytes: counts, the origin, blocks, looks, and the columns that it has.
    pub fn to_bytes(&self) -> Vec<u8> {
        let lengths = self.optional_lengths();
        let columns = (0..OPTIONAL).filter(|k| lengths[*k] > 0).fold(0u64, |bits, k| bits | 1 << k);
        let mut out = Vec::with_capacity(self.bytes() as usize + 48);
        for count in [self.len() as u64, self.looks.len() as u64, columns] {
            out.extend(count.to_le_bytes());
        }
        out.extend(self.origin.to_array().iter().flat_map(|v| v.to_le_bytes()));
        for block in &self.blocks {
            out.extend(block.numbers().iter().flat_map(|v| v.to_le_bytes()));
            out.extend(block.first_look.to_le_bytes());
        }
        for look in &self.looks {
            out.extend(look.object.to_le_bytes());
            out.extend(look.material.to_le_bytes());
            out.extend([look.footprint, look.kind as u8 | if look.has_normal { HAS_NORMAL } else { 0 }]);
        }
        out.extend(&self.look);
        out.extend(self.position.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        out.extend(&self.radius);
        out.extend(self.cross_section.iter().flat_map(|v| v.to_le_bytes()));
        out.extend(self.color.as_flattened());
        out.extend(self.normal.as_flattened().iter().map(|v| *v as u8));
        out.extend(self.value.iter().flat_map(|v| v.to_le_bytes()));
        out.extend(self.crossing_depth.iter().flat_map(|v| v.to_le_bytes()));
        out.extend(self.shading_normal.as_flattened().iter().map(|v| *v as u8));
        out.extend(self.tangent.iter().flat_map(|([a, b], length)| [*a as u8, *b as u8, *length]));
        out.extend(&self.shadow_coefficient);
        out
    }

    /// A cloud of the bytes that [`Self::to_bytes`] gave. What it unpacks to is to be validated: steps may be any numbers.
    ///
    /// # Errors
    /// [`Error::Invalid`] where there are fewer bytes than the counts say, or more, for a kind that there is not, and for a splat whose look
    /// is not in the list.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let mut rest = Rest { bytes, total: bytes.len() };
        let [count, looks, columns] = rest.rows(3, u64::from_le_bytes)?[..] else { return Err(rest.short()) };
        let [count, looks] = [count, looks].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
        let has = |k: usize| if columns >> k & 1 == 1 { count } else { 0 };
        let origin = DVec3::from_slice(&rest.rows(3, f64::from_le_bytes)?);
        let blocks = rest.rows(count.div_ceil(BLOCK), |row: [u8; 4 * BLOCK_NUMBERS + 4]| {
            let (words, _) = row.as_chunks::<4>();
            let numbers = std::array::from_fn(|k| f32::from_le_bytes(words[k]));
            Block::of_numbers(&numbers, u32::from_le_bytes(words[BLOCK_NUMBERS]))
        })?;
        let looks = rest.rows(looks, look)?.into_iter().enumerate();
        let known = |(i, look): (usize, Option<Look>)| {
            look.ok_or_else(|| Error::invalid("look", i, "kind", "another", "0, 1 or 2"))
        };
        let looks = looks.map(known).collect::<Result<_, _>>()?;
        let short = |[a, b]: [u8; 2]| u16::from_le_bytes([a, b]);
        let direction = |row: [u8; 2]| row.map(|b| b as i8);
        let packed = Self {
            origin,
            look: rest.rows(count, |[b]: [u8; 1]| b)?,
            position: rest.rows(count, |[a, b, c, d, e, f]: [u8; 6]| [short([a, b]), short([c, d]), short([e, f])])?,
            radius: rest.rows(count, |[b]: [u8; 1]| b)?,
            cross_section: rest.rows(count, short)?,
            color: rest.rows(count, |color: [u8; 3]| color)?,
            normal: rest.rows(has(0), direction)?,
            value: rest.rows(has(1), short)?,
            crossing_depth: rest.rows(has(2), short)?,
            shading_normal: rest.rows(has(3), direction)?,
            tangent: rest.rows(has(4), |[a, b, length]: [u8; 3]| (direction([a, b]), length))?,
            shadow_coefficient: rest.rows(has(5), |[b]: [u8; 1]| b)?,
            blocks,
            looks,
        };
        if !rest.bytes.is_empty() {
            return Err(Error::invalid("packed cloud", 0, "bytes", bytes.len(), "as many as its counts say"));
        }
        let known = |i: &usize| {
            let at = packed.blocks[i / BLOCK].first_look as usize + usize::from(packed.look[*i]);
            at < packed.looks.len()
        };
        match (0..packed.len()).find(|i| !known(i)) {
            Some(i) => {
                Err(Error::invalid("splat", i, "look", packed.look[i], "a place in the list of its block's looks"))
            }
            None => Ok(packed),
        }
    }

    /// Entries of the columns that a cloud may lack.
    fn optional_lengths(&self) -> [usize; OPTIONAL] {
        [
            self.normal.len(),
            self.value.len(),
            self.crossing_depth.len(),
            self.shading_normal.len(),
            self.tangent.len(),
            self.shadow_coefficient.len(),
        ]
    }
}

/// A look; `None` for a kind that there is not.
fn look(bytes: [u8; 8]) -> Option<Look> {
    let [a, b, c, d, e, f, footprint, kind] = bytes;
    let kinds = [SplatKind::Medium, SplatKind::Surface, SplatKind::Opaque];
    Some(Look {
        object: u32::from_le_bytes([a, b, c, d]),
        material: u16::from_le_bytes([e, f]),
        footprint,
        kind: *kinds.get(usize::from(kind & !HAS_NORMAL))?,
        has_normal: kind & HAS_NORMAL != 0,
    })
}

impl Block {
    /// What it counts from and in, in the order of its fields.
    fn numbers(&self) -> [f32; BLOCK_NUMBERS] {
        let [x, y, z] = self.position;
        let even = |e: Even| [e.low, e.step];
        let rooted = |r: Rooted| [r.low, r.root, r.step];
        let evens = [x, y, z, self.value, self.shadow_coefficient].map(even);
        let roots = [self.radius, self.cross_section, self.color, self.crossing_depth, self.tangent].map(rooted);
        let mut numbers = [0.0; BLOCK_NUMBERS];
        numbers[..10].copy_from_slice(evens.as_flattened());
        numbers[10..].copy_from_slice(roots.as_flattened());
        numbers
    }

    fn of_numbers(n: &[f32; BLOCK_NUMBERS], first_look: u32) -> Self {
        let even = |k: usize| Even { low: n[k], step: n[k + 1] };
        let rooted = |k: usize| Rooted { low: n[k], root: n[k + 1], step: n[k + 2] };
        Self {
            position: [even(0), even(2), even(4)],
            value: even(6),
            shadow_coefficient: even(8),
            radius: rooted(10),
            cross_section: rooted(13),
            color: rooted(16),
            crossing_depth: rooted(19),
            tangent: rooted(22),
            first_look,
        }
    }
}

/// Bytes that are not read yet.
struct Rest<'a> {
    bytes: &'a [u8],
    /// How many there were.
    total: usize,
}

impl Rest<'_> {
    fn short(&self) -> Error {
        Error::invalid("packed cloud", 0, "bytes", self.total, "as many as its counts say, more than these")
    }

    /// Rows of `N` bytes each.
    fn rows<const N: usize, T>(&mut self, count: usize, decode: impl Fn([u8; N]) -> T) -> Result<Vec<T>, Error> {
        let (rows, rest) = self.bytes.split_at_checked(count.saturating_mul(N)).ok_or_else(|| self.short())?;
        self.bytes = rest;
        Ok(rows.as_chunks::<N>().0.iter().map(|row| decode(*row)).collect())
    }
}
