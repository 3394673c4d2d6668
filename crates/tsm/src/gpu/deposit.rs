//! Deposits as a recording: the GPU's twin of `media.rs` and `surfaces.rs`.
//!
//! Casters become footprints on the table; each counts the cells that it overlaps, the counts are scanned, and each footprint
//! leaves its entries at its place, behind those that the processor gives. Two times the same walk through cells, since what
//! it costs is little beside the sort of what it leaves.
//!
//! Operation by operation it is the CPU's arithmetic, so that entries have the same bits where a driver rounds each product
//! and sum by itself, but for two things: positions are subtracted from the light's in pairs of f32, which is f64's result
//! but for rare ties; and quotients and roots are corrected to the CPU's. Where a driver fuses products and sums an entry
//! differs by some units in the last place, and a cell at the rim of a footprint, which holds next to nothing of it, may be there
//! or not.

use super::MOST_ENTRIES;
use super::casting::Casting;
use crate::Error;
use crate::mapping::{Mapping, Table, with_mapping};
use crate::table::stop_of;
use splat_core::raster::gpu::{AttributeBuffers, AttributeRoom};
use splat_shaders::layouts::{CastState, CastView, ListView, Scan, SortState};
use splat_shaders::radix::{SCAN_BLOCK, Scanned};
use splat_shaders::{BufferId, Groups, Overflow, Recording, kernels};

/// Threads of a workgroup.
const GROUP: u32 = 256;

/// Capacities of a recording of deposits, in elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CastRoom {
    /// Splats and their attributes.
    pub attributes: AttributeRoom,
    /// Casters that the device deposits.
    pub casters: u32,
    /// Entries, with those that are given.
    pub entries: u32,
    /// Cells: those of the table for media, and as many for surfaces.
    pub cells: u32,
    /// Channels of absorbance, 1 or 3.
    pub channels: u32,
    /// Directions of an octahedral table.
    pub directions: u32,
    /// Whether an opaque disc may end a list.
    pub opaque: bool,
    /// Whether there are discs, or colours.
    pub planes: bool,
    /// Vectors of the tables of materials and footprints.
    pub tables: u32,
}

/// Recorded deposits and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedCast {
    /// The commands of the device.
    pub recording: Recording,
    /// The room it has.
    pub room: CastRoom,
    /// Input: the splats.
    pub attributes: AttributeBuffers,
    /// Read back: one [`CastState`].
    pub state: BufferId,
    /// Read back: cells, distances and absorbances of the entries.
    pub entries: [BufferId; 3],
    pub(super) view: BufferId,
    pub(super) list_view: BufferId,
    pub(super) sort: BufferId,
    pub(super) digits: BufferId,
    pub(super) opaque: BufferId,
    pub(super) directions: BufferId,
    inputs: [BufferId; 4],
}

/// The bytes of some casting beside the attributes of its splats.
#[derive(Debug, Clone, PartialEq)]
pub struct CastUploads {
    bytes: Vec<Vec<u8>>,
    view: CastView,
}

impl CastUploads {
    /// Says how many shares of the shadow there are.
    pub(super) fn set_shares(&mut self, shares: u32) {
        self.view.shares = shares;
    }
}

impl Casting {
    /// Room for it, and for so many entries; the attributes are those of the splats that casters are looked for among.
    pub fn room(&self, attributes: AttributeRoom, entries: u32) -> CastRoom {
        let directions = match &self.map.table {
            Table::Octahedral(table) => table.quarter().len() as u32,
            Table::Planar(_) | Table::PolarAzimuth(_) => 0,
        };
        CastRoom {
            attributes,
            casters: self.plain.len() as u32,
            entries: entries.min(MOST_ENTRIES),
            cells: 2 * self.map.cells(),
            channels: self.channels,
            directions,
            opaque: !self.map.opaque.is_empty(),
            planes: self.has_planes,
            tables: self.tables.len() as u32,
        }
    }
}

/// Vectors of a footprint.
fn vectors(planes: bool) -> u32 {
    if planes { 4 } else { 2 }
}

