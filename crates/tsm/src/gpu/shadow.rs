//! Deposits, lists and look-ups as one recording: a map that stays on the device.
//!
//! [`record_map`] joins deposits and lists, whose lists can be read back as a map; [`record_shadow`] goes on with the light
//! at all splats, in the form that shading reads it ([`splat_core::shade::gpu`]), and reads back nothing but how many entries
//! there were. Where there was too little room for them, all light is what it would be without translucent splats, and
//! [`RecordedCast::found`] says how much room is needed: record again with that.

use super::batches::{Listed, joined, read};
use super::casting::Casting;
use super::deposit::{CastRoom, CastUploads, RecordedCast, record_cast};
use super::look_up::{Room, view_of};
use super::received::record_received;
use super::{Capacities, record};
use crate::shadow_map::Absorbances;
use crate::{Error, ShadowMap};
use splat_core::raster::gpu::AttributeBuffers;
use splat_shaders::layouts::ShadowView;
use splat_shaders::{BufferId, Overflow, Recording};

/// Recorded deposits and lists, and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedMap {
    /// The commands of the device.
    pub recording: Recording,
    /// Its deposits, whose buffers are those of the recording.
    pub cast: RecordedCast,
    /// Read back: spans of cells, distances and totals of knots.
    pub lists: [BufferId; 3],
}

/// Records deposits and the lists of them with this room.
pub fn record_map(room: CastRoom) -> RecordedMap {
    let cast = record_cast(room);
    let mut recording = cast.recording.clone();
    let lists = record(Capacities { entries: room.entries, cells: room.cells, channels: room.channels });
    let [cells, distances, absorbances] = cast.entries;
    let from = [cast.list_view, cast.sort, cast.digits, cells, distances, absorbances];
    let shared: Vec<_> = lists.inputs.into_iter().zip(from).collect();
    let in_lists = recording.join(&lists.recording, &shared);
    let lists = [lists.spans, lists.distances, lists.totals].map(|buffer| in_lists.buffer(buffer));
    recording.read_only(&[[cast.state].as_slice(), &lists].concat());
    RecordedMap { recording, cast, lists }
}

impl RecordedMap {
    /// The map of a casting, from the bytes that were read back of [`RecordedCast::state`] and of [`RecordedMap::lists`].
    ///
    /// # Errors
    /// As [`RecordedCast::found`].
    pub fn map(&self, casting: &Casting, state: &[u8], buffers: [&[u8]; 3]) -> Result<ShadowMap, Error> {
        let [spans, distances, totals] = buffers;
        let entries = self.cast.found(state)?;
        let channels = self.cast.room.channels;
        let cells = casting.map.cells() as usize;
        let spans: Vec<[u32; 2]> = read("spans", spans, 2 * cells)?;
        // Lists of surfaces begin behind the entries of media.
        let of_media = spans.get(cells).map_or(entries, |[begin, _]| *begin).min(entries);
        let listed = Listed {
            spans,
            distances: read("distances", distances, entries as usize)?,
            totals: read("totals", totals, (entries * channels) as usize)?,
        };
        let entries = [of_media.into(), (entries - of_media).into()];
        let absorbances = if channels == 3 {
            Absorbances::Rgb(joined(vec![listed], cells, entries)?)
        } else {
            Absorbances::Mono(joined(vec![listed], cells, entries)?)
        };
        Ok(casting.map.clone().with(absorbances))
    }
}

/// Recorded deposits, lists and look-ups, and the buffers that the caller meets.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedShadow {
    /// What the device is to do.
    pub recording: Recording,
    /// Its deposits, whose buffers are those of the recording.
    pub cast: RecordedCast,
    /// Read back: what all splats receive, three f32 each, behind those of the lights before.
    pub received: BufferId,
    shares: BufferId,
    shadow_view: BufferId,
}

/// The bytes of a shadow beside the attributes of its splats.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadowUploads {
    cast: CastUploads,
    shares: Vec<u8>,
    view: Vec<u8>,
}

/// Records the shadow of one light with this room, the `light`th of those that have one.
pub fn record_shadow(room: CastRoom, light: u32) -> RecordedShadow {
    let RecordedMap { mut recording, cast, lists } = record_map(room);
    let looked_up = Room {
        receivers: room.attributes.splats,
        cells: room.cells / 2,
        entries: room.entries,
        channels: room.channels,
        directions: room.directions,
        opaque: room.opaque,
    };
    let last = record_received(looked_up, room.attributes, light);
    let [spans, distances, totals] = lists;
    let known = [spans, distances, totals, cast.opaque, cast.directions];
    let shared = last.map.into_iter().zip(known).chain([(last.frame, cast.view)]);
    let shared: Vec<_> = shared.chain(last.attributes.shared(&cast.attributes)).collect();
    let joined = recording.join(&last.recording, &shared);
    let [received, shares, shadow_view] = [last.received, last.shares, last.view].map(|buffer| joined.buffer(buffer));
    recording.read_only(&[cast.state, received]);
    RecordedShadow { recording, cast, received, shares, shadow_view }
}

impl RecordedShadow {
    /// The attributes of all splats.
    pub fn attributes(&self) -> &AttributeBuffers {
        &self.cast.attributes
    }

    /// The bytes of a casting beside attributes, as [`RecordedCast::uploads`]; `shares` has the share of a shadow that
    /// each splat takes, in \[0, 1\], or a single number for all splats.
    ///
    /// # Errors
    /// As [`RecordedCast::uploads`].
    pub fn uploads(&self, casting: &Casting, ids: Option<&[u32]>, shares: &[f32]) -> Result<ShadowUploads, Error> {
        let splats = self.cast.room.attributes.splats;
        let found = shares.len() as u64;
        if found != 1 && found != u64::from(splats) {
            return Err(Error::Overflow(Overflow { what: "shares of shadows", needed: found, had: splats.into() }));
        }
        let mut cast = self.cast.uploads(casting, ids)?;
        cast.set_shares(shares.len() as u32);
        let view = ShadowView { receivers: splats, ..view_of(&casting.map, casting.channels) };
        Ok(ShadowUploads {
            cast,
            shares: bytemuck::cast_slice(shares).to_vec(),
            view: bytemuck::bytes_of(&view).to_vec(),
        })
    }

    /// The uploads with the buffers that they go to.
    pub fn inputs<'a>(&self, uploads: &'a ShadowUploads) -> Vec<(BufferId, &'a [u8])> {
        let mut inputs = self.cast.inputs(&uploads.cast);
        inputs.extend([(self.shares, &uploads.shares[..]), (self.shadow_view, &uploads.view)]);
        inputs
    }
}
