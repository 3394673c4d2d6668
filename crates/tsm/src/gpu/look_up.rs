//! Look-ups as a recording: the GPU's twin of [`ShadowMap`]'s `transmittance`, for many receivers at once.
//!
//! The same steps in the same order (see `lookup.rs`): the place of a receiver, its four nearest cells, the knots around
//! its distance by halves, e^−A. Products and sums are rounded one by one; quotients and roots, which a device may round
//! otherwise, are corrected to the CPU's; e^−A is a series. So transmittances agree within 10⁻⁶ where a driver rounds each
//! product and sum by itself; of that e^−A takes the most, 3·10⁻⁷. Where it fuses them a place moves by a unit in the last
//! place, and transmittances by that times how steep they are there: 10⁻⁵ is the promise then. Where a surface lies within
//! rounding of a receiver's distance, its step may fall on the other side.
//!
//! Positions are subtracted from the light's in f64 by the CPU. Tables of polar angles take arc functions in f64, which
//! devices do not have: their look-ups are the CPU's ([`Room::for_map`]).

use super::batches::read;
use crate::mapping::{Mapping, Table, with_mapping};
use crate::shadow_map::{Absorbances, Matter};
use crate::table::Lists;
use crate::{Error, ShadowMap};
use rayon::prelude::*;
use splat_core::{Receiver, SplatKind};
use splat_shaders::layouts::ShadowView;
use splat_shaders::{BufferId, Groups, Overflow, Recording, kernels};

/// Threads of a workgroup.
const GROUP: u32 = 256;
/// Bytes of a receiver.
const RECEIVER: u64 = 32;

/// Capacities of a recording of look-ups, in elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Room {
    /// Receivers.
    pub receivers: u32,
    /// Cells of the table.
    pub cells: u32,
    /// Entries of media and surfaces.
    pub entries: u32,
    /// Channels of absorbance, 1 or 3.
    pub channels: u32,
    /// Directions of an octahedral table.
    pub directions: u32,
    /// Whether an opaque disc may end a list.
    pub opaque: bool,
}

impl Room {
    /// Room for this map and so many receivers; `None` where its look-ups are the CPU's: a table of polar angles, or 2³²
    /// entries and more.
    pub fn for_map(map: &ShadowMap, receivers: u32) -> Option<Self> {
        let directions = match &map.table {
            Table::Octahedral(table) => table.quarter().len() as u32,
            Table::Planar(_) => 0,
            Table::PolarAzimuth(_) => return None,
        };
        let entries = u32::try_from(map.counts().entries).ok()?;
        let cells = map.cells();
        let channels = map.channels() as u32;
        let opaque = !map.opaque.is_empty();
        Some(Self { receivers, cells, entries, channels, directions, opaque })
    }

    /// The most receivers for which no buffer of theirs is larger than this.
    pub fn most_receivers(binding_bytes: u64) -> u32 {
        u32::try_from(binding_bytes / RECEIVER).unwrap_or(u32::MAX)
    }
}

/// Recorded look-ups and the buffer that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedLookUp {
    /// The commands of the device.
    pub recording: Recording,
    /// The room it has.
    pub room: Room,
    /// Read back: transmittances, f32 a channel.
    pub lights: BufferId,
    pub(super) view: BufferId,
    pub(super) receivers: BufferId,
    pub(super) map: [BufferId; 5],
}

/// The bytes of a map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapUploads {
    pub(super) view: ShadowView,
    pub(super) bytes: [Vec<u8>; 5],
}

/// The bytes of some receivers.
#[derive(Debug, Clone, PartialEq)]
pub struct ReceiverUploads {
    view: Vec<u8>,
    receivers: Vec<u8>,
    count: usize,
}

/// Records look-ups with this room.
pub fn record_look_up(room: Room) -> RecordedLookUp {
    let Room { receivers: count, cells, entries, channels, directions, opaque } = room;
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32| 4 * u64::from(n);
    let view = r.input("view", size_of::<ShadowView>() as u64);
    let receivers = r.input("receivers", RECEIVER * u64::from(count));
    let map = [
        r.input("spans", 4 * words(cells)),
        r.input("distances", words(entries)),
        r.input("totals", words(entries) * u64::from(channels)),
        r.input("opaque", if opaque { words(cells) } else { 0 }),
        r.input("directions", 3 * words(directions)),
    ];
    let lights = r.scratch("lights", words(count) * u64::from(channels));
    let [spans, distances, totals, opaque, directions] = map;
    let bound = [view, receivers, spans, distances, totals, opaque, directions, lights];
    r.dispatch(&kernels::TSM_LOOK_UP, Groups::cover(count.div_ceil(GROUP)), &bound, &[]);
    r.read(lights);
    RecordedLookUp { recording, room, lights, view, receivers, map }
}