/// Records deposits with this room.
pub fn record_cast(room: CastRoom) -> RecordedCast {
    let mut recording = Recording::default();
    let r = &mut recording;
    let words = |n: u32| 4 * u64::from(n);
    let view = r.input("cast view", size_of::<CastView>() as u64);
    let attributes = AttributeBuffers::record(r, room.attributes);
    let casters = r.input("casters", words(room.casters));
    let tables = r.input("cast tables", 4 * words(room.tables));
    let scan = r.input("cast scan", size_of::<Scan>() as u64);
    let list_view = r.input("list view", size_of::<ListView>() as u64);
    let opaque = r.input("opaque discs", if room.opaque { 2 * u64::from(room.cells) } else { 0 });
    let directions = r.input("directions", 3 * words(room.directions));
    let channels = u64::from(room.channels);
    let entries = [("cells", 1), ("distances", 1), ("absorbances", channels)]
        .map(|(name, numbers)| r.input(name, words(room.entries) * numbers));
    // Room for one vector at least: wgpu asks for that much.
    let footprints = r.scratch("footprints", 16 * u64::from(vectors(room.planes)) * u64::from(room.casters.max(1)));
    let counts = Scanned::scratch(r, scan, ["cell counts", "cell sums"], room.casters);
    let sort = r.scratch("sort", size_of::<SortState>() as u64);
    let digits = r.scratch("digit scan", size_of::<Scan>() as u64);
    let state = r.scratch("cast state", size_of::<CastState>() as u64);

    let each = Groups::cover(room.casters.div_ceil(GROUP));
    let [positions, radii, looks, frames] = attributes.buffers();
    let cast = [view, casters, positions, radii, looks, frames, tables, footprints];
    r.dispatch(&kernels::TSM_CAST, each, &cast, &[]);
    r.dispatch(&kernels::TSM_COUNT, each, &[view, footprints, opaque, directions, counts.numbers], &[]);
    counts.record(r, Groups::cover(room.casters.div_ceil(SCAN_BLOCK)));
    r.dispatch(&kernels::TSM_PREPARE, Groups::cover(1), &[view, scan, list_view, sort, digits, state], &[room.entries]);
    let [cells, distances, absorbances] = entries;
    let deposit = [view, footprints, opaque, directions, counts.numbers, cells, distances, absorbances];
    r.dispatch(&kernels::TSM_DEPOSIT, each, &deposit, &[room.entries]);
    [state, cells, distances, absorbances].into_iter().for_each(|buffer| r.read(buffer));
    let inputs = [casters, tables, scan, list_view];
    RecordedCast {
        recording,
        room,
        attributes,
        state,
        entries,
        view,
        list_view,
        sort,
        digits,
        opaque,
        directions,
        inputs,
    }
}

impl RecordedCast {
    /// The bytes of a casting beside attributes, for all splats of its cloud, or for the splats `ids` in their order. All
    /// casters must be among `ids`.
    ///
    /// # Errors
    /// [`Error::Overflow`] for more than there is room for, casters among the splats `ids` included.
    pub fn uploads(&self, casting: &Casting, ids: Option<&[u32]>) -> Result<CastUploads, Error> {
        self.check(casting)?;
        let view = self.view_of(casting);
        let stop = stop_of(casting.limit) as u64;
        let list = ListView {
            stop: [stop as u32, (stop >> 32) as u32],
            entries: 0,
            cells: self.room.cells,
            channels: self.room.channels,
            unused: 0,
        };
        let directions: Vec<[f32; 3]> = match &casting.map.table {
            Table::Octahedral(table) => table.quarter().iter().map(|d| d.to_array()).collect(),
            Table::Planar(_) | Table::PolarAzimuth(_) => Vec::new(),
        };
        let scan = Scan { count: view.casters, total: 0 };
        Ok(CastUploads {
            view,
            bytes: vec![
                bytemuck::cast_slice(&self.places(casting, ids)?).to_vec(),
                bytemuck::cast_slice(&casting.tables).to_vec(),
                bytemuck::bytes_of(&scan).to_vec(),
                bytemuck::bytes_of(&list).to_vec(),
                bytemuck::cast_slice(&casting.map.opaque).to_vec(),
                bytemuck::cast_slice(&directions).to_vec(),
                bytemuck::cast_slice(&casting.given.cells).to_vec(),
                bytemuck::cast_slice(&casting.given.distances).to_vec(),
                bytemuck::cast_slice(&casting.given.absorbances).to_vec(),
            ],
        })
    }

