//! The attributes of splats as the kernels of projection and shading read them: uploaded once for both.

use crate::{Cloud, Error};
use glam::Vec3;
use rayon::prelude::*;
use splat_shaders::{BufferId, Joined, Overflow, Recording};

/// Words of a splat's look: cross-section, ids and kind, colour.
const LOOK_WORDS: usize = 5;

/// How many splats, and what each has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttributeRoom {
    /// Splats.
    pub splats: u32,
    /// Words of a splat's normal, semi-axis and normal of shading: 0, 3 without the last two, 6 without the last, 9.
    pub frame_words: u32,
}

/// The buffers of a recording that hold attributes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct AttributeBuffers {
    /// Three f32 a splat, world offsets.
    pub positions: BufferId,
    /// Two f32 a splat, the radius of its kernel and of the sphere that holds it.
    pub radii: BufferId,
    /// Cross-section, material | footprint << 16 | kind << 24, colour.
    pub looks: BufferId,
    /// Normal, semi-axis of the disc, and normal of shading, where the cloud has them.
    pub frames: BufferId,
}

impl AttributeBuffers {
    /// Records their uploads.
    pub fn record(r: &mut Recording, room: AttributeRoom) -> Self {
        let words = |n: u32| 4 * u64::from(n) * u64::from(room.splats);
        Self {
            positions: r.input("positions", words(3)),
            radii: r.input("radii", words(2)),
            looks: r.input("looks", words(LOOK_WORDS as u32)),
            frames: r.input("frames", words(room.frame_words)),
        }
    }

    /// In the order of bindings.
    pub fn buffers(&self) -> [BufferId; 4] {
        [self.positions, self.radii, self.looks, self.frames]
    }

    /// Where they lie in the whole that their recording was joined to.
    pub fn in_joined(&self, joined: &Joined) -> Self {
        let [positions, radii, looks, frames] = self.buffers().map(|buffer| joined.buffer(buffer));
        Self { positions, radii, looks, frames }
    }

    /// Each beside its twin, as [`Recording::join`] takes them.
    pub fn shared(&self, with: &Self) -> [(BufferId, BufferId); 4] {
        let buffers = self.buffers();
        let others = with.buffers();
        std::array::from_fn(|k| (buffers[k], others[k]))
    }
}

/// The bytes of some splats' attributes.
#[derive(Debug, Clone, PartialEq)]
pub struct Attributes {
    bytes: [Vec<u8>; 4],
    room: AttributeRoom,
    /// Greatest material and footprint.
    greatest: [u32; 2],
}

impl Attributes {
    /// Of a cloud, or of the splats `ids` of it, in their order.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than 2³² splats, [`Error::Invalid`] for an id that no splat has; those of [`Cloud::validate`], since a
    /// device need not know what is no number.
    pub fn new(cloud: &Cloud, ids: Option<&[u32]>) -> Result<Self, Error> {
        cloud.validate()?;
        let n = ids.map_or(cloud.len(), <[u32]>::len);
        let splats = u32::try_from(n)
            .map_err(|_| Error::Overflow(Overflow { what: "splats", needed: n as u64, had: u32::MAX.into() }))?;
        let wrong = ids.and_then(|ids| ids.iter().position(|&id| id as usize >= cloud.len()));
        if let (Some(at), Some(ids)) = (wrong, ids) {
            return Err(Error::invalid("place", at, "id", ids[at], "the id of a splat"));
        }
        let id = |place: usize| ids.map_or(place, |ids| ids[place] as usize);
        let columns = [&cloud.normal, &cloud.tangent, &cloud.shading_normal];
        let frame_words = 3 * columns.iter().rposition(|column| !column.is_empty()).map_or(0, |last| last as u32 + 1);
        let position = |i: usize| cloud.position[i].to_array();
        let radii = |i: usize| [cloud.radius[i], cloud.radius[i].max(cloud.tangent_of(i).length())];
        let look = |i: usize| {
            let [r, g, b] = cloud.color[i].map(f32::to_bits);
            let tables =
                u32::from(cloud.material[i]) | u32::from(cloud.footprint[i]) << 16 | (cloud.kind[i] as u32) << 24;
            [cloud.cross_section[i].to_bits(), tables, r, g, b]
        };
        let frame = |i: usize| columns.map(|column| column.get(i).copied().unwrap_or(Vec3::ZERO));
        let frames = match frame_words {
            0 => Vec::new(),
            3 => rows(n, |k| {
                let [normal, ..] = frame(id(k));
                normal.to_array()
            }),
            6 => rows(n, |k| {
                let [a, b, _] = frame(id(k));
                [a.x, a.y, a.z, b.x, b.y, b.z]
            }),
            _ => rows(n, |k| {
                let [a, b, c] = frame(id(k));
                [a.x, a.y, a.z, b.x, b.y, b.z, c.x, c.y, c.z]
            }),
        };
        let greatest = (0..n).into_par_iter().with_min_len(1 << 14).map(|k| {
            let i = id(k);
            [u32::from(cloud.material[i]), u32::from(cloud.footprint[i])]
        });
        Ok(Self {
            bytes: [rows(n, |k| position(id(k))), rows(n, |k| radii(id(k))), rows(n, |k| look(id(k))), frames],
            room: AttributeRoom { splats, frame_words },
            greatest: greatest.reduce(|| [0; 2], |a, b| [a[0].max(b[0]), a[1].max(b[1])]),
        })
    }

    /// What they take.
    pub fn room(&self) -> AttributeRoom {
        self.room
    }

    /// The bytes with the buffers that they go to.
    pub fn inputs(&self, buffers: &AttributeBuffers) -> [(BufferId, &[u8]); 4] {
        let buffers = buffers.buffers();
        std::array::from_fn(|k| (buffers[k], &self.bytes[k][..]))
    }

    /// Whether a recording has room for them, and the tables entries for their ids.
    pub(crate) fn check(&self, room: AttributeRoom, materials: usize, footprints: usize) -> Result<(), Error> {
        super::fits("splats", self.room.splats.into(), room.splats)?;
        if self.room.frame_words != room.frame_words {
            let found = self.room.frame_words as usize;
            let expected = room.frame_words as usize;
            return Err(Error::ColumnLength { attribute: "words of a frame", found, expected });
        }
        for (what, greatest, had) in
            [("material", self.greatest[0], materials), ("footprint", self.greatest[1], footprints)]
        {
            if self.room.splats > 0 && greatest as usize >= had {
                return Err(Error::invalid("splat", 0, what, greatest, "a known one"));
            }
        }
        Ok(())
    }
}

/// One row a splat, as bytes.
fn rows<T: bytemuck::Pod + Send, const N: usize>(n: usize, row: impl Fn(usize) -> [T; N] + Sync) -> Vec<u8>
where
    [T; N]: bytemuck::Pod,
{
    let mut bytes = vec![0u8; n * size_of::<[T; N]>()];
    let places = bytes.par_chunks_exact_mut(size_of::<[T; N]>()).enumerate().with_min_len(1 << 12);
    places.for_each(|(k, to)| to.copy_from_slice(bytemuck::bytes_of(&row(k))));
    bytes
}