impl RecordedLookUp {
    /// The uploads of a map that fits these capacities.
    ///
    /// # Errors
    /// [`Error::Overflow`] for a map that is larger or otherwise than the room.
    pub fn map(&self, map: &ShadowMap) -> Result<MapUploads, Error> {
        let needed = Room::for_map(map, 0);
        let sizes = |room: &Room| [room.cells, room.entries, room.directions, u32::from(room.opaque)];
        let had = sizes(&self.room);
        let needed = needed.as_ref().map_or([u32::MAX; 4], sizes);
        let names = ["cells", "entries", "directions", "opaque discs"];
        for ((what, needed), had) in names.into_iter().zip(needed).zip(had) {
            if needed > had {
                return Err(Error::Overflow(Overflow { what, needed: needed.into(), had: had.into() }));
            }
        }
        let had = u64::from(self.room.channels);
        let needed = map.channels() as u64;
        if needed != had {
            return Err(Error::Overflow(Overflow { what: "channels", needed, had }));
        }
        let (spans, distances, totals) = match &map.absorbances {
            Absorbances::Mono(matter) => joint(matter, map.cells() as usize),
            Absorbances::Rgb(matter) => joint(matter, map.cells() as usize),
        };
        let directions: Vec<[f32; 3]> = match &map.table {
            Table::Octahedral(table) => table.quarter().iter().map(|d| d.to_array()).collect(),
            _ => Vec::new(),
        };
        let bytes = [
            bytemuck::cast_slice(&spans).to_vec(),
            bytemuck::cast_slice(&distances).to_vec(),
            bytemuck::cast_slice(&totals).to_vec(),
            bytemuck::cast_slice(&map.opaque).to_vec(),
            bytemuck::cast_slice(&directions).to_vec(),
        ];
        Ok(MapUploads { view: view_of(map, self.room.channels), bytes })
    }

    /// The bytes of receivers, as the light of this map sees them.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than there is room for.
    pub fn receivers(
        &self,
        map: &ShadowMap,
        uploads: &MapUploads,
        receivers: &[Receiver],
    ) -> Result<ReceiverUploads, Error> {
        let needed = receivers.len() as u64;
        let had = u64::from(self.room.receivers);
        if needed > had {
            return Err(Error::Overflow(Overflow { what: "receivers", needed, had }));
        }
        let words = |receiver: &Receiver| -> [f32; 8] {
            let p = map.frame.position(receiver.position);
            let n = map.frame.turn(receiver.normal);
            let lift = map.frame.length(receiver.radius) * map.bias;
            let is_surface = f32::from(u8::from(receiver.kind != SplatKind::Medium));
            [p.x, p.y, p.z, lift, n.x, n.y, n.z, is_surface]
        };
        let rows: Vec<[f32; 8]> = receivers.par_iter().with_min_len(1 << 12).map(words).collect();
        let view = ShadowView { receivers: receivers.len() as u32, ..uploads.view };
        Ok(ReceiverUploads {
            view: bytemuck::bytes_of(&view).to_vec(),
            receivers: bytemuck::cast_slice(&rows).to_vec(),
            count: receivers.len(),
        })
    }

    /// The uploads of a run with the buffers that they go to. The map of the run before stays unless one is given.
    pub fn inputs<'a>(&self, map: Option<&'a MapUploads>, receivers: &'a ReceiverUploads) -> Vec<(BufferId, &'a [u8])> {
        let of_receivers = [(self.view, receivers.view.as_slice()), (self.receivers, &receivers.receivers)];
        let of_map = map.into_iter().flat_map(|map| self.map.into_iter().zip(map.bytes.iter().map(Vec::as_slice)));
        of_receivers.into_iter().chain(of_map).collect()
    }

    /// Transmittances per channel, from the bytes that were read back of [`RecordedLookUp::lights`] after a run with these
    /// receivers.
    ///
    /// # Errors
    /// [`Error::ReadBack`] for fewer bytes than a run gives.
    pub fn transmittances(&self, lights: &[u8], receivers: &ReceiverUploads) -> Result<Vec<[f32; 3]>, Error> {
        if self.room.channels == 3 {
            return read("lights", lights, receivers.count);
        }
        Ok(read::<f32>("lights", lights, receivers.count)?.into_iter().map(|t| [t; 3]).collect())
    }
}

/// A map as look-ups see it, with lists of so many channels, and no receivers.
pub(super) fn view_of(map: &ShadowMap, channels: u32) -> ShadowView {
    let planar = |perspective| if perspective { 1 } else { 2 };
    let (least, size, cell, mapping) = match &map.table {
        Table::Planar(table) => (table.min.to_array(), table.size, table.cell, planar(table.perspective)),
        Table::Octahedral(_) | Table::PolarAzimuth(_) => ([0.0; 2], with_mapping!(&map.table, m => m.size()), 1.0, 0),
    };
    ShadowView {
        least,
        size,
        cell,
        ramp: map.ramp,
        dark_from: map.dark_from.unwrap_or(f32::MAX),
        mapping,
        receivers: 0,
        channels,
        opaque: u32::from(!map.opaque.is_empty()),
        unused: 0,
    }
}

/// Spans, distances and totals.
type Joint = (Vec<[u32; 2]>, Vec<f32>, Vec<f32>);

/// The lists of media, and of surfaces behind them.
fn joint<const C: usize>(matter: &Matter<C>, cells: usize) -> Joint {
    let (mut spans, mut distances, mut totals): Joint = (Vec::with_capacity(2 * cells), Vec::new(), Vec::new());
    for lists in [&matter.media, &matter.surfaces] {
        let Some((span, distance, total)) = lists.as_ref().map(Lists::parts) else {
            spans.resize(spans.len() + cells, [0; 2]);
            continue;
        };
        let before = distances.len() as u32;
        spans.extend(span.iter().map(|[begin, kept]| [begin.wrapping_add(before), *kept]));
        distances.extend_from_slice(distance);
        totals.extend_from_slice(total.as_flattened());
    }
    (spans, distances, totals)
}