    fn check(&self, casting: &Casting) -> Result<(), Error> {
        let needed = casting.room(self.room.attributes, u32::try_from(casting.given()).unwrap_or(u32::MAX));
        let sizes = |room: &CastRoom| {
            let flags = [room.opaque, room.planes].map(u32::from);
            [room.casters, room.entries, room.cells, room.directions, room.tables, flags[0], flags[1]]
        };
        let names = ["casters", "entries", "cells", "directions", "tables", "opaque discs", "planes"];
        for ((what, needed), had) in names.into_iter().zip(sizes(&needed)).zip(sizes(&self.room)) {
            if needed > had {
                return Err(Error::Overflow(Overflow { what, needed: needed.into(), had: had.into() }));
            }
        }
        let needed = needed.channels;
        let had = self.room.channels;
        if needed != had {
            return Err(Error::Overflow(Overflow { what: "channels", needed: needed.into(), had: had.into() }));
        }
        Ok(())
    }

    /// Where plain casters lie among the splats.
    fn places(&self, casting: &Casting, ids: Option<&[u32]>) -> Result<Vec<u32>, Error> {
        let had = self.room.attributes.splats;
        let strange = |id: u32| {
            Error::Overflow(Overflow { what: "casters among splats", needed: u64::from(id) + 1, had: had.into() })
        };
        let Some(ids) = ids else {
            return match casting.plain.iter().find(|id| **id >= had) {
                Some(id) => Err(strange(*id)),
                None => Ok(casting.plain.clone()),
            };
        };
        let most = ids.iter().max().map_or(0, |most| *most as usize + 1);
        let mut place = vec![u32::MAX; most];
        (0u32..had).zip(ids).for_each(|(at, id)| place[*id as usize] = at);
        let place_of = |id: &u32| match place.get(*id as usize) {
            Some(at) if *at != u32::MAX => Ok(*at),
            _ => Err(strange(*id)),
        };
        casting.plain.iter().map(place_of).collect()
    }

    fn view_of(&self, casting: &Casting) -> CastView {
        let map = &casting.map;
        let (light, rotation, unit) = map.frame.parts();
        let [axis_x, axis_y, axis_z] =
            [rotation.x_axis, rotation.y_axis, rotation.z_axis].map(|a| a.extend(0.0).to_array());
        let high = light.as_vec3();
        let low = (light - high.as_dvec3()).as_vec3();
        let size = with_mapping!(&map.table, m => m.size());
        let (least, cell, mapping) = match &map.table {
            Table::Planar(table) => (table.min.to_array(), table.cell, if table.perspective { 1 } else { 2 }),
            Table::Octahedral(_) | Table::PolarAzimuth(_) => ([0.0; 2], 1.0, 0),
        };
        CastView {
            axis_x,
            axis_y,
            axis_z,
            light_high: high.extend(0.0).to_array(),
            light_low: low.extend(0.0).to_array(),
            least,
            size,
            cell,
            mapping,
            inverse_measure: with_mapping!(&map.table, m => m.inverse_measure(0, 0)),
            unit: unit as f32,
            bias: map.bias,
            splats: self.room.attributes.splats,
            casters: casting.plain.len() as u32,
            given: casting.given() as u32,
            frame_words: self.room.attributes.frame_words,
            footprint_vectors: vectors(self.room.planes),
            channels: self.room.channels,
            opaque: u32::from(!map.opaque.is_empty()),
            materials: casting.tables.len() as u32 - casting.footprints - 1,
            footprints: casting.footprints,
            shares: 1,
            unused: 0,
        }
    }

    /// The uploads with the buffers that they go to; the attributes' are [`splat_core::raster::gpu::Attributes::inputs`].
    pub fn inputs<'a>(&self, uploads: &'a CastUploads) -> Vec<(BufferId, &'a [u8])> {
        let buffers = self.inputs.into_iter().chain([self.opaque, self.directions]).chain(self.entries);
        let bytes = uploads.bytes.iter().map(Vec::as_slice);
        let view = (self.view, bytemuck::bytes_of(&uploads.view));
        std::iter::once(view).chain(buffers.zip(bytes)).filter(|(_, bytes)| !bytes.is_empty()).collect()
    }

    /// The number of entries, from the bytes that were read back of [`RecordedCast::state`].
    ///
    /// # Errors
    /// [`Error::ReadBack`] for fewer bytes than a run gives, [`Error::Overflow`] where there was too little room for them.
    pub fn found(&self, state: &[u8]) -> Result<u32, Error> {
        let needed: u32 =
            super::batches::read::<CastState>("cast state", state, 1)?.iter().map(|state| state.entries).sum();
        let had = self.room.entries;
        if needed > had {
            return Err(Error::Overflow(Overflow { what: "entries", needed: needed.into(), had: had.into() }));
        }
        Ok(needed)
    }
}
